#!/usr/bin/python3
"""Makes api/examples/assets/pebbles-height.png (16 bit, linear) and pebbles-color.png (sRGB): rounded
stones, periodic in both directions, from a fixed seed. Needs numpy and PIL; the files are committed.

Usage: make_pebbles.py FOLDER"""

import os
import sys

import numpy
from PIL import Image

SIDE, CELLS = 256, 9

rng = numpy.random.default_rng(7)
# One stone for each cell of a jittered grid; its neighbours across the border are its copies.
grid = numpy.stack(numpy.meshgrid(numpy.arange(CELLS), numpy.arange(CELLS)), -1).reshape(-1, 2)
stones = (grid + 0.5 + rng.uniform(-0.38, 0.38, grid.shape)) / CELLS
tints = numpy.array([[0.42, 0.38, 0.34], [0.55, 0.52, 0.48], [0.33, 0.35, 0.38], [0.50, 0.40, 0.32]])
colors = tints[rng.integers(0, len(tints), len(stones))] * rng.uniform(0.75, 1.15, (len(stones), 1))
tops = rng.uniform(0.7, 1.0, len(stones))

centres = (numpy.arange(SIDE) + 0.5) / SIDE
pixels = numpy.stack(numpy.meshgrid(centres, centres), -1).reshape(-1, 1, 2)
offset = pixels - stones[None]
offset -= numpy.round(offset)
distance = numpy.sqrt((offset ** 2).sum(-1))
order = numpy.argsort(distance, 1)
near, next_near = (numpy.take_along_axis(distance, order[:, k:k + 1], 1)[:, 0] for k in (0, 1))
stone = order[:, 0]

# How far inside the stone, 0 at the gap between two: a dome that meets the gap at a finite slope.
inside = numpy.clip((next_near - near) * CELLS / 0.9, 0, 1)
dome = inside * (2 - inside)
height = dome * tops[stone]
gap = numpy.array([0.10, 0.09, 0.08])
mix = numpy.clip(inside * 6, 0, 1)[:, None]
grain = rng.uniform(0.92, 1.08, (SIDE * SIDE, 1))
linear = numpy.clip((gap * (1 - mix) + colors[stone] * mix) * grain, 0, 1)
srgb = numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)

folder = sys.argv[1]
Image.fromarray((height.reshape(SIDE, SIDE) * 65535).round().astype(numpy.uint16)).save(
    os.path.join(folder, "pebbles-height.png"), optimize=True)
Image.fromarray((srgb.reshape(SIDE, SIDE, 3) * 255).round().astype(numpy.uint8)).save(
    os.path.join(folder, "pebbles-color.png"), optimize=True)
