#!/usr/bin/env bash
# Program, modules and tests build without a warning, with gcc and with clang.
set -eu
cd "$(dirname "$0")/../.."
build=${1:-build}
for compiler in "gcc g++" "clang clang++"; do
    read -r cc cxx <<<"$compiler"
    make --no-print-directory WERROR=1 CC="$cc" CXX="$cxx" OPT=-O2 BUILD="$build/check/$cc" tests
done
