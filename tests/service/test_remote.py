#!/usr/bin/env python3
"""`pelt render --server`: a daemon's problem document becomes the same faults and the same exit code
as drawing here; a server that answers nonsense, or not at all, is told so."""

import http.server
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import unittest

PELT = os.environ.get("PELT", "build/pelt")
PLANE = {"image": {"width": 8, "height": 8}, "objects": [{"shell": {
    "mesh": {"shape": "plane", "divisions": [1, 1]}, "material": {"builtin": "homogeneous"}}}]}
BROKEN = {"objects": [{"shell": {"mesh": {"asset": "bad.glb"}, "material": {"builtin": "fur"}}}]}


class Nonsense(http.server.BaseHTTPRequestHandler):
    answers = {}

    def do_POST(self):
        self.rfile.read(int(self.headers["Content-Length"]))
        status, kind, body = self.answers[self.path.split("/")[1]]
        if status is None:
            return
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class Remote(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        for name, scene in (("plane", PLANE), ("broken", BROKEN)):
            with open(cls.path(name + ".json"), "w") as file:
                json.dump(scene, file)
        with open(cls.path("bad.glb"), "wb") as file:
            file.write(b"glTF\x02\0\0\0\xff\xff\0\0")
        cls.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Nonsense)
        cls.thread = threading.Thread(target=cls.server.serve_forever)
        cls.thread.start()

    @classmethod
    def tearDownClass(cls):
        cls.server.shutdown()
        cls.thread.join()
        cls.server.server_close()
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    def render(self, scene, *options):
        environment = dict(os.environ, no_proxy="*")
        return subprocess.run([PELT, "render", self.path(scene), "-o", self.path("out.png"),
                               *options], capture_output=True, text=True, timeout=120,
                              env=environment)

    def nonsense(self, status, kind, body, *options):
        Nonsense.answers["a"] = (status, kind, body)
        run = self.render("plane.json", "--server",
                          f"http://127.0.0.1:{self.server.server_port}/a", *options)
        self.assertNotEqual(run.returncode, 0)
        self.assertFalse(os.path.exists(self.path("out.png")))
        return run

    def test_a_problem_reads_as_it_does_here(self):
        here = self.render("broken.json")
        self.assertEqual(here.returncode, 4)
        there = self.through_a_daemon("broken.json")
        self.assertEqual((there.returncode, there.stderr), (here.returncode, here.stderr))
        self.assertIn("/objects/0/shell/mesh/asset: ", there.stderr)

    def test_assets_of_any_name_arrive(self):
        for name in ('a"b c.glb', "\u00e9%22;x.glb", "sub/d.glb"):
            os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
            with open(self.path("bad.glb"), "rb") as source, open(self.path(name), "wb") as file:
                file.write(source.read())
            with open(self.path("named.json"), "w") as file:
                json.dump({"objects": [{"mesh": {"asset": name}}]}, file)
            run = self.through_a_daemon("named.json")
            self.assertEqual(run.returncode, 4)
            self.assertIn("cut short", run.stderr)

    def through_a_daemon(self, scene):
        with subprocess.Popen([PELT, "serve", "--listen", "127.0.0.1:0", "--workers", "1"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              text=True) as daemon:
            url = re.search(r"http://\S+", daemon.stdout.readline()).group(0)
            run = self.render(scene, "--server", url + "/")
            daemon.terminate()
        return run

    def test_a_problem_keeps_its_status(self):
        problem = {"type": "/problems/queue-full", "status": 503, "detail": "come back later",
                   "errors": []}
        run = self.nonsense(503, "application/problem+json", json.dumps(problem).encode())
        self.assertEqual(run.returncode, 8)
        self.assertIn("come back later", run.stderr)

    def test_an_error_without_a_problem(self):
        for body in (b"", b"<html>no</html>", b"[]", b"{}", b'{"type": 1}'):
            run = self.nonsense(502, "text/html", body)
            self.assertEqual(run.returncode, 8)
            self.assertIn("502", run.stderr)

    def test_a_success_that_is_none(self):
        self.assertEqual(self.nonsense(200, "text/html", b"welcome").returncode, 8)
        for body in (b"", b"{}", b'{"report": {}}', b'{"report": {}, "image": {"data": 1}}',
                     b'{"report": {}, "image": {"data": "%%%"}}'):
            run = self.nonsense(200, "application/json", body, "--json")
            self.assertEqual(run.returncode, 8, run.stderr)

    def test_no_answer(self):
        self.assertEqual(self.nonsense(None, "", b"").returncode, 8)
        run = self.render("plane.json", "--server", "http://127.0.0.1:1")
        self.assertEqual(run.returncode, 8)
        run = self.render("plane.json", "--server", "ftp://127.0.0.1")
        self.assertEqual(run.returncode, 8)

    def test_a_library_that_is_not_there(self):
        run = subprocess.run([PELT, "render", self.path("plane.json"), "-o", self.path("out.png"),
                              "--server", "http://127.0.0.1:1"], capture_output=True, text=True,
                             env=dict(os.environ, PELT_LIBDIR="/nowhere"), timeout=60)
        self.assertEqual(run.returncode, 1)
        self.assertIn("libcurl3-gnutls", run.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2, argv=sys.argv[:1])
