"""A real daemon on a free port, and a client that can misbehave. Standard library only.

Used by the tests beside it: `with Daemon("--workers", "1") as daemon: daemon.post(scene)`.
Waiting is always for something that can be seen (a metric, a line of the log), never for a time."""

import contextlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import zlib

PELT = os.environ.get("PELT", "build/pelt")
PATIENCE_S = 60  # for what comes in well under a second on an idle machine

SHELL = {"shell": {"mesh": {"shape": "sphere"}, "material": {"builtin": "fur"}}}


def scene(side=32, samples=1, **members):
    """A small picture that every daemon must be able to draw."""
    return {"image": {"width": side, "height": side, "samples": samples}, "objects": [SHELL],
            **members}


SMALL = scene()
LONG = scene(side=512, samples=1)       # a second of drawing, or so
# Many steps rather than many rays: these take no memory.
ENDLESS = scene(side=1024, samples=4, objects=[{**SHELL, "quality": {"samples": 4096}}])  # minutes


def sanitizer_options():
    """For sanitized builds: a signal sent by a test must end a worker as it would any other, and
    what libraries leak is passed over."""
    asan = os.environ.get("ASAN_OPTIONS", "")
    known = os.path.join(os.path.dirname(__file__), "..", "asan.supp")
    return {"ASAN_OPTIONS": asan + ":handle_segv=0:handle_abort=0",
            "LSAN_OPTIONS": os.environ.get("LSAN_OPTIONS",
                                           f"suppressions={known}:print_suppressions=0")}


class Reply:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)

    def slug(self):
        """What is wrong, by the problem document's type."""
        return self.json()["type"].rsplit("/", 1)[-1]


