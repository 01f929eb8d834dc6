#!/usr/bin/env bash
# Fuzzes the reader of scenes: tests/fuzz/scene_read.sh BUILD [SECONDS]. Needs clang. Findings are left
# in BUILD/fuzz/scene_read. Seeds are the examples; the dictionary is every name in the schema.
set -eu
build=${1:-build} seconds=${2:-60}
dir=$build/fuzz/scene_read
mkdir -p "$dir/corpus" "$dir/seeds" "$dir/found"
flags=(-std=c11 -I. -D_GNU_SOURCE '-DPELT_VERSION="fuzzed"' '-DPELT_COMMIT="fuzzed"' -O1 -g
    -ffp-contract=off '-fsanitize=address,undefined' -fno-sanitize-recover=undefined)
sources=()
for source in api/*.c; do
    [ "$source" = api/embedded.c ] || sources+=("$source")
done
clang "${flags[@]}" -fsanitize=fuzzer -o "$dir/fuzz_scene_read" tests/fuzz/fuzz_scene_read.c \
    "${sources[@]}" -ljansson -lm
cp api/examples/*.json api/examples/later/*.json "$dir/seeds/"
{
    grep -oE '"[a-z_]+"' api/scene.schema.json | sort -u | sed 's/"/\\"/g; s/.*/"&"/'
    printf '"NaN"\n"Infinity"\n"1e999"\n"\\\\u0000"\n"\\\\ud800"\n"sha256:"\n"../"\n'
} >"$dir/scene.dict"
"$dir/fuzz_scene_read" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=8192 \
    -dict="$dir/scene.dict" -artifact_prefix="$dir/found/" -print_final_stats=1 \
    "$dir/corpus" "$dir/seeds"
