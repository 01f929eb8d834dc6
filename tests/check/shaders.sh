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
count=$(wc -l <"$folder/list")

# "ERROR: 1:20017:" is line 17 of the stage's file 1 (renderer/gl/source.c).
say() { # LOG FILE...
    awk '
        FILENAME != "-" { if ($2 == "file") name[FILENAME, $3 + 0] = $4; next }
        ($0, 0) in name { stage = $0 }
        /^(ERROR|WARNING): [0-9]+:[0-9]+:/ {
            split($2, at, ":")
            sub(at[1] ":" at[2], name[stage, int(at[2] / 10000) - 1] ":" at[2] % 10000)
        }
        /^(ERROR|WARNING)/ { print "  " stage ": " $0 }' "${@:2}" - <<<"$1"
}

# All stages by themselves, many in a process: most of what one costs is to begin. Then stages together,
# which test_gl_variants does with every variant on the GL of the machine: here one in eight.
failed=0
while read -r -a stages; do
    log=$(glslangValidator "${stages[@]}" 2>&1) && code=0 || code=$?
    if [ "$code" -ne 0 ] || grep -qE '(WARNING|ERROR):' <<<"$log"; then
        failed=$((failed + 1))
        say "$log" "${stages[@]}"
    fi
done < <(find "$folder" -name '*.*.*' | sort | xargs -n 64)
while read -r name; do
    log=$(glslangValidator -l "$folder/$name".* 2>&1) && code=0 || code=$?
    if [ "$code" -ne 0 ] || grep -qE '(WARNING|ERROR):' <<<"$log"; then
        failed=$((failed + 1))
        echo "shaders: linking $name:"
        say "$log" "$folder/$name".*
    fi
done < <(awk -F. '$1 != last { n = 0; last = $1 } n++ % 8 == 0' "$folder/list")
echo "shaders: $count variants, $failed runs of the compiler failed"
[ "$failed" -eq 0 ]
