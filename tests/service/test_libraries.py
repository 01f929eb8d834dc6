#!/usr/bin/env python3
"""Libraries are loaded by the scenes that need them: what a drawing process has mapped is what its report
names, and the plan left out the rest."""

import fcntl
import json
import os
import re
import select
import subprocess
import tempfile
import unittest

PELT = os.environ.get("PELT", "build/pelt")
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
# A file that is mapped -> the library that it stands for: Pelt's module and the library itself.
MAPPED = {r"mesh_gltf\.so|libtinygltf": "tinygltf", r"image_oiio\.so|libOpenImageIO": "OpenImageIO"}
# Never there, whatever the scene: other modules, the other backend, what later versions may load.
NEVER = r"http_curl\.so|libcurl|libembree|liblapacke"
BACKENDS = {"egl": "libEGL", "osmesa": "libOSMesa"}
PIPE_BYTES = 4096
PATIENCE_S = 60


def render(scene, assets):
    """What `pelt render` has mapped when it writes its picture, and its report. The picture goes into a
    pipe that holds less of it than there is, so that the process stays while it is looked at."""
    with tempfile.TemporaryDirectory() as folder:
        path, pipe = os.path.join(folder, "scene.json"), os.path.join(folder, "picture")
        with open(path, "w") as file:
            json.dump(scene, file)
        for name in assets:
            os.symlink(os.path.join(ROOT, name), os.path.join(folder, os.path.basename(name)))
        os.mkfifo(pipe)
        end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        fcntl.fcntl(end, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        run = subprocess.Popen([PELT, "render", path, "-o", pipe, "--format", "png", "--json"],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        try:
            select.select([end], [], [], PATIENCE_S)
            with open(f"/proc/{run.pid}/maps") as file:
                maps = file.read()
            os.set_blocking(end, True)
            picture = b"".join(iter(lambda: os.read(end, 65536), b""))
            stdout, stderr = run.communicate(timeout=PATIENCE_S)
        finally:
            os.close(end)
            run.kill()
            run.wait()
        if run.returncode != 0:
            raise AssertionError(stderr.decode())
        if len(picture) <= 2 * PIPE_BYTES:
            raise AssertionError(f"{len(picture)} bytes of picture: the process need not have waited")
        return maps, json.loads(stdout)


class Libraries(unittest.TestCase):
    def holds(self, needed, objects, assets=()):
        maps, report = render({"image": {"width": 256, "height": 256}, "objects": objects}, assets)
        mapped = {name for pattern, name in MAPPED.items() if re.search(pattern, maps)}
        self.assertEqual(mapped, needed)
        self.assertEqual(set(report["renderer"]["loaded"]), needed)
        self.assertEqual({row["pass"] for row in report["plan"]["passes"]} & set(MAPPED.values()),
                         needed)
        self.assertEqual({row["pass"] for row in report["plan"]["left_out"]} & set(MAPPED.values()),
                         set(MAPPED.values()) - needed)
        self.assertIsNone(re.search(NEVER, maps) if "OpenImageIO" not in needed else None)
        for backend, library in BACKENDS.items():
            self.assertEqual(library in maps, backend == report["renderer"]["backend"], library)

    def test_neither(self):
        self.holds(set(), [{"shell": {"mesh": {"shape": "sphere"}, "material": {"builtin": "fur"}}}])

    def test_a_mesh_without_images(self):
        self.holds({"tinygltf"}, [{"mesh": {"asset": "bunny.glb"}}],
                   ["api/examples/assets/bunny.glb"])

    def test_a_mesh_whose_images_are_not_wanted(self):
        self.holds({"tinygltf"}, [{"shell": {"mesh": {"asset": "texture_transform.glb"},
                                             "material": {"builtin": "fur"},
                                             "base": {"color": [1, 0, 0]}}}],
                   ["tests/data/gltf/texture_transform.glb"])

    def test_a_mesh_with_images(self):
        self.holds({"tinygltf", "OpenImageIO"},
                   [{"shell": {"mesh": {"asset": "texture_transform.glb"},
                               "material": {"builtin": "fur"}, "base": {}}}],
                   ["tests/data/gltf/texture_transform.glb"])

    def test_a_height_field(self):
        self.holds({"OpenImageIO"}, [{"shell": {"mesh": {"shape": "sphere"},
                                                "material": {"height": "pebbles-height.png"}}}],
                   ["api/examples/assets/pebbles-height.png"])


if __name__ == "__main__":
    unittest.main()
