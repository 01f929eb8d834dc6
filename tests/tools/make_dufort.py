#!/usr/bin/python3
"""Writes the assets of tests/bench/scenes/dufort-*.json: make_dufort.py DIRECTORY. Meshes with exactly the
triangles of Table 1 of Dufort, Leblanc & Poulin 2005, and textures of its sizes and kinds; the paper's own are
not to be had. The teapot's patches are those of renderer/asset/mesh_teapot_table.c. Needs numpy.

make_dufort.py --clouds IN.png OUT.png SIDE LAYERS makes a strip of layers of a picture of clouds over a
sphere, for the Earth, whose pictures come from a package. Needs PIL."""

import math
import os
import re
import struct
import sys
import zlib

import numpy

from make_gltf import FLOAT, USHORT, Model

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SIDE, LAYERS = 128, 32  # of the textures: Table 1


class Surface:
    """Triangles over grids of point(u, v), Z up, with smooth normals; nothing of no area."""

    def __init__(self):
        self.positions, self.normals, self.uvs, self.indices = [], [], [], []

    def add(self, columns, rows, point, uv):
        """u, v in [0, 1], u across v upwards seen from outside. A row that is one point is a pole."""
        first = len(self.positions)
        for j in range(rows + 1):
            for i in range(columns + 1):
                u, v = i / columns, j / rows
                self.positions.append(point(u, v))
                self.normals.append(normal(point, u, v))
                self.uvs.append(uv(u, v))
        for j in range(rows):
            for i in range(columns):
                a = first + j * (columns + 1) + i
                b, c, d = a + 1, a + columns + 2, a + columns + 1
                at = self.positions
                self.indices += [t for t in ([a, b, c], [a, c, d])
                                 if at[t[0]] != at[t[1]] != at[t[2]] != at[t[0]]]

    def glb(self):
        up = lambda p: [p[0], p[2], -p[1]]  # glTF is Y up
        model = Model()
        model.document["asset"]["generator"] = "make_dufort.py"
        positions = [up(p) for p in self.positions]
        low, high = ([f(p[k] for p in positions) for k in range(3)] for f in (min, max))
        model.node(mesh=model.mesh({"attributes": {
            "POSITION": model.accessor(positions, min=low, max=high),
            "NORMAL": model.accessor([up(n) for n in self.normals]),
            "TEXCOORD_0": model.accessor(self.uvs, FLOAT)},
            "indices": model.accessor([i for t in self.indices for i in t], USHORT)}))
        return model.finish().glb()


def normal(point, u, v):
    """By differences within [0, 1]; at a pole by those a little way off."""
    for step in (1e-4, 1e-2):
        a, b = ([p - q for p, q in zip(point(*high), point(*low))] for low, high in (
            ((max(0, u - step), v), (min(1, u + step), v)),
            ((u, max(0, v - step)), (u, min(1, v + step)))))
        n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        length = math.sqrt(sum(c * c for c in n))
        if length > 1e-3 * step * step:
            return [c / length for c in n]
        v = min(max(v, step), 1 - step)
    axis = point(0.5, v)[2] > 0.5
    return [0.0, 0.0, 1.0 if axis else -1.0]


def vase():
    """8,640 triangles: a surface of revolution, 72 by 60 cells, open at both ends."""
    knots = [0.36, 0.47, 0.66, 0.80, 0.83, 0.74, 0.55, 0.38, 0.30, 0.31, 0.42]

    def radius(v):  # Catmull-Rom
        t = v * (len(knots) - 1)
        k = min(int(t), len(knots) - 2)
        t -= k
        p = [knots[min(max(k + o, 0), len(knots) - 1)] for o in (-1, 0, 1, 2)]
        return 0.5 * (2 * p[1] + t * (p[2] - p[0] + t * (
            2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] + t * (3 * (p[1] - p[2]) + p[3] - p[0]))))

    def point(u, v):
        a, r = 2 * math.pi * (u % 1), radius(v)
        return [r * math.cos(a), r * math.sin(a), 2.6 * v - 1.3]
    surface = Surface()
    surface.add(72, 60, point, lambda u, v: [u, v])
    return surface, 8640


