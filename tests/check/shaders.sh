#!/usr/bin/env bash
# Compiles and links variants of every program with glslangValidator, the reference compiler: drivers
# accept what the standard does not. Any warning fails. Those in which every two flags meet as they can
# (tests/tools/variant_cover.h); every three, which takes three minutes; or all.
# Usage: tests/check/shaders.sh [BUILD [3|all]]
set -eu
build=${1:-build}
command -v glslangValidator >/dev/null || {
    echo "shaders: glslangValidator is missing (Debian's package glslang-tools)" >&2
    exit 1
}
make --no-print-directory -s BUILD="$build" "$build/tests/tools/shader_variants" >/dev/null
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$build/tests/tools/shader_variants" "$folder" ${2:+"$2"} >"$folder/list"
[ -s "$folder/list" ]
failed=0 count=0
while read -r name; do
    count=$((count + 1))
    log=$(glslangValidator -l "$folder/$name".* 2>&1) && code=0 || code=$?
    if [ "$code" -ne 0 ] || grep -qE '(WARNING|ERROR):' <<<"$log"; then
        failed=$((failed + 1))
        echo "shaders: $name:"
        # "ERROR: 1:20017:" is line 17 of the stage's file 1 (renderer/gl/source.c).
        awk '
            FILENAME != "-" { if ($2 == "file") name[FILENAME, $3 + 0] = $4; next }
            ($0, 0) in name { stage = $0 }
            /^(ERROR|WARNING): [0-9]+:[0-9]+:/ {
                split($2, at, ":")
                sub(at[1] ":" at[2], name[stage, int(at[2] / 10000) - 1] ":" at[2] % 10000)
            }
            /^(ERROR|WARNING)/ { print "  " $0 }' "$folder/$name".* - <<<"$log"
    fi
done <"$folder/list"
echo "shaders: $count variants, $failed failed"
[ "$failed" -eq 0 ]
