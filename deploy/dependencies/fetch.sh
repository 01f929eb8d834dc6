#!/usr/bin/env bash
# Fetches what npm.txt lists for GROUP, and unpacks each package, alone and without running anything of it,
# into FOLDER/NAME. What is there already is left. Usage: deploy/dependencies/fetch.sh GROUP FOLDER
set -eu
list=$(dirname "$0")/npm.txt
[ $# -eq 2 ] || { echo "usage: $0 GROUP FOLDER" >&2; exit 2; }
command -v npm >/dev/null || { echo "fetch: npm is not installed" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
while read -r group package version _; do
    [ "$group" = "$1" ] || continue
    [ ! -e "$2/$package/package.json" ] || { echo "fetch: $package is there"; continue; }
    echo "fetch: $package $version"
    npm pack --silent --pack-destination "$scratch" "$package@$version" >/dev/null </dev/null
    mkdir -p "$2"
    tar xzf "$scratch"/*.tgz -C "$scratch"
    mv "$scratch/package" "$2/$package"
    rm "$scratch"/*.tgz
done < <(grep -E '^[a-z]' "$list")
