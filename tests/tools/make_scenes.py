#!/usr/bin/python3
"""Writes the assets of tests/bench/scenes: make_scenes.py DIRECTORY. Meshes and pictures for the scenes of
Lensch, Daubert & Seidel 2002, whose own are not to be had: of the same size and kind, no copies.
"""
import math
import os
import struct
import sys
import zlib

from make_gltf import FLOAT, UINT, Model


def grid(columns, rows, point, wrap_x, wrap_y):
    """Triangles over a grid of point(u, v) -> (x, y, z), Z up, u and v in [0, 1]; smooth normals."""
    def normal(u, v):
        h = 1e-4
        a = [p - q for p, q in zip(point(u + h, v), point(u - h, v))]
        b = [p - q for p, q in zip(point(u, v + h), point(u, v - h))]
        n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        length = math.sqrt(sum(c * c for c in n))
        return [c / length for c in n]

    positions, normals, uvs, indices = [], [], [], []
    for j in range(rows + 1):
        for i in range(columns + 1):
            u, v = i / columns, j / rows
            # Seams meet to the bit: the last column's positions are the first one's.
            at = (0 if wrap_x and i == columns else u, 0 if wrap_y and j == rows else v)
            positions.append(point(*at))
            normals.append(normal(*at))
            uvs.append([u, v])
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            b, c, d = a + 1, a + columns + 2, a + columns + 1
            indices += [a, b, c, a, c, d]
    up = lambda p: [p[0], p[2], -p[1]]  # glTF is Y up
    model = Model()
    model.document["asset"]["generator"] = "make_scenes.py"
    low, high = ([f(p[k] for p in map(up, positions)) for k in range(3)] for f in (min, max))
    primitive = {"attributes": {
        "POSITION": model.accessor([up(p) for p in positions], min=low, max=high),
        "NORMAL": model.accessor([up(n) for n in normals]),
        "TEXCOORD_0": model.accessor(uvs, FLOAT)}, "indices": model.accessor(indices, UINT)}
    model.node(mesh=model.mesh(primitive))
    return model.finish().glb()


def distorted_torus():
    """576 triangles: a ring that rises and falls, and is thicker on one side."""
    def point(u, v):
        a, b = 2 * math.pi * u, 2 * math.pi * v
        ring = 1 + 0.12 * math.cos(2 * a)
        tube = 0.36 + 0.08 * math.sin(a) + 0.03 * math.cos(3 * a + b)
        return [(ring + tube * math.cos(b)) * math.cos(a), (ring + tube * math.cos(b)) * math.sin(a),
                tube * math.sin(b) + 0.14 * math.sin(2 * a + 0.7)]
    return grid(24, 12, point, True, True)


def volcano():
    """2,048 triangles: a cone with a crater on a plain, furrowed."""
    def point(u, v):
        x, y = 2 * u - 1, 2 * v - 1
        r, a = math.hypot(x, y), math.atan2(y, x)
        furrows = 0.03 * math.cos(9 * a + 3 * math.sin(4 * r)) * min(1, 4 * max(0, r - 0.12)) \
            * max(0, 1 - r)
        cone = 0.75 * math.exp(-(r / 0.4) ** 1.5)
        crater = 0.32 * math.exp(-(r / 0.14) ** 2)
        return [x, y, cone - crater + furrows]
    return grid(32, 32, point, False, False)


def png(width, height, bits, channels, samples):
    """`samples`: rows of tuples of integers."""
    code = "B" if bits == 8 else "H"
    raw = b"".join(b"\0" + struct.pack(">%d%s" % (width * channels, code),
                                       *(s for pixel in row for s in pixel)) for row in samples)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(
            ">I", zlib.crc32(name + data))
    kind = {1: 0, 3: 2}[channels]
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind,
                                                              0, 0, 0))
            + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


PARK = 256  # pixels a side
CARS = [(200, 30, 30), (40, 80, 170), (225, 225, 220), (35, 35, 40), (190, 170, 40), (60, 120, 70)]


def car_park():
    """Height in [0, 1] and sRGB colour of each pixel: two rows of cars, a lane, trees along the edge."""
    heights = [[0.02] * PARK for _ in range(PARK)]
    colors = [[(92, 92, 96)] * PARK for _ in range(PARK)]

    def box(x0, y0, x1, y1, height, color, round_by=0.0):
        for y in range(y0, y1):
            for x in range(x0, x1):
                edge = min(x - x0, x1 - 1 - x, y - y0, y1 - 1 - y)
                h = height - round_by * max(0, 3 - edge) / 3
                if h > heights[y % PARK][x % PARK]:
                    heights[y % PARK][x % PARK] = h
                    colors[y % PARK][x % PARK] = color

    for row, top in enumerate((48, 150)):
        for slot in range(8):
            x = 4 + 32 * slot
            for y in range(top, top + 62):  # lines between the lots
                for k in range(2):
                    colors[y][(x - 4 + k) % PARK] = (215, 215, 205)
            if (3 * slot + 5 * row) % 7 == 2:
                continue  # a lot is free
            color = CARS[(5 * slot + 3 * row) % len(CARS)]
            box(x + 2, top + 4, x + 24, top + 56, 0.26, color, 0.05)  # body
            box(x + 4, top + 18, x + 22, top + 46, 0.42, (60, 75, 85), 0.10)  # windows
            box(x + 6, top + 22, x + 20, top + 42, 0.44, color)  # roof
            for side in (x + 1, x + 23):  # wheels
                for wheel in (top + 9, top + 43):
                    box(side, wheel, side + 2, wheel + 9, 0.12, (20, 20, 20))
    for tree in range(6):
        cx, cy, radius = 22 + 43 * tree, 14 + 4 * (tree % 2), 15 + 2 * (tree % 3)
        for y in range(cy - radius, cy + radius + 1):
            for x in range(cx - radius, cx + radius + 1):
                d = math.hypot(x - cx, y - cy) / radius
                if d >= 1:
                    continue
                leaf = 0.05 * math.sin(1.9 * x) * math.sin(2.3 * y)
                height = 0.55 + 0.42 * math.sqrt(1 - d * d) + leaf
                if height > heights[y % PARK][x % PARK]:
                    heights[y % PARK][x % PARK] = min(1, height)
                    colors[y % PARK][x % PARK] = (48, 96 + int(400 * abs(leaf)), 40)
    return heights, colors


def main():
    directory = sys.argv[1]
    heights, colors = car_park()
    files = {
        "distorted-torus.glb": distorted_torus(),
        "volcano.glb": volcano(),
        "car-park-height.png": png(PARK, PARK, 16, 1,
                                   [[(round(65535 * h),) for h in row] for row in heights]),
        "car-park-color.png": png(PARK, PARK, 8, 3, colors),
    }
    for name, data in files.items():
        with open(os.path.join(directory, name), "wb") as file:
            file.write(data)


if __name__ == "__main__":
    main()
