#!/usr/bin/env bash
# clang-tidy (.clang-tidy says which checks and why) and cppcheck over the whole program.
set -eu
cd "$(dirname "$0")/../.."
build=${1:-build}
make --no-print-directory BUILD="$build" "$build/gen/glad/include/glad/gl.h" >/dev/null
defines=(-D_GNU_SOURCE '-DPELT_VERSION="x"' '-DPELT_COMMIT="x"' '-DPELT_LIBDIR="x"')
include=(-I. "-I$build/gen" "-I$build/gen/glad/include")

# Left out of cppcheck: what clang's analyzer judges along paths (use after free, uninitialised), where
# cppcheck sees branches that exclude one another as one; and casts of functions it has no header for.
mapfile -t sources < <(git ls-files 'api/*.c' 'renderer/*.c' 'service/*.c')
cppcheck --quiet --std=c11 --language=c --error-exitcode=1 --inline-suppr -j 2 \
    --enable=warning,performance,portability \
    --suppress=missingIncludeSystem --suppress=unknownMacro --suppress=CastIntegerToAddressAtReturn \
    --suppress=deallocuse --suppress=uninitvar --suppress=duplicateAssignExpression \
    --suppress="*:$build/gen/*" "${defines[@]}" "${include[@]}" "${sources[@]}"
echo "cppcheck: ${#sources[@]} files"

# A file that has not changed since it last passed, with all that it includes, is not read again.
stamps=$build/check/tidy
mkdir -p "$stamps"
tidy_one() {
    local source=$1 key stamp
    shift
    key=$({ cat .clang-tidy; gcc -E -P "$@" "$source"; } | sha256sum | cut -c1-32)
    stamp=$stamps/$key
    [ -e "$stamp" ] && return 0
    clang-tidy --quiet --warnings-as-errors='*' "$source" -- -std=c11 "$@" 2>"$stamp.err" ||
        { grep -v 'warnings generated' "$stamp.err"; rm -f "$stamp.err"; return 1; }
    rm -f "$stamp.err"
    touch "$stamp"
}
export -f tidy_one
export stamps
printf '%s\n' "${sources[@]}" |
    xargs -P 2 -I{} bash -c 'tidy_one "$@"' _ {} "${defines[@]}" "${include[@]}"
echo "clang-tidy: ${#sources[@]} files"
