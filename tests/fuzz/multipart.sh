#!/usr/bin/env bash
# Fuzzes the parsers of multipart bodies and Accept: tests/fuzz/multipart.sh BUILD [SECONDS]. Needs
# clang. Findings are left in BUILD/fuzz/multipart.
set -eu
build=${1:-build} seconds=${2:-60}
dir=$build/fuzz/multipart
mkdir -p "$dir/corpus" "$dir/seeds" "$dir/found"
flags=(-std=c11 -I. -D_GNU_SOURCE -O1 -g '-fsanitize=address,undefined'
    -fno-sanitize-recover=undefined)
clang "${flags[@]}" -fsanitize=fuzzer -o "$dir/fuzz_multipart" tests/fuzz/fuzz_multipart.c \
    service/multipart.c service/accept.c api/status.c
part='Content-Disposition: form-data; name="a"\r\n\r\n'
printf 'amultipart/form-data; boundary=b\n--b\r\n%bx\r\n--b--' "$part" >"$dir/seeds/one"
printf 'bm/f; boundary="b"\nx\r\n--b\r\n%b\r\n--\r\n--b \r\n%b\r\r\n--b--' "$part" "$part" >"$dir/seeds/two"
printf 'cimage/png;q=0.5, image/*;q=0, */*;x="a,b"\n' >"$dir/seeds/accept"
printf '"%s"\n' '\x0d\x0a--b' '\x0d\x0a' '--' 'form-data' 'name=\"' 'boundary=' ';q=' '*/*' \
    'image/png' 'Content-Disposition:' >"$dir/dict"
"$dir/fuzz_multipart" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=4096 \
    -dict="$dir/dict" -artifact_prefix="$dir/found/" -print_final_stats=1 "$dir/corpus" "$dir/seeds"
