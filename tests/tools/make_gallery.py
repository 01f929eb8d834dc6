#!/usr/bin/env python3
"""Renews the pictures of the root README: api/examples/demo.png and, in rows, gallery.png and dufort.png.

Usage: tests/tools/make_gallery.py build/pelt

The Earth in dufort.png needs a package: deploy/dependencies/fetch.sh bench build/npm"""

import json
import os
import subprocess
import sys
import tempfile

from PIL import Image

HERE = os.path.dirname(os.path.abspath(__file__))
EXAMPLES = os.path.join(HERE, "..", "..", "api", "examples")
sys.path.insert(0, os.path.join(HERE, "..", "bench"))
import dufort
GALLERY = ("torus-chain", "sphere-clouds", "cylinder-pebbles", "teapot-fur", "mesh-in-mist",
           "torus-weave", "cylinder-rocks", "forest-in-fog", "teapot-scales", "cylinder-bark")


def paste_row(pelt, scenes, columns, side, out):
    """`scenes`: files; each is drawn small, in rows of `columns`. Its assets are beside it or among the examples'."""
    strip = Image.new("RGB", (side * columns, side * -(-len(scenes) // columns)), (255, 255, 255))
    with tempfile.TemporaryDirectory() as folder:
        for place, source in enumerate(scenes):
            with open(source) as file:
                scene = json.load(file)
            scene["image"] = dict(scene.get("image", {}), width=side, height=side, samples=9)
            path = os.path.join(folder, "scene.json")
            with open(path, "w") as file:
                json.dump(scene, file)
            subprocess.run([pelt, "render", path, "--assets", os.path.dirname(source), "-o",
                            path + ".png", "--quiet"], check=True)
            picture = Image.open(path + ".png").convert("RGBA")
            strip.paste(picture, (place % columns * side, place // columns * side), picture)
    strip.save(os.path.join(EXAMPLES, out), optimize=True)


def main(pelt):
    subprocess.run([pelt, "render", os.path.join(EXAMPLES, "demo.json"), "--assets", EXAMPLES, "-o",
                    os.path.join(EXAMPLES, "demo.png"), "--quiet"], check=True)
    paste_row(pelt, [os.path.join(EXAMPLES, name + ".json") for name in GALLERY], 5, 192, "gallery.png")
    package = os.path.join(os.path.dirname(pelt), "npm", dufort.PACKAGE)
    if not os.path.exists(package):
        sys.exit(f"dufort.png is left as it was: {package} is not there")
    with tempfile.TemporaryDirectory() as folder:
        dufort.lay_earth(package, folder)
        scenes = [os.path.join(folder if name == "dufort-earth" else dufort.SCENES, name + ".json")
                  for name in dufort.PAPER]
        paste_row(pelt, scenes, 7, 144, "dufort.png")


main(sys.argv[1] if len(sys.argv) > 1 else "build/pelt")
