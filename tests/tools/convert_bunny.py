#!/usr/bin/python3
"""Makes api/examples/assets/bunny.glb from the npm package `bunny` 1.0.1 (kept for the record).

    cd $(mktemp -d) && npm install bunny@1.0.1
    convert_bunny.py node_modules/bunny/index.js bunny.glb

The package holds positions and faces only. The model is scaled to a height of 2 units, stands on the
ground, centred over it, and keeps glTF's axes (Y up, seen from +z as in the package's picture). Smooth
normals are added, weighted by the corners' angles; texture coordinates are not: whoever reads the file
chooses a projection. Float32, indexed, one primitive, no material.
"""
import json
import math
import re
import struct
import sys


def read_package(path):
    text = open(path, encoding="utf-8").read()
    arrays = {}
    for name in ("positions", "cells"):
        arrays[name] = json.loads(re.search(name + r"\s*=\s*(\[\[.*?\]\])", text, re.S).group(1))
    return arrays["positions"], arrays["cells"]


def single(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def place(positions):
    low = [min(p[k] for p in positions) for k in range(3)]
    high = [max(p[k] for p in positions) for k in range(3)]
    scale = 2 / (high[1] - low[1])
    origin = [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]
    return [tuple(single((p[k] - origin[k]) * scale) for k in range(3)) for p in positions]


def sub(a, b):
    return [a[k] - b[k] for k in range(3)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return [x / length for x in a]


def smooth_normals(positions, cells):
    normals = [[0.0] * 3 for _ in positions]
    for cell in cells:
        n = unit(cross(sub(positions[cell[1]], positions[cell[0]]), sub(positions[cell[2]], positions[cell[0]])))
        for k in range(3):
            a = sub(positions[cell[(k + 1) % 3]], positions[cell[k]])
            b = sub(positions[cell[(k + 2) % 3]], positions[cell[k]])
            c = cross(a, b)
            angle = math.atan2(math.sqrt(dot(c, c)), dot(a, b))
            for i in range(3):
                normals[cell[k]][i] += angle * n[i]
    return [unit(n) for n in normals]


def write_glb(path, positions, normals, cells):
    blobs = [
        b"".join(struct.pack("<3f", *p) for p in positions),
        b"".join(struct.pack("<3f", *n) for n in normals),
        b"".join(struct.pack("<3H", *c) for c in cells),
    ]
    views, binary = [], b""
    for blob, target in zip(blobs, (34962, 34962, 34963)):
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(blob), "target": target})
        binary += blob + b"\0" * (-len(blob) % 4)
    document = {
        "asset": {"version": "2.0", "generator": "convert_bunny.py",
                  "copyright": "Stanford Computer Graphics Laboratory; npm package bunny 1.0.1"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "bunny", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
             "min": [min(p[k] for p in positions) for k in range(3)],
             "max": [max(p[k] for p in positions) for k in range(3)]},
            {"bufferView": 1, "componentType": 5126, "count": len(normals), "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": 3 * len(cells), "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(binary), b"BIN\0") + binary)


if __name__ == "__main__":
    source, target = sys.argv[1:]
    points, faces = read_package(source)
    points = place(points)
    write_glb(target, points, smooth_normals(points, faces), faces)
