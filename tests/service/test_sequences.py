#!/usr/bin/python3
"""Sequences on the command line and over HTTP: the same bytes from both and from a part of the range,
frames that are read while others are drawn, and all that can go wrong."""

import json
import os
import re
import signal
import subprocess
import tempfile
import threading

from harness import PELT, SHELL, Daemon, main, scene

SMALL_SHELL = {"shell": {"mesh": {"shape": "torus", "divisions": [12, 6]}, "thickness": 0.2, "base": {},
                         "material": {"builtin": "fur", "size": [16, 16, 8]}}}
MOVING = {"frames": 6, "fps": 10, "scene": scene(side=24, objects=[SMALL_SHELL]), "tracks": [
    {"pointer": "/camera/eye", "keys": [{"frame": 0, "value": [0, -3, 2]}, {"time": 0.5, "value": [3, 0, 2]}]}]}
# Each frame takes a while: what is asked for meanwhile comes in between.
SLOW = {"frames": 3600, "scene": scene(side=128, objects=[SMALL_SHELL]), "tracks": MOVING["tracks"]}
# Hair is noise, which does not compress: a few pictures fit in a MiB.
LARGE = {"frames": 99, "scene": scene(side=320, objects=[SMALL_SHELL]), "tracks": MOVING["tracks"]}
BOUNDARY = re.compile(r"multipart/mixed; boundary=([-0-9a-z]+)")


def pelt(*arguments, document=None, code=0):
    run = subprocess.run([PELT, "render", *arguments], input=json.dumps(document).encode() if document else None,
                         capture_output=True, timeout=120)
    assert run.returncode == code, (arguments, run.returncode, run.stderr)
    return run.stdout.decode(), run.stderr.decode()


def read(path):
    with open(path, "rb") as file:
        return file.read()


def submit(daemon, document, query=""):
    reply = daemon.post(document, path="/v1/sequences" + query, accept="application/json")
    assert reply.status == 202, (reply.status, reply.body)
    assert reply.json()["kind"] == "sequence"
    return reply.headers["Location"]


def until(daemon, where, state):
    daemon.until(lambda: daemon.get(where).json()["state"] == state, f"the sequence is {state}")
    return daemon.get(where).json()


def until_frame(daemon, where, count):
    daemon.until(lambda: daemon.get(where).json()["progress"]["done"] >= count, f"{count} frames")


def parts_of(reply):
    """Names and bodies of a multipart body's parts, by its boundary and each part's length."""
    boundary = b"--" + BOUNDARY.fullmatch(reply.headers["Content-Type"])[1].encode()
    body, at, parts = reply.body, 0, {}
    while True:
        assert body[at:].startswith(boundary), body[at:at + 80]
        at += len(boundary)
        if body[at:] == b"--\r\n":
            return parts
        end = body.index(b"\r\n\r\n", at)
        head = dict(line.split(": ", 1) for line in body[at:end].decode().strip().split("\r\n"))
        assert head["Content-Type"] == "image/png", head
        name = re.fullmatch(r'attachment; filename="(.*)"', head["Content-Disposition"])[1]
        begin = end + 4
        at = begin + int(head["Content-Length"])
        parts[name] = body[begin:at]
        assert body[at:at + 2] == b"\r\n"
        at += 2


def children(daemon):
    with open(f"/proc/{daemon.process.pid}/task/{daemon.process.pid}/children") as file:
        return set(map(int, file.read().split()))


def test_the_command_line():
    with tempfile.TemporaryDirectory() as folder:
        def path(name):
            return os.path.join(folder, name)
        out, err = pelt("-", "--frames", "-o", path("f-%03d.png"), "--report", path("i.json"), "--verbose",
                        document=MOVING)
        assert "6 frames" in out and "meshes     renewed 1, kept 5 times" in out, out
        assert err.count("\n") == 6 and "[6/6] " in err, err
        frames = [read(path(f"f-{i:03}.png")) for i in range(6)]
        assert len(set(frames)) == 6
        index = json.loads(read(path("i.json")))
        assert [row["frame"] for row in index["frames"]] == list(range(6))
        assert (index["fps"], index["width"], index["height"]) == (10, 24, 24)
        assert index["frames"][5]["time_s"] == 0.5
        assert index["frames"][0]["reuse"]["meshes"] == {"kept": 0, "renewed": 1}
        # Only the eye moves: nothing is made again but the order.
        for row in index["frames"][1:]:
            assert not row["cold"]
            for part, count in row["reuse"].items():
                assert (count["renewed"] > 0) == (part == "orders"), (row["frame"], part, count)
        # A part of the range, in a process of its own: the same bytes.
        pelt("-", "--frames", "3-4", "-o", path("g%d.png"), document=MOVING)
        pelt("-", "--frames=5", "-o", path("h%d.exr"), document=MOVING)
        assert [read(path("g3.png")), read(path("g4.png"))] == frames[3:5]
        assert not os.path.exists(path("g2.png")) and os.path.getsize(path("h5.exr")) > 0
        # And a frame is its scene.
        still = {**MOVING["scene"], "camera": {"eye": [3, 0, 2]}}
        pelt("-", "-o", path("still.png"), document=still)
        assert read(path("still.png")) == frames[5]
        pelt("-", "--frames", "-o", path("a.gif"), document=MOVING)
        pelt("-", "--frames", "0-5", "-o", path("b"), "--format", "gif", document=MOVING)
        gif = read(path("a.gif"))
        assert gif == read(path("b")) and gif[:6] == b"GIF89a" and gif[6:10] == bytes([24, 0, 24, 0])
        # A graphic control extension for each frame: 10 hundredths of a second.
        assert gif.count(b"\x21\xf9\x04") == 6 and gif.count(b"\x21\xf9\x04\x05\x0a\x00") == 6


