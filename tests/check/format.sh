#!/usr/bin/env bash
# Every C and C++ file is as clang-format would write it, and no line of text ends in a space.
set -eu
cd "$(dirname "$0")/../.."
git ls-files -z '*.c' '*.h' '*.cc' | xargs -0 clang-format --dry-run -Werror
if git grep -nIE '[[:space:]]+$' -- '*.c' '*.h' '*.cc' '*.md' '*.sh' '*.py' '*.def' '*.vert' \
    '*.frag' '*.glsl' Makefile; then
    echo "the lines above end in a space"
    exit 1
fi