def teapot_table():
    with open(os.path.join(ROOT, "renderer/asset/mesh_teapot_table.c")) as file:
        text = file.read()
    rows = re.findall(r"\{([-0-9., \n]+)\}", text[text.index("#include"):])
    numbers = [[float(n) for n in row.replace("\n", " ").split(",")] for row in rows]
    patches = [[int(n) for n in row] for row in numbers if len(row) == 16]
    return patches, [row for row in numbers if len(row) == 3]


# As in renderer/asset/mesh_teapot.c: first patch, patches around, whether rows run down, u's extent and
# v's; then the cells around and along that make 2,142 triangles in all.
RINGS = ((0, 4, True, 1, 0.643, 0.684, 28, 2), (4, 4, True, 1, 0.392, 0.643, 28, 5),
         (8, 4, True, 1, 0.244, 0.392, 28, 4), (12, 2, True, 1 / 12, 0.53, 0.76, 13, 8),
         (14, 2, True, 1 / 12, 0.30, 0.53, 13, 7), (16, 2, True, 1 / 6, 0.44, 0.768, 12, 12),
         (18, 2, True, 1 / 6, 0.392, 0.44, 12, 5), (20, 4, True, 1, 0.868, 1, 28, 5),
         (24, 4, True, 1, 0.684, 0.868, 28, 5), (28, 4, False, 1, 0, 0.244, 28, 4))


