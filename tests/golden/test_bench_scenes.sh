#!/bin/sh
# The scenes of the bench: their assets are what their script makes, and they are as large as the paper's.
set -eu
scenes=tests/bench/scenes
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
mkdir "$out/assets"
/usr/bin/python3 tests/tools/make_scenes.py "$out/assets"
/usr/bin/python3 tests/tools/make_dufort.py "$out/assets"
for made in "$out"/assets/*; do
    cmp "$made" "$scenes/assets/$(basename "$made")"
done
for scene in "$scenes"/*.json; do
    "$PELT" plan "$scene" --json
    echo
done >"$out/plans"
/usr/bin/python3 - "$out/plans" "$scenes"/*.json <<'END'
import json
import sys
sys.path.insert(0, "tests/bench")
import dufort
prisms = {"car-park": 128, "chain": 576, "terrain-smoke": 3200 + 96, "torus-egg": 576,
          "volcano": 2048 + 2 * 384}
# Of Table 1, 12 triangles a prism; the plane's fog is a shell of its own, with as many.
for name, (_, triangles, texture, samples, _) in dufort.PAPER.items():
    if name != "dufort-earth":
        prisms[name] = triangles // 12 * (2 if name == "dufort-plane-trees" else 1)
with open(sys.argv[1]) as file:
    plans = [json.loads(line) for line in file if line.strip()]
assert len(plans) == len(sys.argv) - 2 == len(prisms), len(plans)
for path, plan in zip(sys.argv[2:], plans):
    name = path.split("/")[-1][:-5]
    assert plan["work"]["prisms"] == prisms[name], (name, plan["work"])
    assert "choice" not in plan, name
    if name in dufort.PAPER:
        with open(path) as file:
            shells = json.load(file)["objects"]
        _, _, texture, samples, _ = dufort.PAPER[name]
        for shell in shells:
            assert shell["quality"] == {"samples": samples}, name
            material = shell["shell"]["material"]
            size = material.get("size", [128, 128, 32])  # of a volume: its file's
            assert " x ".join(map(str, size)) == texture, (name, size)
END
