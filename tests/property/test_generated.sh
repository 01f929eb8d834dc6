#!/usr/bin/env bash
# The committed schema, documentation and OpenAPI document are what the tables of api/ make:
# `make generate` renews them.
set -eu
cd "$(dirname "$0")/../.."
build=${PELT_BUILD:-$PWD/build}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$build/tests/tools/scene_schema" >"$scratch/scene.schema.json"
"$build/tests/tools/scene_docs" >"$scratch/SCENE.md"
"$build/tests/tools/scene_schema" sequence >"$scratch/sequence.schema.json"
"$build/tests/tools/scene_docs" sequence >"$scratch/SEQUENCE.md"
diff -u api/sequence.schema.json "$scratch/sequence.schema.json"
diff -u api/SEQUENCE.md "$scratch/SEQUENCE.md"
diff -u api/scene.schema.json "$scratch/scene.schema.json"
diff -u api/SCENE.md "$scratch/SCENE.md"
tests/tools/openapi_schemas.py --check
