#!/usr/bin/python3
"""Writes the glTF files that the tests read: make_gltf.py DIRECTORY.

Each function below is one file, named after it; what is broken about a broken one is its first line.
The same bytes every time, so that tests/unit/test_gltf_data.sh can compare the files with this text.
"""
import base64
import json
import math
import os
import struct
import sys
import zlib

BYTE, UBYTE, SHORT, USHORT, UINT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
CODES = {BYTE: "b", UBYTE: "B", SHORT: "h", USHORT: "H", UINT: "I", FLOAT: "f"}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def glb(document, binary, claim=None):
    """`claim`: what the binary chunk's header says of its length, where that is a lie."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    out = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        out += struct.pack("<I4s", len(binary) if claim is None else claim, b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(out)) + out


class Model:
    def __init__(self):
        self.binary = b""
        self.document = {"asset": {"version": "2.0", "generator": "make_gltf.py"}, "bufferViews": [],
                         "accessors": [], "meshes": [], "nodes": []}

    def view(self, data, **members):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.document["bufferViews"].append(
            dict(buffer=0, byteOffset=len(self.binary), byteLength=len(data), **members))
        self.binary += data
        return len(self.document["bufferViews"]) - 1

    def accessor(self, rows, component=FLOAT, **members):
        rows = [row if isinstance(row, (list, tuple)) else [row] for row in rows]
        data = b"".join(struct.pack("<%d%s" % (len(row), CODES[component]), *row) for row in rows)
        return self.describe(self.view(data), len(rows), len(rows[0]), component, **members)

    def describe(self, view, count, components, component, **members):
        accessor = dict(componentType=component, count=count, type=TYPES[components], **members)
        if view is not None:
            accessor["bufferView"] = view
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def mesh(self, *primitives):
        self.document["meshes"].append({"primitives": list(primitives)})
        return len(self.document["meshes"]) - 1

    def node(self, **members):
        self.document["nodes"].append(members)
        return len(self.document["nodes"]) - 1

    def finish(self, roots=(0,), **members):
        self.document["scenes"] = [{"nodes": list(roots)}]
        self.document["scene"] = 0
        self.document.update(members)
        if self.binary and "buffers" not in self.document:
            self.document["buffers"] = [{"byteLength": len(self.binary)}]
        self.document = {k: v for k, v in self.document.items() if v != []}
        return self

    def glb(self, **how):
        return glb(self.document, self.binary, **how)


CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
NORMALS = [(0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0)]
TETRA = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
TETRA_FACES = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


def split(sides):
    return [v for a, b, c, d in sides for v in (a, b, c, a, c, d)]


def tetra(**members):
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA)},
                "indices": model.accessor(TETRA_FACES, USHORT)})
    model.node(mesh=0, **members)
    return model


def png(rgba_rows):
    """A PNG of 8-bit RGBA."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows = b"".join(b"\0" + bytes(v for pixel in row for v in pixel) for row in rgba_rows)
    header = struct.pack(">IIBBBBB", len(rgba_rows[0]), len(rgba_rows), 8, 6, 0, 0, 0)
    # Stored, not deflated: the bytes must not depend on zlib's version.
    deflated = b"\x78\x01\x01" + struct.pack("<HH", len(rows), len(rows) ^ 0xffff) + rows
    deflated += struct.pack(">I", zlib.adler32(rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", deflated) + chunk(b"IEND", b"")


PIXELS = [[(255, 0, 0, 255), (0, 255, 0, 255)], [(0, 0, 255, 255), (255, 255, 255, 128)]]


# --- good -----------------------------------------------------------------------------------------

def plain():
    """A unit cube: every corner a vertex of its own, no indices, normals or texture coordinates."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor([CORNERS[i] for i in split(SIDES)])}})
    model.node(mesh=0)
    return model.finish().glb()


def plates(heights):
    """Square plates of side 2 at given heights in Pelt's z, each facing up (1) or down (-1)."""
    model = Model()
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = [(x, z, -y) for z, _ in heights for x, y in square]
    normals = [(0, up, 0) for _, up in heights for _ in square]
    uvs = [((x + 1) / 2, (y + 1) / 2) for _ in heights for x, y in square]
    sides = [tuple(4 * k + i for i in ((0, 1, 2, 3) if up > 0 else (0, 3, 2, 1)))
             for k, (_, up) in enumerate(heights)]
    model.mesh({"attributes": {"POSITION": model.accessor(points), "NORMAL": model.accessor(normals),
                               "TEXCOORD_0": model.accessor(uvs)},
                "indices": model.accessor(split(sides), UBYTE)})
    model.node(mesh=0)
    return model.finish().glb()


def facing_plates():
    """Two plates that face one another: thick shells over them overlap."""
    return plates([(0, 1), (0.3, -1)])


def stacked_plates():
    """Seven plates close above one another."""
    return plates([(k / 16, 1) for k in range(7)])


def hard_edges():
    """The cube as an exporter writes it: 24 vertices, flat normals, each side one texture. As .gltf."""
    model = Model()
    square = [(0, 1), (1, 1), (1, 0), (0, 0)]
    model.mesh({"attributes": {
        "POSITION": model.accessor([CORNERS[i] for side in SIDES for i in side]),
        "NORMAL": model.accessor([NORMALS[s] for s in range(6) for _ in range(4)]),
        "TEXCOORD_0": model.accessor([uv for _ in range(6) for uv in square])},
        "indices": model.accessor(split([(i, i + 1, i + 2, i + 3) for i in range(0, 24, 4)]), UBYTE)})
    model.node(mesh=0)
    data = "data:application/octet-stream;base64," + base64.b64encode(model.binary).decode()
    model.finish(buffers=[{"byteLength": len(model.binary), "uri": data}])
    return json.dumps(model.document, indent=1).encode()


def strips_and_fans():
    """A strip of four unit squares that jumps (repeated vertices), a fan of a regular hexagon, points."""
    model = Model()
    strip = [(x, y, 0) for x in range(3) for y in (1, 0)]
    strip += [(x, y, 0) for x in range(4, 7) for y in (1, 0)]
    order = [0, 1, 2, 3, 4, 5, 5, 6, 6, 7, 8, 9, 10, 11]
    rim = [(math.cos(math.pi / 3 * k), math.sin(math.pi / 3 * k) - 3, 0) for k in range(7)]
    model.mesh({"attributes": {"POSITION": model.accessor(strip)}, "mode": STRIP,
                "indices": model.accessor(order, UINT)},
               {"attributes": {"POSITION": model.accessor([(0, -3, 0)] + rim[:6] + rim[:1])}, "mode": FAN},
               {"attributes": {"POSITION": model.accessor([(9, 9, 9)])}, "mode": POINTS})
    model.node(mesh=0)
    return model.finish().glb()


def materials():
    """Two primitives: one red, one textured (a PNG in a buffer view) by its second set of UVs."""
    model = Model()
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uv = [(0, 1), (1, 1), (1, 0), (0, 0)]
    position = model.accessor(square)
    indices = model.accessor([0, 1, 2, 0, 2, 3], USHORT)
    shifted = model.accessor([(x + 2, y, z) for x, y, z in square])
    image = model.view(png(PIXELS))
    model.mesh({"attributes": {"POSITION": position, "TEXCOORD_0": model.accessor(uv)},
                "indices": indices, "material": 1},
               {"attributes": {"POSITION": shifted, "TEXCOORD_0": model.accessor([(9, 9)] * 4),
                               "TEXCOORD_1": model.accessor(uv)}, "indices": indices, "material": 0})
    model.node(mesh=0)
    return model.finish(
        images=[{"bufferView": image, "mimeType": "image/png"}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1},
                                             "baseColorFactor": [1, 0.5, 1, 1]}},
                   {"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0, 0, 1]}}]).glb()


def cubes():
    """Two closed cubes, 1 apart: the left one dark red, the right one textured from above: red and green
    at the far side, blue and white at the near one (Y is up here, the near side is at z = 0)."""
    model = Model()
    corners = [(x, y, z) for z in (0, -1) for y in (0, 1) for x in (0, 1)]
    indices = model.accessor([0, 5, 4, 0, 1, 5, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1,
                              4, 7, 6, 4, 5, 7, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5], USHORT)
    uv = model.accessor([(x, 1 + z) for x, y, z in corners])
    image = model.view(png([[(255, 0, 0, 255), (0, 255, 0, 255)], [(0, 0, 255, 255), (255, 255, 255, 255)]]))
    for offset, material in ((0, 1), (2, 0)):
        model.mesh({"attributes": {
            "POSITION": model.accessor([(x + offset, y, z) for x, y, z in corners]), "TEXCOORD_0": uv},
            "indices": indices, "material": material})
    model.node(mesh=0)
    model.node(mesh=1)
    return model.finish(
        images=[{"bufferView": image, "mimeType": "image/png"}], textures=[{"source": 0}], roots=(0, 1),
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
                   {"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0, 0, 1]}}]).glb()


def texture_transform():
    """KHR_texture_transform, required: scale 2, quarter turn, offset (0.5, 0.25); image as data URI."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor([(0, 0, 0), (1, 0, 0), (0, 1, 0)]),
                               "TEXCOORD_0": model.accessor([(0, 0), (1, 0), (0, 1)])}, "material": 0})
    model.node(mesh=0)
    transform = {"offset": [0.5, 0.25], "rotation": math.pi / 2, "scale": [2, 2]}
    uri = "data:image/png;base64," + base64.b64encode(png(PIXELS)).decode()
    return model.finish(
        extensionsUsed=["KHR_texture_transform"], extensionsRequired=["KHR_texture_transform"],
        images=[{"uri": uri}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {
            "index": 0, "extensions": {"KHR_texture_transform": transform}}}}]).glb()


def nodes():
    """One tetrahedron shown by five nodes: as it is, moved and scaled, mirrored, turned, by a matrix."""
    model = tetra()
    half = math.sqrt(0.5)
    model.node(mesh=0, translation=[10, 0, 0], scale=[2, 2, 2])
    model.node(mesh=0, translation=[0, 10, 0], scale=[-1, 1, 1])
    model.node(translation=[0, 0, 10], children=[4])
    model.node(mesh=0, rotation=[0, half, 0, half])  # x to -z, z to x
    model.node(mesh=0, matrix=[0, 3, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, -10, 0, 0, 1])
    return model.finish(roots=(0, 1, 2, 3, 5)).glb()


def second_scene():
    """The default scene is the second of two."""
    model = tetra()
    model.node(mesh=0, translation=[5, 0, 0])
    model.finish()
    model.document["scenes"].append({"nodes": [1]})
    model.document["scene"] = 1
    return model.glb()


def no_scene():
    """No scene and no node: the mesh itself."""
    model = tetra()
    model.finish()
    for name in ("scene", "scenes", "nodes"):
        del model.document[name]
    return model.glb()


def sparse():
    """The tetrahedron, its positions all zero but for sparse replacements."""
    model = Model()
    indices, values = model.view(struct.pack("<3H", 1, 2, 3)), model.view(
        b"".join(struct.pack("<3f", *p) for p in TETRA[1:]))
    position = model.describe(None, 4, 3, FLOAT, sparse={
        "count": 3, "indices": {"bufferView": indices, "componentType": USHORT},
        "values": {"bufferView": values}})
    model.mesh({"attributes": {"POSITION": position}, "indices": model.accessor(TETRA_FACES, UBYTE)})
    model.node(mesh=0)
    return model.finish().glb()


def quantized():
    """Interleaved with a stride: 16-bit positions, 8-bit normals and UVs, all normalised integers."""
    model = Model()
    data = b"".join(struct.pack("<3H2x3bx2B2x", *[65535 * v for v in p], 0, 0, 127, *[255 * v for v in p[:2]])
                    for p in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)))
    view = model.view(data, byteStride=16)
    model.mesh({"attributes": {
        "POSITION": model.describe(view, 4, 3, USHORT, normalized=True),
        "NORMAL": model.describe(view, 4, 3, BYTE, normalized=True, byteOffset=8),
        "TEXCOORD_0": model.describe(view, 4, 2, UBYTE, normalized=True, byteOffset=12)},
        "indices": model.accessor([0, 1, 2, 0, 2, 3], UBYTE)})
    model.node(mesh=0)
    return model.finish(extensionsUsed=["KHR_mesh_quantization"],
                        extensionsRequired=["KHR_mesh_quantization"]).glb()


def degenerate():
    """A square and three triangles without an area: a repeated corner, a point, three in line."""
    model = Model()
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.1, 0.3, 0), (0.2, 0.6, 0), (0.3, 0.9, 0)]
    model.mesh({"attributes": {"POSITION": model.accessor(points)},
                "indices": model.accessor([0, 1, 2, 1, 1, 2, 3, 3, 3, 0, 2, 3, 0, 4, 5], USHORT)})
    model.node(mesh=0)
    return model.finish().glb()


def animation(model, name, *channels):
    """Adds an animation; a channel is (node, path, times, values, interpolation)."""
    samplers = [{"input": model.accessor(times), "output": model.accessor(values), "interpolation": how}
                for _, _, times, values, how in channels]
    targets = [{"sampler": i, "target": {"node": node, "path": path}}
               for i, (node, path, *_) in enumerate(channels)]
    model.document.setdefault("animations", []).append(
        {"name": name, "samplers": samplers, "channels": targets})


def about_z(degrees):
    return (0, 0, math.sin(math.radians(degrees) / 2), math.cos(math.radians(degrees) / 2))


def bar(weights=((1, 0, 0, 0), (0.5, 0.5, 0, 0), (0, 0.5, 0, 0)), joints=(0, 1, 0, 0), bones=(1, 2),
        roots=(0, 1)):
    """A square bar of two cubes along y, its upper half on a joint at (0, 1, 0) that turns about z."""
    model = Model()
    points = [(x, y, z) for y in (0, 1, 2) for x, z in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    walls = [(4 * y + k, 4 * y + 4 + k, 4 * y + 4 + (k + 1) % 4, 4 * y + (k + 1) % 4)
             for y in (0, 1) for k in range(4)]
    model.mesh({"attributes": {
        "POSITION": model.accessor(points),
        "JOINTS_0": model.accessor([joints for _ in points], UBYTE),
        "WEIGHTS_0": model.accessor([weights[i // 4] for i in range(len(points))])},
        "indices": model.accessor(split(walls + [(0, 1, 2, 3), (11, 10, 9, 8)]), USHORT)})
    model.node(mesh=0, skin=0, translation=[5, 5, 5])  # which a skin ignores
    model.node(children=[2])
    model.node(translation=[0, 1, 0])
    bind = [(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, y, 0, 1) for y in (0, -1)]
    model.document["skins"] = [{"joints": list(bones), "inverseBindMatrices": model.accessor(bind)}]
    animation(model, "bend", (2, "rotation", [0, 2], [about_z(0), about_z(90)], "LINEAR"))
    animation(model, "lift", (1, "translation", [1, 3], [(0, 0, 0), (0, 0, 4)], "STEP"))
    return model.finish(roots=roots)


def skin():
    """A bar that bends: weights that sum to 1 or, at its top, to a half."""
    return bar().glb()


def morph():
    """A square whose targets lift it and widen it; the mesh's own weights, and an animation of them."""
    model = Model()
    square = [(0, 0, 0), (1, 0, 0), (1, 0, -1), (0, 0, -1)]
    lift = model.accessor([(0, 1, 0)] * 4)
    widen = model.accessor([(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 0)])
    tilt = model.accessor([(1, -1, 0)] * 4)
    model.mesh({"attributes": {"POSITION": model.accessor(square), "NORMAL": model.accessor([(0, 1, 0)] * 4)},
                "targets": [{"POSITION": lift, "NORMAL": tilt}, {"POSITION": widen}],
                "indices": model.accessor([0, 1, 2, 0, 2, 3], UBYTE)})
    model.document["meshes"][0]["weights"] = [0, 0.5]
    model.node(mesh=0)
    model.node()
    animation(model, "swell", (0, "weights", [0, 1, 3], [0, 0, 1, 0, 0, 2], "LINEAR"))
    animation(model, "elsewhere", (1, "translation", [0], [(1, 1, 1)], "LINEAR"))
    return model.finish(roots=(0, 1)).glb()


def animated_nodes():
    """Tetrahedra that are moved (cubic), scaled (step) and turned the shorter way (linear)."""
    model = tetra()
    model.node(mesh=0, translation=[10, 0, 0])
    model.node(mesh=0)
    minus = tuple(-x for x in about_z(90))
    animation(model, "", (0, "translation", [1, 3], [(0, 0, 0), (0, 0, 0), (1, 0, 0),
                                                     (0, 0, 0), (2, 0, 0), (0, 0, 0)], "CUBICSPLINE"),
              (1, "scale", [0, 2], [(1, 1, 1), (2, 2, -2)], "STEP"),
              (2, "rotation", [0, 3], [about_z(0), minus], "LINEAR"))
    return model.finish(roots=(0, 1, 2)).glb()


# --- broken ---------------------------------------------------------------------------------------

def bad_cut_short():
    """The second half is missing."""
    whole = plain()
    return whole[: len(whole) // 2]


def bad_chunk_length():
    """The binary chunk claims 8 bytes more than the file has: tinygltf 2.7.0 reads them."""
    model = tetra()
    model.binary += b"\0" * (-len(model.binary) % 4)
    model.finish(buffers=[{"byteLength": len(model.binary) + 8}])
    return model.glb(claim=len(model.binary) + 8)


def bad_index():
    """Index 3 is vertex 4 of 4."""
    model = tetra()
    model.finish().binary = model.binary.replace(struct.pack("<4H", 0, 2, 1, 0), struct.pack("<4H", 0, 2, 1, 4))
    return model.glb()


def bad_position(value):
    model = tetra()
    model.finish().binary = struct.pack("<f", value) + model.binary[4:]
    return model.glb()


def bad_nan():
    """A position is NaN."""
    return bad_position(math.nan)


def bad_infinity():
    """A position is infinite."""
    return bad_position(math.inf)


def bad_far():
    """A node's scale sends the mesh out of reach."""
    return tetra(scale=[1e38, 1e38, 1e38]).finish().glb()


def bad_points_only():
    """No triangles: points."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA)}, "mode": POINTS})
    model.node(mesh=0)
    return model.finish().glb()


def bad_no_mesh():
    """No mesh at all."""
    return Model().finish(roots=()).glb()


def bad_flat():
    """Every triangle is without an area."""
    return tetra(scale=[1, 0, 0]).finish().glb()


def bad_cycle():
    """Two nodes are each other's children."""
    model = tetra(children=[1])
    model.node(children=[0])
    return model.finish().glb()


def bad_shared_child():
    """Each of 60 nodes has the next one twice: 2^60 instances."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA[:3])}})
    for i in range(60):
        model.node(children=[i + 1, i + 1])
    model.node(mesh=0)
    return model.finish().glb()


def bad_node():
    """A scene shows node 7 of 1."""
    return tetra().finish(roots=(7,)).glb()


def bad_bomb():
    """1,000 nodes show a strip of 8,190 triangles each."""
    model = Model()
    position = model.accessor([(i, i % 2, 0) for i in range(16)])
    view = model.view(bytes(i % 16 for i in range(8192)))
    model.mesh({"attributes": {"POSITION": position}, "mode": STRIP,
                "indices": model.describe(view, 8192, 1, UBYTE)})
    for _ in range(1000):
        model.node(mesh=0)
    return model.finish(roots=range(1000)).glb()


def bad_buffers():
    """10,000 buffers, each a copy of a binary chunk of 200 kB."""
    model = tetra()
    model.binary += b"\0" * 200000
    return model.finish(buffers=[{"byteLength": len(model.binary)}] * 10000).glb()


def bad_depth():
    """Extras nest 10,000 deep."""
    model = tetra().finish(extras="DEEP")
    text = json.dumps(model.document).replace('"DEEP"', '{"a":' * 10000 + "0" + "}" * 10000)
    return text.encode()


def bad_count():
    """An accessor claims 2^62 elements."""
    model = tetra().finish()
    model.document["accessors"][0]["count"] = 2 ** 62
    return model.glb()


def bad_accessor():
    """An accessor reaches past the end of its buffer view."""
    model = tetra().finish()
    model.document["accessors"][0]["count"] = 5
    return model.glb()


def bad_view():
    """A buffer view reaches past the end of its buffer."""
    model = tetra().finish()
    model.document["bufferViews"][1]["byteOffset"] = 2 ** 40
    return model.glb()


def bad_sparse():
    """A sparse index is 4 of 4."""
    data = sparse()
    return data.replace(struct.pack("<3H", 1, 2, 3), struct.pack("<3H", 1, 2, 4))


def bad_corner_count():
    """Four corners do not make triangles."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA)}})
    model.node(mesh=0)
    return model.finish().glb()


def bad_draco():
    """Compressed geometry."""
    return tetra().finish(extensionsUsed=["KHR_draco_mesh_compression"],
                          extensionsRequired=["KHR_draco_mesh_compression"]).glb()


def bad_external():
    """The buffer is another file."""
    model = tetra()
    return model.finish(buffers=[{"byteLength": len(model.binary), "uri": "/etc/passwd"}]).glb()


def bad_texture():
    """The texture is a file of its own."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA[:3]),
                               "TEXCOORD_0": model.accessor([(0, 0), (1, 0), (0, 1)])}, "material": 0})
    model.node(mesh=0)
    return model.finish(images=[{"uri": "skin.png"}], textures=[{"source": 0}], materials=[
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]).glb()


def bad_picture():
    """The texture is not a picture."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA[:3]),
                               "TEXCOORD_0": model.accessor([(0, 0), (1, 0), (0, 1)])}, "material": 0})
    model.node(mesh=0)
    view = model.view(b"%PDF-1.4 not a picture")
    return model.finish(images=[{"bufferView": view, "mimeType": "image/png"}], textures=[{"source": 0}],
                        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]).glb()


def bad_json():
    """Not JSON."""
    return b'{"asset": {"version": "2.0"}, "meshes": ['


def bad_kind():
    """Neither .glb nor .gltf."""
    return b"solid cube\nfacet normal 0 0 1\n"


# --- broken in a pose alone -----------------------------------------------------------------------

def bad_pose_joint():
    """Vertices follow joint 9 of 2."""
    return bar(joints=(0, 9, 0, 0)).glb()


def bad_pose_nan():
    """A weight is NaN."""
    return bar(weights=((1, 0, 0, 0), (math.nan, 0.5, 0, 0), (0, 1, 0, 0))).glb()


def bad_pose_negative():
    """A weight is negative."""
    return bar(weights=((1, 0, 0, 0), (0.5, -0.5, 1, 0), (0, 1, 0, 0))).glb()


def bad_pose_weightless():
    """Weights sum to 0."""
    return bar(weights=((1, 0, 0, 0), (0, 0, 0, 0), (0, 1, 0, 0))).glb()


def bad_pose_bone():
    """A joint is not in the scene."""
    return bar(roots=(0,)).glb()


def bad_pose_bones():
    """A joint is node 7 of 3."""
    return bar(bones=(1, 7)).glb()


def bad_pose_order():
    """Keys are not in order of time."""
    model = tetra()
    animation(model, "", (0, "translation", [0, 2, 2], [(0, 0, 0)] * 3, "LINEAR"))
    return model.finish().glb()


def bad_pose_count():
    """Two keys have five values."""
    model = tetra()
    animation(model, "", (0, "translation", [0, 2], [(0, 0, 0)] * 5, "CUBICSPLINE"))
    return model.finish().glb()


def bad_pose_value():
    """A value is infinite."""
    model = tetra()
    animation(model, "", (0, "translation", [0, 2], [(0, 0, 0), (0, math.inf, 0)], "LINEAR"))
    return model.finish().glb()


def bad_pose_node():
    """An animation moves node 5 of 1."""
    model = tetra()
    animation(model, "", (5, "translation", [0], [(0, 0, 0)], "LINEAR"))
    return model.finish().glb()


def bad_pose_target():
    """A morph target has three vertices of four."""
    model = Model()
    model.mesh({"attributes": {"POSITION": model.accessor(TETRA)},
                "targets": [{"POSITION": model.accessor(TETRA[:3])}],
                "indices": model.accessor(TETRA_FACES, USHORT)})
    model.node(mesh=0)
    animation(model, "", (0, "weights", [0, 1], [1, 1], "LINEAR"))
    return model.finish().glb()


def bad_pose_still():
    """No animation at all."""
    return tetra().finish().glb()


if __name__ == "__main__":
    directory = sys.argv[1]
    os.makedirs(directory, exist_ok=True)
    for name, make in sorted(globals().items()):
        if callable(make) and make.__doc__ and name not in ("glb", "plates", "png", "animation", "bar") and not isinstance(make, type):
            data = make()
            extension = ".glb" if data[:4] == b"glTF" or name == "bad_kind" else ".gltf"
            with open(os.path.join(directory, name + extension), "wb") as file:
                file.write(data)
