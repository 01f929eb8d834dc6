#!/usr/bin/env bash
# The files of tests/data/gltf are what tests/tools/make_gltf.py writes today.
set -eu
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
/usr/bin/python3 tests/tools/make_gltf.py "$made"
diff -r "$made" tests/data/gltf