class Daemon:
    def __init__(self, *arguments, environment=None):
        self.folder = tempfile.mkdtemp(prefix="pelt-test-")
        self.log_path = os.path.join(self.folder, "log")
        self.log_file = open(self.log_path, "w")
        self.process = subprocess.Popen(
            [PELT, "serve", "--listen", "127.0.0.1:0", *arguments],
            stdout=subprocess.PIPE, stderr=self.log_file, stdin=subprocess.DEVNULL,
            env={**os.environ, **sanitizer_options(), **(environment or {})})
        line = self.process.stdout.readline().decode()
        found = re.fullmatch(r"pelt: listening on http://(127\.0\.0\.1):(\d+)\n", line)
        if not found:
            self.process.wait(PATIENCE_S)
            raise AssertionError(f"the daemon says {line!r}; its log:\n{self.log()}")
        self.host, self.port = found[1], int(found[2])

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
                raise AssertionError("the daemon does not end on SIGTERM:\n" + self.log())
            ended = self.process.returncode
        else:
            ended = 0  # the test has looked at it itself
        self.process.stdout.close()
        self.log_file.close()
        log = self.log()
        shutil.rmtree(self.folder, ignore_errors=True)
        told = re.search(r"(Address|Thread)Sanitizer: .*|.*runtime error: .*", log)
        if kind or told or ended:
            print("--- the daemon's log\n" + log)
        if not kind:
            assert not told, told[0]
            assert ended == 0, f"the daemon ended with {ended}"

    def log(self):
        with open(self.log_path) as file:
            return file.read()

    # --- requests ---

    def request(self, method, path, body=None, headers=None, timeout=PATIENCE_S):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        with contextlib.closing(connection):
            connection.request(method, path, body, headers or {})
            reply = connection.getresponse()
            return Reply(reply.status, reply.headers, reply.read())

    def get(self, path, **headers):
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        return self.request("GET", path, headers=named)

    def post(self, document, path="/v1/render", accept="image/png", **more):
        body = document if isinstance(document, (bytes, str)) else json.dumps(document)
        headers = {"Content-Type": "application/json", "Accept": accept, **more}
        return self.request("POST", path, body, headers)

    def post_parts(self, parts, path="/v1/render", accept="image/png"):
        kind, body = multipart(parts)
        return self.request("POST", path, body, {"Content-Type": kind, "Accept": accept})

    def connect(self):
        return socket.create_connection((self.host, self.port), timeout=PATIENCE_S)

    def send(self, document, path="/v1/render"):
        """Sends a scene and leaves the reply for later: a socket."""
        body = (document if isinstance(document, str) else json.dumps(document)).encode()
        client = self.connect()
        client.sendall(f"POST {path} HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                       f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
        return client

    def check_good(self):
        """The next good request succeeds."""
        reply = self.post(SMALL)
        assert reply.status == 200, (reply.status, reply.body)
        assert reply.body.startswith(b"\x89PNG\r\n\x1a\n"), reply.body[:40]

    # --- looking inside ---

    def metrics(self):
        rows = {}
        for line in self.get("/metrics").body.decode().splitlines():
            if not line.startswith("#"):
                name, value = line.rsplit(" ", 1)
                rows[name] = float(value)
        return rows

    def metric(self, name):
        return self.metrics().get(name, 0)

    def until(self, what, description):
        """Waits until what() is true."""
        deadline = time.monotonic() + PATIENCE_S
        while not what():
            assert time.monotonic() < deadline, f"never came: {description}\n{self.log()}"
            time.sleep(0.02)

    def until_busy(self, count=1):
        self.until(lambda: self.metric('pelt_workers{state="busy"}') == count,
                   f"{count} workers are busy")

    def until_idle(self, count):
        self.until(lambda: self.metric('pelt_workers{state="idle"}') == count,
                   f"{count} workers are idle")

    def worker_pids(self):
        pid = self.process.pid
        with open(f"/proc/{pid}/task/{pid}/children") as file:
            return [int(word) for word in file.read().split()]


def read_reply(client):
    reply = http.client.HTTPResponse(client)
    reply.begin()
    return Reply(reply.status, reply.headers, reply.read())


def read_all(client):
    """Everything until the other side closes; a reset counts as closing."""
    data = b""
    with contextlib.suppress(ConnectionError):
        while piece := client.recv(65536):
            data += piece
    return data


def multipart(parts, boundary="frontier"):
    body = b""
    for name, data in parts:
        if not isinstance(data, bytes):
            data = json.dumps(data).encode()
        body += (f"--{boundary}\r\nContent-Disposition: form-data; name=\"{name}\"\r\n"
                 f"Content-Type: application/octet-stream\r\n\r\n").encode() + data + b"\r\n"
    return f"multipart/form-data; boundary={boundary}", body + f"--{boundary}--\r\n".encode()


# --- assets ---

def glb(positions, indices=None, index_count=None, cut=0):
    """The least .glb: one mesh of triangles. `cut`: bytes left out at its end."""
    blob = b"".join(struct.pack("<3f", *position) for position in positions)
    accessors = [{"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
                  "min": [-1, -1, -1], "max": [1, 1, 1]}]
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": len(blob)}]
    primitive = {"attributes": {"POSITION": 0}}
    if indices is not None:
        data = struct.pack(f"<{len(indices)}I", *indices)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        accessors.append({"bufferView": 1, "componentType": 5125, "type": "SCALAR",
                          "count": len(indices) if index_count is None else index_count})
        primitive["indices"] = 1
        blob += data
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                       "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
                       "accessors": accessors, "bufferViews": views,
                       "buffers": [{"byteLength": len(blob)}]}).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    whole = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(blob))
    whole += struct.pack("<I4s", len(text), b"JSON") + text
    whole += struct.pack("<I4s", len(blob), b"BIN\0") + blob
    return whole[:len(whole) - cut]


TETRAHEDRON = [(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)]
TETRAHEDRON_FACES = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


def png(width, height, claim=None):
    """A grey PNG; `claim`: the size that its head tells instead."""
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    said = claim or (width, height)
    rows = b"".join(b"\0" + bytes((x * 7 + y * 13) % 256 for x in range(width))
                    for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", *said, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def main(tests):
    """Runs every function of the dictionary whose name begins with test_."""
    failed = 0
    for name, test in list(tests.items()):
        if not name.startswith("test_"):
            continue
        start = time.monotonic()
        try:
            test()
            print(f"ok {name} {time.monotonic() - start:.2f} s", flush=True)
        except Exception:
            failed += 1
            print(f"FAILED {name}", flush=True)
            traceback.print_exc(file=sys.stdout)
    sys.exit(1 if failed else 0)
