#!/usr/bin/env bash
# EGL and OSMesa give the same PNG bytes for every example but those with a deadline, drawn at a
# quarter of its size. Where EGL
# draws on hardware, the two are different rasterisers and there is nothing to compare. On failure the
# pictures stay in $PELT_BUILD/tests/backends.
set -eu
cd "$(dirname "$0")/../.."
out=$PELT_BUILD/tests/backends
rm -rf "$out"
mkdir -p "$out"

reason=$("$PELT" doctor --json | /usr/bin/python3 -c '
import json, sys
found = json.load(sys.stdin)
for name in "egl", "osmesa":
    if not found[name]["usable"]:
        print(name, "does not work here:", found[name]["why"])
    elif not found[name]["software"]:
        print(name, "draws on hardware here:", found[name]["gl_renderer"])
')
if [ -n "$reason" ]; then
    echo "$reason"
    exit 77
fi

/usr/bin/python3 - "$out" api/examples/*.json <<'END'
import json, pathlib, sys
for path in map(pathlib.Path, sys.argv[2:]):
    scene = json.loads(path.read_text())
    if "deadline_ms" in scene.get("target", {}):
        continue  # what is drawn depends on how fast it is
    image = scene.setdefault("image", {})
    for side in "width", "height":
        image[side] = max(1, image.get(side, 512) // 4)
    pathlib.Path(sys.argv[1], path.name).write_text(json.dumps(scene))
END
for backend in egl osmesa; do
    mkdir "$out/$backend"
    "$PELT" render "$out"/*.json --assets api/examples --out-dir "$out/$backend" --quiet \
        --backend "$backend"
done

count=0 differ=0
for scene in "$out"/*.json; do
    name=$(basename "$scene" .json).png
    count=$((count + 1))
    cmp "$out/egl/$name" "$out/osmesa/$name" || differ=$((differ + 1))
done
echo "$count examples, $differ differ"
[ "$count" -gt 0 ] && [ "$differ" -eq 0 ] || exit 1
rm -rf "$out"
