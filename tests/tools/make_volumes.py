#!/usr/bin/python3
"""Makes tests/data/volume, and with --example api/examples/assets/smoke.vdb: small volumes in the formats that are read, and broken ones. Needs numpy and PIL; the files are committed.

The OpenVDB writer follows the library's file format, version 224: tree nodes of 32, 16 and 8 voxels
a side, values of active voxels alone, zipped or not.

Usage: make_volumes.py [--example] FOLDER"""

import io
import os
import struct
import sys
import zlib

import numpy
from PIL import Image

NONE, ZIP, ACTIVE_MASK = 0, 1, 2


def text(value):
    value = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(value)) + value


def bits(mask):
    return numpy.packbits(mask.ravel(), bitorder="little").tobytes()


def values(data, flags):
    """Active values of a node: the background fills the rest (0), zipped where that is shorter."""
    if not flags & ZIP:
        return b"\0" + data
    packed = zlib.compress(data, 9)
    if len(packed) < len(data):
        return b"\0" + struct.pack("<q", len(packed)) + packed
    return b"\0" + struct.pack("<q", -len(data)) + data


def leaf_of(grid, active, origin, corner):
    """The values and the mask of the 8 x 8 x 8 voxels from `corner` on."""
    block = numpy.zeros((8, 8, 8) + grid.shape[3:], "<f4")
    mask = numpy.zeros((8, 8, 8), bool)
    low = [max(c, o) for c, o in zip(corner, origin)]
    high = [min(c + 8, o + s) for c, o, s in zip(corner, origin, grid.shape)]
    there = tuple(slice(l - c, h - c) for l, h, c in zip(low, high, corner))
    here = tuple(slice(l - o, h - o) for l, h, o in zip(low, high, origin))
    block[there] = grid[here]
    mask[there] = active[here]
    return block, mask


def tree(grid, origin, flags):
    """Topology and leaves of grid[x, y, z] (or three values each) whose first voxel is `origin`."""
    active = (grid != 0).reshape(grid.shape[:3] + (-1,)).any(axis=-1)
    leaves, nodes = {}, {}
    ranges = [range(o >> 3, ((o + s - 1) >> 3) + 1) for o, s in zip(origin, grid.shape)]
    for i in ranges[0]:
        for j in ranges[1]:
            for k in ranges[2]:
                block, mask = leaf_of(grid, active, origin, (8 * i, 8 * j, 8 * k))
                if not mask.any():
                    continue
                leaves[i, j, k] = bits(mask), block[mask].astype("<f4").tobytes()
                big, middle = (i >> 9, j >> 9, k >> 9), (i >> 4, j >> 4, k >> 4)
                nodes.setdefault(big, {}).setdefault(middle, []).append((i, j, k))

    def place(node, power):
        x, y, z = (c & ((1 << power) - 1) for c in node)
        return (x << (2 * power)) | (y << power) | z

    width = 4 * (grid.shape[3] if grid.ndim > 3 else 1)
    topology, buffers = struct.pack("<I", 1) + bytes(width) + struct.pack("<II", 0, len(nodes)), b""
    for big, middles in sorted(nodes.items()):
        mask = numpy.zeros(32768, bool)
        mask[[place(m, 5) for m in middles]] = True
        topology += struct.pack("<iii", *(c << 12 for c in big)) + bits(mask) + bytes(4096)
        topology += values(b"", flags)
        for middle in sorted(middles, key=lambda m: place(m, 5)):
            inner = sorted(middles[middle], key=lambda n: place(n, 4))
            mask = numpy.zeros(4096, bool)
            mask[[place(n, 4) for n in inner]] = True
            topology += bits(mask) + bytes(512) + values(b"", flags)
            for leaf in inner:
                topology += leaves[leaf][0]
                buffers += leaves[leaf][0] + values(leaves[leaf][1], flags)
    return topology, buffers


def vdb(grids, flags=ACTIVE_MASK, version=224, box=None):
    """grids: (name, array, origin) each. `box` is told in place of the true bounds."""
    out = b" BDV\0\0\0\0" + struct.pack("<III", version, 10, 0) + b"\x01"
    out += b"5e1f0000-0000-4000-8000-000000000000" + struct.pack("<II", 0, len(grids))
    for name, grid, origin in grids:
        low, high = box or (origin, [o + s - 1 for o, s in zip(origin, grid.shape)])
        out += text(name) + text("Tree_vec3s_5_4_3" if grid.ndim > 3 else "Tree_float_5_4_3") + text("")
        topology, buffers = tree(numpy.asarray(grid, "<f4"), origin, flags)
        entries = [("class", "string", "fog volume"), ("name", "string", name),
                   ("file_bbox_min", "vec3i", struct.pack("<iii", *low)),
                   ("file_bbox_max", "vec3i", struct.pack("<iii", *high))]
        head = struct.pack("<II", flags, len(entries))
        head += b"".join(text(a) + text(b) + text(c) for a, b, c in entries)
        head += text("UniformScaleMap")
        head += struct.pack("<15d", *[0.1] * 3, *[0.1] * 3, *[10.0] * 3, *[100.0] * 3, *[5.0] * 3)
        start = len(out) + 24
        block = start + len(head) + len(topology)
        out += struct.pack("<QQQ", start, block, block + len(buffers)) + head + topology + buffers
    return out


