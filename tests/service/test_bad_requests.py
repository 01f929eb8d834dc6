#!/usr/bin/python3
"""Bad input over HTTP: each gets its answer, and the next good request succeeds."""

import json
import socket

from harness import (SHELL, SMALL, TETRAHEDRON, TETRAHEDRON_FACES, Daemon, glb, main, multipart,
                     png, read_all, read_reply, scene)


def expect(daemon, reply, status, slug, pointer=None):
    assert (reply.status, reply.slug()) == (status, slug), (reply.status, reply.body)
    if pointer is not None:
        told = [row.get("pointer") for row in reply.json()["errors"]]
        assert pointer in told, (pointer, reply.body)
    daemon.check_good()


def test_bodies_that_are_no_scene():
    with Daemon("--workers", "1") as daemon:
        expect(daemon, daemon.post(b""), 400, "bad-json")
        for text in ["nonsense", "{", "[1, 2", '{"image": NaN}', "\xff\xfe".encode("latin1"),
                     '{"objects": []}{}', "null\0"]:
            expect(daemon, daemon.post(text), 400, "bad-json")
        expect(daemon, daemon.post(b"[" * 10_000_000), 413, "scene-too-large")
        expect(daemon, daemon.post(b"[" * 1_000_000), 422, "invalid-scene", "/0" * 32)
        expect(daemon, daemon.post(json.dumps(SMALL) + " " * (1 << 20)), 413, "scene-too-large")
        # More than a body may have is told without reading it.
        reply = daemon.request("POST", "/v1/render", None,
                               {"Content-Type": "application/json", "Content-Length": "99999999999",
                                "Expect": "100-continue"})
        expect(daemon, reply, 413, "scene-too-large")


def test_scenes_that_break_the_contract():
    with Daemon("--workers", "1") as daemon:
        def refused(document, pointer, status=422, slug="invalid-scene"):
            expect(daemon, daemon.post(document), status, slug, pointer)
        deep = scene()
        deep["objects"] = [{"shell": {**SHELL["shell"], "mesh": {"shape": "sphere", "raduis": 1}}}]
        refused(deep, "/objects/0/shell/mesh/raduis")
        refused(scene(image={"width": 0, "height": 0}), "/image/width")
        refused(scene(image={"width": 0, "height": 0}), "/image/height")
        refused(scene(image={"width": 100000, "height": 1}), "/image/width")
        refused(scene(camera={"eye": [1, 1, 1], "target": [1, 1, 1]}), "/camera/target")
        refused(scene(camera={"eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 0, 1]}),
                "/camera/up")
        outside = {"shell": {**SHELL["shell"], "mesh": {"asset": "../x.glb"}}}
        refused(scene(objects=[outside]), "/objects/0/shell/mesh/asset")
        gdm = {**scene(), "objects": [{**SHELL, "path": "gdm"}]}
        refused(gdm, "/objects/0/path", 501, "not-implemented")
        two = {**scene(), "objects": [{**SHELL, "path": "tetra"}, {**SHELL, "path": "slicing"}]}
        refused(two, "/objects/1/path", 501, "not-implemented")


def mesh_scene(name):
    return scene(objects=[{"shell": {"mesh": {"asset": name},
                                     "material": {"builtin": "homogeneous"}}}])


def test_meshes_that_cannot_be():
    nan = float("nan")
    cases = {
        "cut short": glb(TETRAHEDRON, TETRAHEDRON_FACES, cut=40),
        "cut in its head": glb(TETRAHEDRON, TETRAHEDRON_FACES)[:10],
        "index out of range": glb(TETRAHEDRON, [0, 1, 2, 1, 2, 4000000000]),
        "more indices than there are": glb(TETRAHEDRON, [0, 1, 2], index_count=30000000),
        "NaN in a position": glb([(nan, 0, 0)] + TETRAHEDRON[1:], TETRAHEDRON_FACES),
        "infinity in a position": glb([(float("inf"), 0, 0)] + TETRAHEDRON[1:], TETRAHEDRON_FACES),
        "no triangles": glb(TETRAHEDRON, []),
        "empty": b"",
        "not glTF": b"solid cube\n" * 100,
    }
    with Daemon("--workers", "1") as daemon:
        whole = glb(TETRAHEDRON, TETRAHEDRON_FACES)
        reply = daemon.post_parts([("scene", mesh_scene("a.glb")), ("a.glb", whole)])
        assert reply.status == 200, reply.body
        for what, data in cases.items():
            reply = daemon.post_parts([("scene", mesh_scene("a.glb")), ("a.glb", data)])
            assert reply.status == 422, (what, reply.status, reply.body)
            expect(daemon, reply, 422, "bad-asset", "/objects/0/shell/mesh/asset")
        assert daemon.metric('pelt_worker_restarts_total{reason="crash"}') == 0


def test_images_that_lie():
    relief = scene(objects=[{"shell": {"mesh": {"shape": "plane"},
                                       "material": {"height": "h.png", "size": [8, 8, 8]}}}])
    with Daemon("--workers", "1") as daemon:
        reply = daemon.post_parts([("scene", relief), ("h.png", png(8, 8))])
        assert reply.status == 200, reply.body
        for what, data in {
                "larger than it is": png(8, 8, claim=(4096, 4096)),
                "larger than anything": png(8, 8, claim=(2**31 - 1, 2**31 - 1)),
                "of no size": png(8, 8, claim=(0, 8)),
                "no image": b"GIF87a, or so it says"}.items():
            reply = daemon.post_parts([("scene", relief), ("h.png", data)])
            assert reply.status == 422, (what, reply.status, reply.body)
            expect(daemon, reply, 422, "bad-asset", "/objects/0/shell/material/height")
        assert daemon.metric('pelt_worker_restarts_total{reason="crash"}') == 0


def test_multipart_that_is_malformed():
    with Daemon("--workers", "1") as daemon:
        kind, body = multipart([("scene", SMALL), ("a.bin", b"unused")])
        assert daemon.request("POST", "/v1/render", body, {"Content-Type": kind}).status == 200

        def refused(kind, body):
            reply = daemon.request("POST", "/v1/render", body, {"Content-Type": kind})
            expect(daemon, reply, 400, "bad-request")
        refused(kind, body[:-10])
        refused(kind, b"")
        refused("multipart/form-data", body)
        refused("multipart/form-data; boundary=" + "x" * 71, body)
        refused(kind, body.replace(b"name=", b"nome="))
        refused(kind, body.replace(b'name="scene"', b'name="scene'))
        refused(kind, body.replace(b"Content-Disposition", b"X" * 3000))
        refused(*multipart([("a.glb", b"no scene")]))
        refused(*multipart([("scene", SMALL), ("scene", SMALL)]))
        refused(*multipart([("scene", SMALL), ("a", b"1"), ("a", b"2")]))
        refused(*multipart([("scene", SMALL)] + [(f"a{i}", b"") for i in range(65)]))
        kind, body = multipart([("scene", b" " * ((1 << 20) + 1))])
        reply = daemon.request("POST", "/v1/render", body, {"Content-Type": kind})
        expect(daemon, reply, 413, "scene-too-large")


def test_chunked_bodies():
    with Daemon("--workers", "1", "--body-mib", "1") as daemon:
        def chunks(count, size=65536):
            for _ in range(count):
                yield b" " * size
            yield json.dumps(SMALL).encode()
        reply = daemon.request("POST", "/v1/render", chunks(2),
                               {"Content-Type": "application/json"})
        assert reply.status == 200, reply.body
        client = daemon.connect()
        client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                       b"Transfer-Encoding: chunked\r\n\r\n")
        try:
            for _ in range(64):
                client.sendall(b"10000\r\n" + b" " * 65536 + b"\r\n")
        except ConnectionError:
            pass
        daemon.until(lambda: "status=413" in daemon.log(), "it is cut off")
        client.close()
        daemon.check_good()


def test_framing_that_smuggles():
    body = json.dumps(SMALL).encode()
    length = f"Content-Length: {len(body)}\r\n".encode()
    with Daemon("--workers", "1") as daemon:
        for headers in [length + b"Transfer-Encoding: chunked\r\n", length + length,
                        length + b"Content-Length: 5\r\n",
                        b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
                        b"Transfer-Encoding: gzip, chunked\r\n"]:
            client = daemon.connect()
            client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: x\r\n"
                           b"Content-Type: application/json\r\n" + headers + b"\r\n" + body)
            answer = read_all(client)  # which ends: the connection is closed
            assert answer.startswith(b"HTTP/1.1 400 "), (headers, answer)
            client.close()
            daemon.check_good()


