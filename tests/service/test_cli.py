#!/usr/bin/env python3
"""The command line: where pictures and reports go, what is refused and with which exit code."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

PELT = os.environ.get("PELT", "build/pelt")
LEAST = {"image": {"width": 24, "height": 16, "samples": 1}, "objects": [
    {"shell": {"mesh": {"shape": "plane", "divisions": [2, 2]},
               "material": {"builtin": "homogeneous", "extinction": 2}}}]}


def pelt(*arguments, stdin=b""):
    return subprocess.run([PELT, *arguments], input=stdin, capture_output=True, timeout=120)


class Cli(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def scene(self, name="scene.json", scene=None):
        with open(self.path(name), "w") as file:
            json.dump(LEAST if scene is None else scene, file)
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def refused(self, code, text, *arguments, stdin=b""):
        run = pelt(*arguments, stdin=stdin)
        self.assertEqual(run.returncode, code, run.stderr)
        self.assertIn(text, run.stderr.decode())
        self.assertEqual(run.stdout, b"")
        return run.stderr.decode()

    def drawn(self, *arguments, stdin=b""):
        run = pelt(*arguments, stdin=stdin)
        self.assertEqual(run.returncode, 0, run.stderr)
        return run

    # -- what comes out ---------------------------------------------------------------------

    def test_a_picture_a_report_and_a_table(self):
        # Between two stages the processor may be somebody else's: of a few runs one has none of that.
        for _ in range(5):
            run = self.drawn("render", self.scene(), "-o", self.path("a.png"),
                             "--report", self.path("r.json"))
            report = json.loads(self.read("r.json"))
            timing = report["timing_ms"]
            stages = sum(ms for name, ms in timing.items() if name != "total")
            apart = abs(stages - timing["total"])
            if apart <= max(2, 0.05 * timing["total"]):
                break
        self.assertLessEqual(apart, max(2, 0.05 * timing["total"]))
        self.assertIn("total", run.stdout.decode())
        self.assertTrue(self.read("a.png").startswith(b"\x89PNG\r\n\x1a\n"))
        self.assertEqual(self.read("a.png")[16:24], (24).to_bytes(4, "big") + (16).to_bytes(4, "big"))
        self.assertEqual(timing["queue"], 0)
        self.assertGreater(timing["parse"], 0)
        self.assertGreater(timing["encode"], 0)
        self.assertEqual(report["renderer"]["loaded"], [])

    def test_standard_input_and_output(self):
        self.drawn("render", self.scene(), "-o", self.path("a.png"))
        with open(self.path("scene.json"), "rb") as file:
            run = self.drawn("render", "-", "-o", "-", stdin=file.read())
        self.assertEqual(run.stdout, self.read("a.png"))
        self.assertIn("total", run.stderr.decode())

    def test_exr_by_extension_and_by_format(self):
        self.drawn("render", self.scene(), "-o", self.path("a.exr"), "--quiet")
        self.assertTrue(self.read("a.exr").startswith(b"\x76\x2f\x31\x01"))
        run = self.drawn("render", self.scene(), "-o", "-", "--format", "exr", "--quiet")
        self.assertEqual(run.stdout, self.read("a.exr"))
        self.assertEqual(run.stderr, b"")

    def test_json_on_the_standard_output(self):
        run = self.drawn("render", self.scene(), "-o", self.path("a.png"), "--json")
        self.assertEqual(json.loads(run.stdout)["resolved"]["image"]["width"], 24)

    def test_the_resolved_scene_gives_the_same_bytes(self):
        run = self.drawn("render", self.scene(), "-o", self.path("a.png"), "--json")
        self.scene("again.json", json.loads(run.stdout)["resolved"])
        self.drawn("render", self.path("again.json"), "-o", self.path("b.png"))
        self.assertEqual(self.read("a.png"), self.read("b.png"))

    def test_many_scenes_go_on_past_a_bad_one(self):
        bad = dict(LEAST, image={"width": 0})
        paths = [self.scene("a.json"), self.scene("b.json", bad), self.scene("c.json")]
        run = pelt("render", *paths, "--out-dir", self.path("out"), "--verbose")
        text = run.stderr.decode()
        self.assertEqual(run.returncode, 3)
        self.assertEqual(sorted(os.listdir(self.path("out"))), ["a.png", "c.png"])
        self.assertEqual(self.read("out/a.png"), self.read("out/c.png"))
        self.assertIn(f"pelt: {paths[1]}: /image/width: ", text)
        self.assertIn("[3/3]", text)
        self.assertIn("1 of 3 scenes failed", text)

    def test_plan_says_what_is_left_out(self):
        run = self.drawn("plan", self.scene())
        self.assertIn("left out", run.stdout.decode())
        run = self.drawn("plan", self.scene(), "--json")
        self.assertTrue(json.loads(run.stdout)["plan"]["left_out"])

    # -- what is refused --------------------------------------------------------------------

    def test_each_fault_is_a_line(self):
        scene = self.scene("bad.json", dict(LEAST, image={"width": 0, "height": -1}, colour=1))
        text = self.refused(3, "/image/width: ", "render", scene, "-o", self.path("a.png"))
        self.assertIn("/image/height: ", text)
        self.assertIn("/colour: ", text)
        self.assertEqual(len(text.splitlines()), 3)
        self.assertFalse(os.path.exists(self.path("a.png")))

    def test_what_is_no_json(self):
        self.refused(3, "not JSON", "render", "-", "-o", self.path("a.png"), stdin=b"")
        self.refused(3, "", "render", "-", "-o", self.path("a.png"), stdin=b"[" * 1000000)
        self.refused(3, "larger than", "render", "-", "-o", self.path("a.png"),
                     stdin=b" " * (2 << 20))

    def test_assets(self):
        def with_asset(name):
            return self.scene("s.json", {"objects": [{"mesh": {"asset": name}}]})
        out = ("-o", self.path("a.png"))
        self.refused(4, "none.glb", "render", with_asset("none.glb"), *out)
        self.refused(3, "asset", "render", with_asset("../none.glb"), *out)
        self.refused(3, "asset", "render", with_asset("/etc/passwd"), *out)
        with open(self.path("bad.glb"), "wb") as file:
            file.write(b"glTF\x02\0\0\0")
        self.refused(4, "/objects/0/mesh", "render", with_asset("bad.glb"), *out)
        self.refused(4, "bad.glb", "render", with_asset("bad.glb"), *out,
                     "--assets", self.path("elsewhere"))

    def test_wrong_usage(self):
        scene = self.scene()
        out = self.path("a.png")
        self.refused(2, "which command", *())
        self.refused(2, "no command", "draw")
        self.refused(2, "which scene", "render", "-o", out)
        self.refused(2, "pelt render: --fast is not an option", "render", scene, "--fast")
        self.refused(2, "pelt render: -o is not an option, or lacks", "render", scene, "-o")
        self.refused(2, "pelt validate: --fast", "validate", scene, "--fast")
        self.refused(2, "pelt plan: --assets", "plan", scene, "--assets")
        self.refused(2, "where to", "render", scene)
        self.refused(2, "where to", "render", scene, "-o", out, "--out-dir", self.path("d"))
        self.refused(2, "--format", "render", scene, "-o", self.path("a.gif"))
        self.refused(2, "tiff", "render", scene, "-o", out, "--format", "tiff")
        self.refused(2, "wgl", "render", scene, "-o", out, "--backend", "wgl")
        self.refused(2, "-1", "render", scene, "-o", out, "--device", "-1")
        self.refused(2, "single scene", "render", scene, scene, "-o", out)
        self.refused(2, "two scenes", "render", scene, scene, "--out-dir", self.path("d"))
        self.refused(2, "standard output", "render", scene, "-o", "-", "--json")
        self.refused(2, "No such file", "render", self.path("none.json"), "-o", out)
        self.assertFalse(os.path.exists(out))

    def test_what_cannot_be_written(self):
        self.refused(1, "/dev/full", "render", self.scene(), "-o", "/dev/full", "--format", "png",
                     "--quiet")

    def test_a_standard_output_that_is_full(self):
        with open("/dev/full", "w") as full:
            run = subprocess.run([PELT, "validate", self.scene()], stdout=full,
                                 stderr=subprocess.PIPE, timeout=60)
        self.assertEqual(run.returncode, 1)
        self.assertIn(b"standard output", run.stderr)

    def test_what_this_version_cannot_draw(self):
        scene = self.scene("s.json", {"objects": [{"skeleton": {"builtin": "elm"}}]})
        self.refused(5, "/objects/0/skeleton: ", "render", scene, "-o", self.path("a.png"))
        self.assertEqual(pelt("validate", scene).returncode, 0)
        self.assertEqual(pelt("validate", "--drawable", scene).returncode, 5)

    def test_hardware_that_is_not_there(self):
        run = pelt("render", self.scene(), "-o", self.path("a.png"), "--require-hardware")
        if run.returncode == 0:
            self.skipTest("this machine has a GPU")
        self.assertEqual(run.returncode, 6, run.stderr)

    def test_validate_opens_no_gl(self):
        run = pelt("validate", self.scene())
        self.assertEqual((run.returncode, run.stdout.decode()),
                         (0, f"{self.path('scene.json')}: valid\n"))

    def test_help(self):
        for command in ("render", "plan", "validate"):
            self.assertIn("usage:", self.drawn(command, "--help").stdout.decode())
        self.assertIn("invalid-scene", self.drawn("help", "exit-codes").stdout.decode())
        self.assertTrue(self.drawn("--version").stdout.startswith(b"pelt "))


if __name__ == "__main__":
    unittest.main(verbosity=2, argv=sys.argv[:1])
