#!/usr/bin/env bash
# What `make install` puts under a DESTDIR works from there, modules included, and `make uninstall`
# takes every file of it away.
set -eu
cd "$(dirname "$0")/../.."
build=${1:-build}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# The default PREFIX: another would compile another library folder in, and the other checks use this
# build meanwhile. Moved after that, so that modules are found beside the program or not at all.
make --no-print-directory BUILD="$build" DESTDIR="$scratch/staged" install >/dev/null
mv "$scratch/staged/usr/local" "$scratch/moved"
pelt=$scratch/moved/bin/pelt
examples=$scratch/moved/share/doc/pelt/examples
cd "$scratch"

"$pelt" version
"$pelt" validate --quiet "$examples"/*.json
"$pelt" plan --json "$examples/cylinder-pebbles.json" >plan.json
"$pelt" plan --json "$examples/demo.json" >demo.json
grep -q OpenImageIO plan.json || { echo "the OpenImageIO module was not used"; exit 1; }
grep -q tinygltf demo.json || { echo "the tinygltf module was not used"; exit 1; }
"$pelt" render "$examples/least.json" --server http://127.0.0.1:1 -o x.png 2>refused && exit 1
grep -q 'http://127.0.0.1:1' refused || { cat refused; exit 1; }

mv "$scratch/moved" "$scratch/staged/usr/local"
cd - >/dev/null
make --no-print-directory BUILD="$build" DESTDIR="$scratch/staged" uninstall >/dev/null
left=$(find "$scratch/staged" -type f)
[ -z "$left" ] || { echo "left behind: $left"; exit 1; }
