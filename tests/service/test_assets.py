#!/usr/bin/python3
"""Assets: as parts of a request, and from the server's folder, which no path leads out of."""

import os
import subprocess
import tempfile

from harness import PELT, TETRAHEDRON, TETRAHEDRON_FACES, Daemon, glb, main, scene

CUT = [0, 2, 1, 0, 1, 3]


def asking_for(name):
    return scene(objects=[{"shell": {"mesh": {"asset": name},
                                     "material": {"builtin": "homogeneous"}}}])


def test_part_and_folder_give_the_same():
    data = glb(TETRAHEDRON, TETRAHEDRON_FACES)
    with tempfile.TemporaryDirectory() as folder:
        os.mkdir(os.path.join(folder, "deeper"))
        for name in ["a.glb", "deeper/b.glb"]:
            with open(os.path.join(folder, name), "wb") as file:
                file.write(data)
        with Daemon("--workers", "1", "--assets", folder) as daemon:
            by_part = daemon.post_parts([("scene", asking_for("x.glb")), ("x.glb", data)])
            assert by_part.status == 200, by_part.body
            for name in ["a.glb", "deeper/b.glb"]:
                reply = daemon.post(asking_for(name))
                assert (reply.status, reply.body) == (200, by_part.body), name
            # A part stands before a file of the same name.
            cut = glb(TETRAHEDRON, CUT)
            reply = daemon.post_parts([("scene", asking_for("a.glb")), ("a.glb", cut)])
            assert reply.status == 200 and reply.body != by_part.body


def test_a_file_that_changes_is_read_again():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.glb")
        with Daemon("--workers", "1", "--assets", folder) as daemon:
            pictures = []
            for faces in [TETRAHEDRON_FACES, CUT]:
                with open(path + ".new", "wb") as file:
                    file.write(glb(TETRAHEDRON, faces))
                os.rename(path + ".new", path)
                pictures += [daemon.post(asking_for("a.glb")).body for _ in range(2)]
            assert pictures[0] == pictures[1] != pictures[2] == pictures[3]
            stored = daemon.metric("pelt_asset_store_bytes")
            assert stored == len(glb(TETRAHEDRON, TETRAHEDRON_FACES)) + len(glb(TETRAHEDRON, CUT))


def test_nothing_outside_the_folder():
    with tempfile.TemporaryDirectory() as above:
        folder = os.path.join(above, "assets")
        os.mkdir(folder)
        with open(os.path.join(above, "secret.glb"), "wb") as file:
            file.write(glb(TETRAHEDRON, TETRAHEDRON_FACES))
        os.symlink("../secret.glb", os.path.join(folder, "link.glb"))
        os.symlink(above, os.path.join(folder, "up"))
        os.symlink("loop.glb", os.path.join(folder, "loop.glb"))
        os.mkfifo(os.path.join(folder, "fifo.glb"))
        os.mkdir(os.path.join(folder, "folder.glb"))
        with Daemon("--workers", "1", "--assets", folder) as daemon:
            pointer = "/objects/0/shell/mesh/asset"
            for name, slug in [("../secret.glb", "invalid-scene"),
                               ("deeper/../../secret.glb", "invalid-scene"),
                               (os.path.join(above, "secret.glb"), "invalid-scene"),
                               ("./a.glb", "invalid-scene"),
                               ("a\\u0000.glb", "invalid-scene"),
                               ("link.glb", "asset-not-found"),
                               ("up/secret.glb", "asset-not-found"),
                               ("loop.glb", "asset-not-found"),
                               ("nowhere.glb", "asset-not-found"),
                               ("x" * 5000, None),
                               ("sha256:" + "0" * 64, "asset-not-found"),
                               ("fifo.glb", "bad-asset"), ("folder.glb", "bad-asset")]:
                reply = daemon.post(asking_for(name.replace("\\u0000", "\0")))
                assert reply.status == 422, (name, reply.status, reply.body)
                assert slug in (None, reply.slug()), (name, reply.body)
                assert pointer in [row.get("pointer") for row in reply.json()["errors"]], reply.body
            daemon.check_good()


def test_every_missing_asset_is_named():
    document = asking_for("a.glb")
    document["objects"] += asking_for("b.glb")["objects"]
    with Daemon("--workers", "1") as daemon:
        reply = daemon.post(document)
        assert (reply.status, reply.slug()) == (422, "asset-not-found"), reply.body
        assert [row["pointer"] for row in reply.json()["errors"]] == \
            ["/objects/0/shell/mesh/asset", "/objects/1/shell/mesh/asset"], reply.body


def test_a_folder_that_is_not_there():
    done = subprocess.run([PELT, "serve", "--listen", "127.0.0.1:0", "--assets", "/nowhere/at/all"],
                          capture_output=True, text=True)
    assert done.returncode == 1 and "/nowhere/at/all" in done.stderr, done


main(globals())
