#!/usr/bin/env python3
"""Renews the pictures of the root README: api/examples/demo.png and, in rows, gallery.png.

Usage: tests/tools/make_gallery.py build/pelt"""

import json
import os
import subprocess
import sys
import tempfile

from PIL import Image

EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "api", "examples")
GALLERY = ("torus-chain", "sphere-clouds", "cylinder-pebbles", "teapot-fur", "mesh-in-mist",
           "torus-weave", "cylinder-rocks", "forest-in-fog", "teapot-scales", "cylinder-bark")
COLUMNS, SIDE = 5, 192


def draw(pelt, scene, out):
    subprocess.run([pelt, "render", scene, "--assets", EXAMPLES, "-o", out, "--quiet"], check=True)


def main(pelt):
    draw(pelt, os.path.join(EXAMPLES, "demo.json"), os.path.join(EXAMPLES, "demo.png"))
    strip = Image.new("RGB", (SIDE * COLUMNS, SIDE * (len(GALLERY) // COLUMNS)), (255, 255, 255))
    with tempfile.TemporaryDirectory() as folder:
        for place, name in enumerate(GALLERY):
            with open(os.path.join(EXAMPLES, name + ".json")) as file:
                scene = json.load(file)
            scene["image"] = dict(scene.get("image", {}), width=SIDE, height=SIDE, samples=9)
            path = os.path.join(folder, name)
            with open(path + ".json", "w") as file:
                json.dump(scene, file)
            draw(pelt, path + ".json", path + ".png")
            picture = Image.open(path + ".png").convert("RGBA")
            strip.paste(picture, (place % COLUMNS * SIDE, place // COLUMNS * SIDE), picture)
    strip.save(os.path.join(EXAMPLES, "gallery.png"), optimize=True)


main(sys.argv[1] if len(sys.argv) > 1 else "build/pelt")
