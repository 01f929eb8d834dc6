#!/usr/bin/env bash
# The volumes of tests/data and of the examples are what tests/tools/make_volumes.py writes today.
set -eu
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
/usr/bin/python3 tests/tools/make_volumes.py "$made/tests"
diff -r "$made/tests" tests/data/volume
/usr/bin/python3 tests/tools/make_volumes.py --example "$made/examples"
cmp "$made/examples/smoke.vdb" api/examples/assets/smoke.vdb
