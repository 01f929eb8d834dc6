#!/usr/bin/env bash
# Fuzzes the glTF shim and the mesh build: tests/fuzz/gltf.sh BUILD [SECONDS]. Needs clang, and the
# headers that tinygltf compiles with (nlohmann-json3-dev). Findings are left in BUILD/fuzz/gltf.
set -eu
build=${1:-build} seconds=${2:-60}
[ -e /usr/include/nlohmann/json.hpp ] || { echo "install nlohmann-json3-dev"; exit 1; }
dir=$build/fuzz/gltf
mkdir -p "$dir/corpus" "$dir/seeds" "$dir/found"
# shellcheck disable=SC2054 # the commas are the compiler's
flags=(-I. -I/usr/include/nlohmann -D_GNU_SOURCE -O1 -g -ffp-contract=off
    -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined)
objects=()
for source in mesh_build mesh_pose mesh_weld mesh_adjacency mesh_normals mesh_uv mesh_soup; do
    clang -std=c11 "${flags[@]}" -c -o "$dir/$source.o" "renderer/asset/$source.c"
    objects+=("$dir/$source.o")
done
clang -std=c11 "${flags[@]}" -c -o "$dir/status.o" api/status.c
clang++ -std=c++17 "${flags[@]}" -fsanitize=fuzzer -o "$dir/fuzz_gltf" tests/fuzz/fuzz_gltf.cc \
    "${objects[@]}" "$dir/status.o"

# Each .glb also as 'J', JSON, zero, binary: what the target puts into a container itself.
cp tests/data/gltf/* "$dir/seeds/"
/usr/bin/python3 - "$dir/seeds" tests/data/gltf/*.glb <<'PYTHON'
import os, struct, sys
for path in sys.argv[2:]:
    data = open(path, "rb").read()
    if data[:4] != b"glTF" or len(data) > 30000:
        continue
    length = struct.unpack_from("<I", data, 12)[0]
    name = os.path.basename(path) + ".parts"
    open(os.path.join(sys.argv[1], name), "wb").write(
        b"J" + data[20:20 + length] + b"\0" + data[28 + length:])
PYTHON
"$dir/fuzz_gltf" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=8192 \
    -dict=tests/fuzz/gltf.dict -artifact_prefix="$dir/found/" -print_final_stats=1 \
    "$dir/corpus" "$dir/seeds"
