#!/usr/bin/env bash
# Program, modules and tests build without a warning, with gcc and with clang.
set -eu
cd "$(dirname "$0")/../.."
build=${1:-build}
# What gcc warns of depends on what it optimises; what clang does, does not.
for compiler in "gcc g++ -O2" "clang clang++ -O0"; do
    read -r cc cxx opt <<<"$compiler"
    make --no-print-directory WERROR=1 CC="$cc" CXX="$cxx" OPT="$opt" BUILD="$build/check/$cc" tests
done
