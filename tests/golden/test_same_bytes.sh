#!/usr/bin/env bash
# The same scene gives the same image bytes: twice in a row, in a context that has drawn other scenes
# before, through a daemon by curl and by `pelt render --server`, and with the report's `resolved`
# scene in its place. EGL and OSMesa are compared by tests/unit/test_gl_backends.c.
set -eu
cd "$(dirname "$0")/../.."
pelt=${PELT:-build/pelt}
examples=api/examples
scratch=$(mktemp -d)
daemon=
cleanup() {
    if [ -n "$daemon" ] && kill -TERM "$daemon" 2>/dev/null; then wait "$daemon" || true; fi
    rm -rf "$scratch"
}
trap cleanup EXIT

# Small pictures of a medium over a base with an asset, of a medium alone, and of a solid.
mkdir -p "$scratch/in/assets" "$scratch/other"
cp "$examples/assets/bunny.glb" "$scratch/in/assets/"
shrink() { # FILE OUT
    /usr/bin/python3 -c '
import json, sys
scene = json.load(open(sys.argv[1]))
scene["image"] = dict(scene.get("image", {}), width=97, height=64)
json.dump(scene, open(sys.argv[2], "w"))' "$1" "$2"
}
shrink "$examples/demo.json" "$scratch/in/bunny.json"
shrink "$examples/least.json" "$scratch/in/least.json"
echo '{"image": {"width": 97, "height": 64}, "objects": [{"shell": {"mesh": {"shape": "torus"},
    "material": {"builtin": "chain"}, "thickness": 0.1}}]}' >"$scratch/in/chain.json"

same() { # WHAT A B
    cmp "$2" "$3" || { echo "FAIL: $1"; exit 1; }
    echo "ok: $1"
}

first=$scratch/first
"$pelt" render "$scratch"/in/*.json --out-dir "$first" --quiet

# One context, another order, each scene twice with others between.
"$pelt" render "$scratch"/in/{least,chain,bunny}.json --out-dir "$scratch/order" --quiet

# The daemon says on its first line where it listens, once it can answer.
mkfifo "$scratch/out"
"$pelt" serve --listen 127.0.0.1:0 --workers 1 >"$scratch/out" 2>"$scratch/log" &
daemon=$!
exec 3<"$scratch/out"
read -r line <&3
url=$(grep -oE 'http://[^ ]+' <<<"$line")

for name in bunny chain least; do
    scene=$scratch/in/$name.json
    same "$name: another order" "$first/$name.png" "$scratch/order/$name.png"
    "$pelt" render "$scene" -o "$scratch/a.png" --report "$scratch/report.json" --quiet
    same "$name: a process of its own" "$first/$name.png" "$scratch/a.png"

    /usr/bin/python3 -c 'import json, sys; json.dump(json.load(open(sys.argv[1]))["resolved"],
        open(sys.argv[2], "w"))' "$scratch/report.json" "$scratch/resolved.json"
    "$pelt" render "$scratch/resolved.json" --assets "$scratch/in" -o "$scratch/b.png" --quiet
    same "$name: the resolved scene" "$first/$name.png" "$scratch/b.png"

    asset=()
    [ $name != bunny ] || asset=(--form "assets/bunny.glb=@$scratch/in/assets/bunny.glb")
    for time in first second; do
        curl --fail-with-body --silent --show-error --noproxy '*' --header 'Accept: image/png' \
            --form "scene=@$scene;type=application/json" "${asset[@]}" --output "$scratch/c.png" \
            "$url/v1/render" || { cat "$scratch/c.png"; exit 1; }
        same "$name: the daemon, $time time" "$first/$name.png" "$scratch/c.png"
    done

    "$pelt" render "$scene" --server "$url" -o "$scratch/d.png" --quiet
    same "$name: --server" "$first/$name.png" "$scratch/d.png"
    "$pelt" render "$scene" --server "$url" -o "$scratch/e.png" --report "$scratch/r.json" --quiet
    same "$name: --server with a report" "$first/$name.png" "$scratch/e.png"
done

"$pelt" render "$scratch/in/bunny.json" -o "$scratch/a.exr" --quiet
"$pelt" render "$scratch/in/bunny.json" -o "$scratch/b.exr" --quiet
same "OpenEXR, twice" "$scratch/a.exr" "$scratch/b.exr"
"$pelt" render "$scratch/in/bunny.json" --server "$url" -o "$scratch/c.exr" --quiet
same "OpenEXR, --server" "$scratch/a.exr" "$scratch/c.exr"