def test_wrong_use_of_the_command_line():
    for arguments, words in [
            (["--frames", "-o", "one.png"], "holds one %d"),
            (["--frames", "-o", "%d-%d.png"], "holds one %d"),
            (["--frames", "-o", "%s.png"], "holds one %d"),
            (["--frames", "-o", "%999999999999d.png"], "holds one %d"),
            (["--frames", "-o", "a%d.tif"], ".png, .exr and .gif"),
            (["--frames", "--out-dir", "x"], "and -o"),
            (["--frames", "-o", "%d.png", "--json"], "none of"),
            (["--frames", "4-9", "-o", "%d.png"], "frames 0 to 5"),
            (["--frames", "4-3", "-o", "%d.png"], "frames 0 to 5"),
            (["--frames=x", "-o", "%d.png"], "frames 0 to 5"),
            (["-o", "a.gif", "--format", "gif"], "made of --frames")]:
        _, err = pelt("-", *arguments, document=MOVING, code=2)
        assert words in err, (arguments, err)
        assert not os.path.exists("%d.png"), arguments
    # Told before anything is drawn.
    bad = {**MOVING, "tracks": [{"pointer": "/ambient", "keys": [{"frame": 0, "value": [1, 1, 1]},
                                                                 {"frame": 5, "value": [-1, 1, 1]}]}]}
    _, err = pelt("-", "--frames", "-o", "%d.png", document=bad, code=3)
    assert "/tracks/0: frame 3: must be at least 0" in err, err
    assert not os.path.exists("0.png")
    _, err = pelt("-", "--frames", "-o", "%d.png", document=MOVING["scene"], code=3)
    assert "`scene` is required" in err, err
    missing = {**MOVING, "scene": scene(side=8, objects=[{"mesh": {"asset": "none.glb"}}])}
    _, err = pelt("-", "--frames", "-o", "%d.png", document=missing, code=4)
    assert "/scene/objects/0/mesh/asset: frame 0: " in err, err


def test_a_job_and_its_results():
    with Daemon("--workers", "1") as daemon, tempfile.TemporaryDirectory() as folder:
        where = submit(daemon, MOVING, "?output=png,gif")
        job = until(daemon, where, "done")
        assert [row["name"] for row in job["results"]] == ["frames.multipart", "sequence.gif", "frames.json"]
        whole = daemon.get(where + "/result")
        parts = parts_of(whole)
        assert list(parts) == [f"frame-{i:04}.png" for i in range(6)]
        pelt("-", "--frames", "-o", os.path.join(folder, "frame-%04d.png"), document=MOVING)
        pelt("-", "--frames", "-o", os.path.join(folder, "all.gif"), document=MOVING)
        for name, data in parts.items():
            assert data == read(os.path.join(folder, name)), name
            alone = daemon.get(f"{where}/result/{name}")
            assert alone.headers["Content-Type"] == "image/png" and alone.body == data
        assert daemon.get(where + "/result/frames.multipart").body == whole.body
        assert daemon.get(where + "/result", Accept="image/gif").body == read(os.path.join(folder, "all.gif"))
        index = daemon.get(where + "/result", Accept="application/json").json()
        assert [row["name"] for row in index["frames"]] == list(parts)
        assert daemon.get(where + "/result", Accept="image/png").status == 406
        assert daemon.get(where + "/result/frame-0006.png").status == 404
        assert daemon.request("HEAD", where + "/result").status == 200
        # A part of the range; what is not asked for is not made.
        some = until(daemon, submit(daemon, MOVING, "?frames=4-"), "done")
        assert [row["name"] for row in some["results"]] == ["frames.multipart", "frames.json"]
        again = parts_of(daemon.get(f"/v1/jobs/{some['id']}/result"))
        assert again == {name: parts[name] for name in ("frame-0004.png", "frame-0005.png")}
        assert daemon.get(f"/v1/jobs/{some['id']}/result", Accept="image/gif").status == 406
        only = until(daemon, submit(daemon, MOVING, "?frames=0&output=gif"), "done")
        assert [row["name"] for row in only["results"]] == ["sequence.gif", "frames.json"]
        assert daemon.get(f"/v1/jobs/{only['id']}/result").headers["Content-Type"] == "image/gif"


