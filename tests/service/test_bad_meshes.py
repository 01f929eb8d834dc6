#!/usr/bin/env python3
"""Every broken glTF file, as a plain mesh and under a shell, in one context: each is refused with the
pointer of its name in the scene, and the good scene after them is drawn."""

import glob
import json
import os
import shutil
import subprocess
import tempfile

PELT = os.environ.get("PELT", "build/pelt")
IMAGE = {"width": 24, "height": 16, "samples": 1}

folder = tempfile.mkdtemp()
try:
    scenes, expected = [], {}
    broken = sorted(glob.glob("tests/data/gltf/bad_*"))
    assert len(broken) >= 26, broken
    for path in broken + ["tests/data/gltf/materials.glb"]:
        name = os.path.basename(path)
        shutil.copy(path, folder)
        mesh = {"asset": name}
        if name.startswith("bad_pose_"):
            mesh["time"] = 1  # at rest nothing is wrong with them
        objects = {"mesh": {"mesh": mesh},
                   "shell": {"shell": {"mesh": mesh, "base": {}, "material": {"builtin": "homogeneous"}}}}
        for kind, thing in objects.items():
            scene = os.path.join(folder, "%s.%s.json" % (name, kind))
            with open(scene, "w") as file:
                json.dump({"image": IMAGE, "objects": [thing]}, file)
            scenes.append(scene)
            at = "time" if name == "bad_pose_still.glb" else "asset"
            pointer = ("/objects/0/mesh/" if kind == "mesh" else "/objects/0/shell/mesh/") + at
            expected[scene] = None if path not in broken else pointer
    run = subprocess.run([PELT, "render", *scenes, "--out-dir", os.path.join(folder, "out")],
                         capture_output=True, timeout=200)
    text = run.stderr.decode()
    # 4: an asset is at fault; 3 where the first fault is that a scene asks for too much.
    assert run.returncode in (3, 4), (run.returncode, text)
    for scene, pointer in expected.items():
        lines = [line for line in text.splitlines() if line.startswith("pelt: %s: " % scene)]
        picture = os.path.join(folder, "out", os.path.basename(scene)[:-5] + ".png")
        if pointer is None:
            assert not lines and os.path.getsize(picture) > 0, lines
        else:
            assert len(lines) == 1, (scene, lines)
            assert lines[0].startswith("pelt: %s: %s: " % (scene, pointer)), lines
            assert not os.path.exists(picture), picture
    print("%d scenes" % len(scenes))
finally:
    shutil.rmtree(folder)
