#!/usr/bin/env bash
# Installs the packages of debian.txt that are missing, and nothing else.
# Usage: deploy/dependencies/install.sh GROUP...   (build, run, demo, test, check, browser)
# Asks nothing. Runs apt-get only if something is missing, `apt-get update` only if apt does not
# know the package, and sudo only for who is not root.
set -eu
list=$(dirname "$0")/debian.txt
[ $# -gt 0 ] || { echo "usage: $0 GROUP..." >&2; exit 2; }

present() { # PACKAGE LINE
    case $2 in *'['*']')
        local tool=${2##*'['}
        command -v "${tool%']'}" >/dev/null && return 0 ;;
    esac
    dpkg-query -W -f '${Status}' "$1" 2>/dev/null | grep -q 'ok installed'
}

missing=()
while read -r group package what; do
    case " $* " in *" $group "*) ;; *) continue ;; esac
    present "$package" "$what" || missing+=("$package")
done < <(grep -E '^[a-z]' "$list")

[ ${#missing[@]} -gt 0 ] || { echo "deps: nothing is missing"; exit 0; }
echo "deps: installing ${missing[*]}"
if ! command -v apt-get >/dev/null; then
    echo "deps: no apt-get here; install what these packages of Debian 12 hold: ${missing[*]}" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "deps: neither root nor sudo" >&2; exit 1; }
    as_root=(sudo)
fi
run_apt() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y \
        -o Dpkg::Use-Pty=0 "$@"
}
# apt's lists may be absent or stale: try as they are, then with fresh ones.
if ! apt-cache show "${missing[@]}" >/dev/null 2>&1; then
    run_apt update
fi
run_apt install --no-install-recommends "${missing[@]}" || {
    run_apt update
    run_apt install --no-install-recommends "${missing[@]}"
}