def tiff(pages):
    file = io.BytesIO()
    images = [Image.fromarray(page) for page in pages]
    images[0].save(file, "TIFF", save_all=True, append_images=images[1:])
    return file.getvalue()


def png(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def ramp(size):
    x, y, z = numpy.meshgrid(*map(numpy.arange, size), indexing="ij")
    return (x + 10 * y + 100 * z + 1).astype("f4")


def make_tests(write):
    grid = ramp((10, 6, 9))
    colors = numpy.stack([grid * 0 + 0.25, grid / 1024, grid * 0 + 2], -1)
    where = (-3, 2, 5)
    density = vdb([("density", grid, where)])
    write("density.vdb", density)
    write("zip.vdb", vdb([("density", grid, where)], ZIP | ACTIVE_MASK))
    write("color.vdb", vdb([("temperature", grid * 3, where), ("Cd", colors, where), ("density", grid, where)]))
    odd = grid.copy()
    odd[:, 0, 0] = -1e-6
    odd[0, 1, :4] = 3e30
    write("odd.vdb", vdb([("smoke", odd, where)]))
    odd[4, 4, 4] = numpy.nan
    write("bad_nan.vdb", vdb([("density", odd, where)]))
    write("bad_color_alone.vdb", vdb([("Cd", colors, where)]))
    write("bad_cut_short.vdb", density[:-700])
    write("bad_old.vdb", vdb([("density", grid, where)], version=200))
    write("bad_huge.vdb", vdb([("density", grid, where)], box=((0, 0, 0), (99999, 99999, 99999))))
    write("bad_inside_out.vdb", vdb([("density", grid, where)], box=((9, 9, 9), (0, 0, 0))))
    write("bad_no_grid.vdb", vdb([]))

    # Layer z, row y, column x: RGB (x, y, z) and alpha, as pages, in a column, and in a row.
    z, y, x = numpy.meshgrid(*map(numpy.arange, (3, 4, 4)), indexing="ij")
    layers = numpy.stack([60 * x, 60 * y, 80 * z, 85 * z + 5 * x], -1).astype("uint8")
    write("pages.tif", tiff(layers))
    write("column.png", png(layers.reshape(12, 4, 4)))
    write("row.png", png(numpy.concatenate(list(layers), axis=1)))
    write("grey.tif", tiff(layers[..., 3]))
    write("grey_16.tif", tiff(layers[..., 3].astype("uint16") * 257))
    write("bad_three_channels.tif", tiff(layers[..., :3]))
    write("bad_shape.png", png(layers.reshape(12, 4, 4)[:10]))
    write("bad_pages.tif", tiff([layers[0], layers[1][:3]]))
    write("bad_cut_short.tif", tiff(layers)[:-150])
    pages = tiff(layers)
    first = struct.unpack("<I", pages[4:8])[0]
    entries = struct.unpack("<H", pages[first:first + 2])[0]
    link = first + 2 + 12 * entries
    write("bad_round.tif", pages[:link] + struct.pack("<I", first) + pages[link + 4:])


def make_examples(write):
    """A plume of smoke rings that widens as it rises."""
    n = (40, 40, 40)
    x, y, z = numpy.meshgrid(*((numpy.arange(k) + 0.5) / k for k in n), indexing="ij")
    density = numpy.zeros(n)
    for k in range(5):
        height, radius, wire = 0.12 + 0.185 * k, 0.10 + 0.05 * k, 0.055 + 0.012 * k
        turn = 0.03 * numpy.sin(6 * numpy.arctan2(y - 0.5, x - 0.5) + k)
        away = numpy.hypot(numpy.hypot(x - 0.5, y - 0.5) - radius - turn, z - height + turn) / wire
        density += (30 - 4 * k) * numpy.clip(1 - away**2, 0, 1)
    density = numpy.round(density * 4) / 4
    hot = numpy.clip(1 - 1.6 * z, 0, 1)[..., None]
    color = (0.55 * (1 - hot) + numpy.array([1.0, 0.45, 0.12]) * hot) * (density > 0)[..., None]
    write("smoke.vdb", vdb([("density", density, (0, 0, 0)), ("Cd", numpy.round(color * 64) / 64, (0, 0, 0))],
                           ZIP | ACTIVE_MASK))


folder = sys.argv[-1]


def write(name, data):
    with open(os.path.join(folder, name), "wb") as file:
        file.write(data)


os.makedirs(folder, exist_ok=True)
(make_examples if "--example" in sys.argv else make_tests)(write)