def test_frames_are_there_as_they_are_made():
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, SLOW)
        assert daemon.get(where + "/result/frame-3599.png").status in (404, 409)
        until_frame(daemon, where, 1)
        early = daemon.get(where + "/result/frame-0000.png")
        assert early.status == 200 and early.body[:4] == b"\x89PNG"
        assert daemon.get(where + "/result/frame-3599.png").slug() == "not-done"
        assert daemon.get(where + "/result/frames.json").slug() == "not-done"
        assert daemon.get(where + "/result", Accept="application/json").slug() == "not-done"
        # Two follow it; one leaves.
        client = daemon.connect()
        client.sendall(f"GET {where}/result HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        other = daemon.connect()
        other.sendall(f"GET {where}/result/frames.multipart HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        got = b""
        while got.count(b"Content-Disposition") < 3:
            more = client.recv(65536)
            assert more, got[:300]
            got += more
        other.close()
        assert b"Transfer-Encoding: chunked" in got and early.body[:64] in got
        assert daemon.get(where).json()["state"] == "running"
        # Deleted: the stream is broken off, without the end of a chunked body.
        assert daemon.request("DELETE", where).status == 204
        while True:
            more = client.recv(65536)
            if not more:
                break
            got += more
        assert not got.endswith(b"0\r\n\r\n")
        client.close()
        assert daemon.get(where).json()["state"] == "cancelled"
        daemon.check_good()


def test_a_follower_gets_the_whole():
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, {**MOVING, "frames": 40})
        daemon.until(lambda: daemon.get(where + "/result").status != 409, "it begins")
        replies = []
        followers = [threading.Thread(target=lambda: replies.append(daemon.get(where + "/result")))
                     for _ in range(3)]
        for thread in followers:
            thread.start()
        for thread in followers:
            thread.join()
        until(daemon, where, "done")
        whole = daemon.get(where + "/result/frames.multipart").body
        assert len(replies) == 3 and all(reply.body == whole for reply in replies)
        assert len(parts_of(replies[0])) == 40


def test_a_crash_costs_the_job_alone():
    with Daemon("--workers", "1") as daemon:
        workers = children(daemon)
        where = submit(daemon, SLOW)
        until_frame(daemon, where, 1)
        process, = children(daemon) - workers
        os.kill(process, signal.SIGSEGV)
        job = until(daemon, where, "failed")
        assert job["error"]["type"] == "/problems/worker-crashed", job
        assert daemon.get(where + "/result").status == 404
        assert daemon.get(where + "/result/frame-0000.png").status == 404
        daemon.check_good()
        until(daemon, submit(daemon, MOVING), "done")


def test_too_much_is_refused():
    with Daemon("--workers", "1", "--jobs-keep-mib", "1") as daemon:
        where = submit(daemon, LARGE)
        job = until(daemon, where, "failed")
        assert job["error"]["type"] == "/problems/too-complex", job
        daemon.check_good()


def test_wrong_requests():
    bad = {**MOVING, "tracks": [{"pointer": "/camera/eyes", "keys": [{"frame": 0, "value": 1}]}]}
    late = {**MOVING, "tracks": [{"pointer": "/objects/0/shell/thickness", "keys": [
        {"frame": 2, "value": 0.1}, {"frame": 4, "value": -0.1}]}]}
    asset = {**MOVING, "scene": scene(side=8, objects=[{"mesh": {"asset": "none.glb"}}])}
    later = {**MOVING, "scene": scene(side=8, objects=[{**SHELL, "path": "gdm"}])}
    with Daemon("--workers", "1") as daemon:
        for status, document, query, pointer, words in [
                (400, MOVING, "?frames=6", None, "frames 0 to 5"),
                (400, MOVING, "?frames=", None, None),
                (400, MOVING, "?output=mp4", None, "output=png"),
                (400, MOVING, "?quality=3", None, "frames=A-B"),
                (400, "{", "", "", None),
                (422, MOVING["scene"], "", "/image", None),
                (422, bad, "", "/tracks/0/pointer", "is `eye` meant?"),
                (422, late, "", "/tracks/0", "frame 3: must be at least"),
                (422, asset, "", "/scene/objects/0/mesh/asset", None),
                (501, later, "", "/scene/objects/0/path", "frame 0: "),
                (422, {**MOVING, "frames": 5000}, "", "/frames", "at most 3600")]:
            reply = daemon.post(document, path="/v1/sequences" + query, accept="application/json")
            if status == 400 and query == "?frames=":
                assert reply.status == 202, reply.body  # all of them
                continue
            assert reply.status == status, (query, reply.status, reply.body)
            errors = reply.json()["errors"]
            if pointer is not None:
                assert pointer in [error.get("pointer") for error in errors], errors
            assert not words or words in reply.body.decode(), reply.body
        # A sequence is no scene.
        assert daemon.post(MOVING).status == 422
        kinds = [kind["name"] for kind in daemon.get("/v1/capabilities").json()["jobs"]["kinds"]]
        assert "sequence" in kinds


def test_it_ends_with_the_daemon():
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, SLOW)
        until_frame(daemon, where, 1)
        client = daemon.connect()
        client.sendall(f"GET {where}/result HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        assert client.recv(65536)
        daemon.process.terminate()
        assert daemon.process.wait(60) == 0
        while client.recv(65536):
            pass
        client.close()


main(globals())
