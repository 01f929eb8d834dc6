#!/usr/bin/python3
"""Makes tests/data/image: small pictures in every format that is read, and broken ones of each kind.
Needs numpy and PIL; the files are committed.

good*: 8 x 8 or 16 x 16 pixels, the upper half red (255, 0, 0), the lower half blue (0, 0, 255).
bad_*: cut short, lying about their size, empty, or no pictures at all.

Usage: make_images.py FOLDER"""

import io
import os
import struct
import sys
import zlib

import numpy
from PIL import Image

folder = sys.argv[1]


def write(name, data):
    with open(os.path.join(folder, name), "wb") as file:
        file.write(data)


def encoded(pixels, kind, **options):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind, **options)
    return file.getvalue()


def png(width, height, bits, kind, rows):
    """A PNG file that says what it is told to, whatever its rows hold."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + data


def exr(width, height, lines=b"", tiles=None, flags=2):
    """An OpenEXR file of half floats, not compressed, whose header says what it is told to."""

    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value

    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    channels = b"".join(name + struct.pack("<BIIII", 0, 1, 0, 1, 1) for name in (b"B", b"G", b"R"))
    data = b"v/1\x01" + struct.pack("<I", flags)
    data += attribute(b"channels", b"chlist", channels + b"\0")
    data += attribute(b"compression", b"compression", b"\0")
    data += attribute(b"dataWindow", b"box2i", window)
    data += attribute(b"displayWindow", b"box2i", window)
    data += attribute(b"lineOrder", b"lineOrder", b"\0")
    data += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    data += attribute(b"screenWindowCenter", b"v2f", bytes(8))
    data += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1))
    if tiles:
        data += attribute(b"tiles", b"tiledesc", struct.pack("<IIB", *tiles, 0))
    data += b"\0"
    count = len(lines)
    at = len(data) + 8 * count
    blocks = [struct.pack("<iI", y, len(line)) + line for y, line in enumerate(lines)]
    for block in blocks:
        data += struct.pack("<Q", at)
        at += len(block)
    return data + b"".join(blocks)


def halves(side):
    pixels = numpy.zeros((side, side, 3), numpy.uint8)
    pixels[: side // 2] = (255, 0, 0)
    pixels[side // 2 :] = (0, 0, 255)
    return pixels


small = halves(8)
noise = numpy.random.default_rng(1).integers(0, 256, (64, 64, 3), dtype=numpy.uint8)

write("good_8.png", encoded(small, "PNG"))
write("good.jpg", encoded(halves(16), "JPEG", quality=95, subsampling=0))
write("good.tif", encoded(small, "TIFF"))
write("good.gif", encoded(small, "GIF"))
write("good.webp", encoded(small, "WEBP", lossless=True))
# Radiance: one RGBE pixel is mantissas and a shared exponent; 0.5 * 2^1 = 1.
rgbe = {0: b"\x80\x00\x00\x81", 1: b"\x00\x00\x80\x81"}
hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 8\n" + rgbe[0] * 32 + rgbe[1] * 32
write("good.hdr", hdr)
one, zero = struct.pack("<8e", *[1] * 8), bytes(16)  # a line of one channel; B, G, R in turn
exr_lines = [zero + zero + one] * 4 + [one + zero + zero] * 4
write("good.exr", exr(8, 8, exr_lines))
write("good_alpha.png", encoded(numpy.dstack([small, numpy.full((8, 8), 51, numpy.uint8)]), "PNG"))
ramp = numpy.arange(64, dtype=numpy.uint16).reshape(8, 8) * 1040
write("grey_16.png", encoded(ramp, "PNG"))
write("grey_1.png", png(8, 2, 1, 0, b"\x00\xff\x00\x00"))

# What the reader must refuse.
big = {
    "png": encoded(noise, "PNG"),
    "jpg": encoded(noise, "JPEG", quality=90),
    "tif": encoded(noise, "TIFF"),
    "gif": encoded(noise, "GIF"),
    "webp": encoded(noise, "WEBP", lossless=True),
    "hdr": hdr,
    "exr": exr(8, 8, exr_lines),
}
for kind, data in big.items():
    write("bad_cut_short." + kind, data[: len(data) * 3 // 5])
    write("bad_header_only." + kind, data[:20])
write("bad_100000_wide.png", png(100000, 100000, 8, 0, bytes(100)))
write("bad_lying.png", png(8000, 8000, 8, 6, bytes(100)))
write("bad_lying_a_little.png", png(300, 300, 8, 0, bytes(301 * 100)))
write("bad_no_width.png", png(0, 10, 8, 0, b""))
write("bad_checksum.png", bytes(b ^ (i == 40) for i, b in enumerate(big["png"])))
write("bad_100000_wide.exr", exr(100000, 100000))
write("bad_2_billion_high.exr", exr(1, 2**31 - 1))
write("bad_no_width.exr", exr(0, 8))
write("bad_tiles_of_one.exr", exr(16000, 4000, tiles=(1, 1), flags=0x202))
write("bad_tiles_too_large.exr", exr(16000, 4000, tiles=(2**30, 2**30), flags=0x202))
write("bad_deep.exr", exr(8, 8, exr_lines, flags=0x802))
write("bad_cut_in_header.exr", exr(8, 8)[:150])
gif = bytearray(big["gif"])
gif[6:10] = b"\xff\xff\xff\xff"
write("bad_65535_wide.gif", bytes(gif))
# A canvas of 16384 x 16384 in the extended header: four times the pixels that are allowed.
vp8x = b"VP8X" + struct.pack("<I", 10) + bytes(4) + b"\xff\x3f\x00" * 2
body = b"WEBP" + vp8x + encoded(small, "WEBP", lossless=True)[12:]
write("bad_16384_wide.webp", b"RIFF" + struct.pack("<I", len(body)) + body)
webp = bytearray(big["webp"])
struct.pack_into("<I", webp, 21, 0x3fff << 14 | 0x3fff)  # both fields of 14 bits full
write("bad_16384_lossless.webp", bytes(webp))
tif = bytearray(encoded(small, "TIFF"))
at = struct.unpack_from("<I", tif, 4)[0]
for entry in range(struct.unpack_from("<H", tif, at)[0]):
    tag = at + 2 + 12 * entry
    if struct.unpack_from("<H", tif, tag)[0] in (256, 257):  # ImageWidth, ImageLength
        struct.pack_into("<HII", tif, tag + 2, 4, 1, 60000)
write("bad_60000_wide.tif", bytes(tif))
write("bad_text.png", b"this is not a picture\n")
write("bad_empty.png", b"")
write("bad_targa.tga", encoded(small, "TGA"))
write("bad_bitmap.bmp", encoded(small, "BMP"))