def test_lengths_that_lie():
    body = json.dumps(SMALL).encode()
    head = (b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
            b"Content-Length: %d\r\n\r\n")
    with Daemon("--workers", "1", "--receive-timeout-ms", "500") as daemon:
        longer = daemon.connect()  # announces more than it sends, and waits
        longer.sendall(head.replace(b"Host", b"X-Request-Id: slow\r\nHost") % (len(body) + 1) +
                       body)
        answer = read_reply(longer)
        expect(daemon, answer, 408, "request-timeout")
        assert answer.headers["X-Request-Id"] == answer.json()["request_id"] == "slow"
        assert answer.headers["Server-Timing"].startswith("total;dur=")
        assert daemon.metric('pelt_requests_total{resource="render",status="408"}') == 1
        assert longer.recv(1) == b""
        shorter = daemon.connect()  # the rest is taken for another request, and refused
        shorter.sendall(head % (len(body) - 1) + body)
        expect(daemon, read_reply(shorter), 400, "bad-json")
        gone = daemon.connect()  # leaves in mid-body
        gone.sendall(head % (len(body) * 2) + body)
        gone.close()
        daemon.check_good()


def test_one_byte_at_a_time():
    """The deadline is absolute: bytes that keep coming do not prolong it."""
    body = json.dumps(SMALL).encode()
    whole = (b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
             b"Content-Length: %d\r\n\r\n" % len(body) + body)
    with Daemon("--workers", "1", "--receive-timeout-ms", "700") as daemon:
        for start in [1, whole.index(b"Host"), whole.index(b"{") + 1]:
            client = daemon.connect()
            client.sendall(whole[:start])
            answered = False
            for byte in whole[start:]:
                try:
                    client.sendall(bytes([byte]))
                except ConnectionError:
                    answered = True
                    break
                client.settimeout(0.1)
                try:
                    client.recv(1, socket.MSG_PEEK)
                    answered = True
                    break
                except TimeoutError:
                    pass
            assert answered, "every byte was taken, one every tenth of a second"
            answer = read_all(client)
            assert answer.startswith(b"HTTP/1.1 408 ") or not answer, answer
            daemon.check_good()
        assert daemon.metric("pelt_client_timeouts_total") == 3


def test_clients_that_say_nothing():
    with Daemon("--workers", "1", "--receive-timeout-ms", "300") as daemon:
        silent = [daemon.connect() for _ in range(20)]
        for client in silent:
            assert read_all(client).startswith(b"HTTP/1.1 408 ")
        kept = daemon.connect()  # idle after a request: closed without a word
        kept.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n")
        assert read_all(kept).endswith(b"alive\n")
        daemon.until(lambda: daemon.metric("pelt_connections") == 1, "only this one is left")
        daemon.check_good()


main(globals())