def teapot():
    """2,142 triangles: the builtin teapot's patches, cut as finely as Table 1 says, no more."""
    patches, points = teapot_table()
    surface = Surface()
    weights = lambda t: ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3)

    def ring(first, count, down, u_extent, low, high, columns, rows):
        def point(u, v):
            place = min(int(u * count), count - 1)
            c, r = u * count - place, v
            if down:
                place, c, r = count - 1 - place, 1 - c, 1 - r
            wide = 1.077 if 20 <= first < 28 else 1
            row, column, p = weights(r), weights(c), [0.0, 0.0, 0.0]
            for i, at in enumerate(patches[first + place]):
                w = row[i // 4] * column[i % 4]
                for k, scale in enumerate((wide, wide, 1)):
                    p[k] += 0.5 * scale * w * points[at][k]
            # Rounding: so that seams and poles meet to the bit.
            return [round(x, 9) + 0.0 for x in p]
        surface.add(columns, rows, point,
                    lambda u, v: [u_extent * u, low + (high - low) * v])

    for each in RINGS:
        ring(*each)
    return surface, 2142


def png(rgba):
    height, width, _ = rgba.shape
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    raw = b"".join(b"\0" + row.tobytes() for row in rgba)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def strip(surrounding, figure, share):
    """A strip of layers from the base up; `share` of each voxel is the figure's. Colours are sRGB; alphas are
    a layer's, in 255ths. Steps of 1/8: what is to be seen of a figure's rim is its density, not its bits."""
    steps = numpy.floor(8 * numpy.clip(share, 0, 1) + 0.5)[..., None] / 8
    mixed = numpy.array(surrounding) + steps * (numpy.array(figure, float) - numpy.array(surrounding))
    return png(numpy.floor(mixed + 0.5).astype("u1").reshape(-1, SIDE, 4))


def voxels():
    """Centres, as three arrays over [layer, row, column]; rows from v = 0 up."""
    w, v, u = numpy.meshgrid((numpy.arange(LAYERS) + 0.5) / LAYERS, (numpy.arange(SIDE) + 0.5) / SIDE,
                             (numpy.arange(SIDE) + 0.5) / SIDE, indexing="ij")
    return u, v, w


def bust():
    """A head on its shoulders, of ellipsoids, that glows in a green medium."""
    u, v, w = voxels()
    share = numpy.zeros(u.shape)
    for (x, y, z), (a, b, c) in (((.50, .62, .48), (.145, .19, .36)), ((.50, .68, .36), (.21, .21, .34)),
                                 ((.36, .60, .34), (.09, .16, .26)), ((.64, .60, .34), (.09, .16, .26)),
                                 ((.50, .60, .84), (.030, .055, .13)), ((.50, .41, .40), (.085, .13, .26)),
                                 ((.50, .20, .32), (.36, .14, .27)), ((.50, .25, .38), (.22, .14, .27))):
        inside = ((u - x) / a) ** 2 + ((v - y) / b) ** 2 + ((w - z) / c) ** 2
        share = numpy.maximum(share, (1.12 - inside) / 0.3)
    for x in (.445, .555):  # eyes
        share -= 1.5 * numpy.clip(1.2 - ((u - x) / .034) ** 2 - ((v - .655) / .026) ** 2
                                  - ((w - .82) / .15) ** 2, 0, 1)
    return strip((30, 120, 60, 3), (255, 214, 130, 46), share)


def dragon():
    """A winged serpent, of balls along a curve, dense in a thin red medium."""
    u, v, w = voxels()
    balls = []
    for i in range(90):  # from tail to neck, winding
        t = i / 89
        balls.append((0.12 + 0.68 * t, 0.45 + 0.22 * math.sin(2.2 * math.pi * t + 0.6) * (1 - 0.3 * t),
                      0.42 + 0.18 * math.sin(3.1 * math.pi * t), 0.016 + 0.06 * math.sin(math.pi * t ** 0.8)))
        if i % 6 == 3 and 9 < i < 84:  # crest
            x, y, z, r = balls[-1]
            balls.append((x, y, min(0.93, z + 3.3 * r), 0.016))
    x, y, z, _ = balls[89]
    for i in range(12):  # head, with jaws
        t = i / 11
        balls += [(x + 0.11 * t, y + 0.10 * t + side * 0.03 * t, z + 0.1, 0.040 - 0.018 * t) for side in (-1, 1)]
    for i in range(26):  # wings: fans of spokes
        for spoke in range(3):
            t = i / 25
            for side in (-1, 1):
                balls.append((0.50 - 0.1 * spoke * t, 0.47 + side * t * (0.40 - 0.06 * spoke),
                              0.55 + 0.25 * t * (1 - 0.4 * spoke), 0.028 - 0.014 * t))
    share = numpy.zeros(u.shape)
    for x, y, z, r in balls:  # heights are flattened by 0.3: a tile is wider than it is deep
        reach = numpy.abs(u[0, 0] - x) < 1.5 * r, numpy.abs(v[0, :, 0] - y) < 1.5 * r
        cut = numpy.ix_(range(LAYERS), numpy.flatnonzero(reach[1]), numpy.flatnonzero(reach[0]))
        inside = (u[cut] - x) ** 2 + (v[cut] - y) ** 2 + (0.3 * (w[cut] - z)) ** 2
        share[cut] = numpy.maximum(share[cut], (1.2 - inside / (r * r)) / 0.4)
    return strip((200, 26, 20, 3), (236, 190, 72, 70), share)


def clouds(source, target, side, layers):
    """Layers of a strip from the base up, u along the equator: dense half way, thin below and above. Along w
    they let through what the picture does."""
    from PIL import Image
    Image.MAX_IMAGE_PIXELS = None
    alpha = Image.open(source).convert("RGBA").getchannel("A").resize((side, side), Image.BOX)
    alpha = numpy.asarray(alpha, float) / 255  # as pictures are read: v = 0 is the top row, north
    depth = -numpy.log1p(-numpy.minimum(alpha, 0.99))
    heights = (numpy.arange(layers) + 0.5) / layers
    shape = (heights * (1 - heights))[:, None, None] / numpy.sum(heights * (1 - heights))
    out = numpy.full((layers, side, side, 4), 255, "u1")
    out[..., 3] = numpy.floor(255 * -numpy.expm1(-depth * shape) + 0.5)
    with open(target, "wb") as file:
        file.write(png(out.reshape(-1, side, 4)))


def main():
    if sys.argv[1] == "--clouds":
        clouds(sys.argv[2], sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
        return
    files = {"dufort-bust.png": bust(), "dufort-dragon.png": dragon()}
    for make in (vase, teapot):
        surface, asked = make()
        assert len(surface.indices) == asked, (make.__name__, len(surface.indices))
        files[f"dufort-{make.__name__}.glb"] = surface.glb()
    for name, data in files.items():
        with open(os.path.join(sys.argv[1], name), "wb") as file:
            file.write(data)


if __name__ == "__main__":
    main()
