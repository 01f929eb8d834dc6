#!/usr/bin/env bash
# Every script through shellcheck, those without an extension too.
set -eu
cd "$(dirname "$0")/../.."
mapfile -t scripts < <(git grep -lE '^#!.*(bash|/sh)' -- .ci deploy tests)
shellcheck --severity=info "${scripts[@]}"
echo "${#scripts[@]} scripts"
