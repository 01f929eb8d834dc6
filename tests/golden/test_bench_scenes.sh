#!/bin/sh
# The scenes of the bench: their assets are what their script makes, and they are as large as the paper's.
set -eu
scenes=tests/bench/scenes
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
/usr/bin/python3 tests/tools/make_scenes.py "$out"
for made in "$out"/*; do
    cmp "$made" "$scenes/assets/$(basename "$made")"
done
for scene in "$scenes"/*.json; do
    "$PELT" plan "$scene" --json
    echo
done >"$out/plans"
/usr/bin/python3 - "$out/plans" "$scenes"/*.json <<'END'
import json
import sys
prisms = {"car-park": 128, "chain": 576, "terrain-smoke": 3200 + 96, "torus-egg": 576,
          "volcano": 2048 + 2 * 384}
with open(sys.argv[1]) as file:
    plans = [json.loads(line) for line in file if line.strip()]
assert len(plans) == len(sys.argv) - 2 == len(prisms), len(plans)
for path, plan in zip(sys.argv[2:], plans):
    name = path.split("/")[-1][:-5]
    assert plan["work"]["prisms"] == prisms[name], (name, plan["work"])
    assert "choice" not in plan, name
END
