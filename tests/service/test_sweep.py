#!/usr/bin/env python3
"""pelt sweep: a tiny one from beginning to end, its files against one another and against the schema,
and everything that is refused, with which exit code and which words."""

import csv
import json
import os
import re
import subprocess
import tempfile
import unittest

import jsonschema

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PELT = os.environ.get("PELT", "build/pelt")
TINY = {"image": {"width": 64, "height": 64, "samples": 1}, "objects": [
    {"shell": {"mesh": {"shape": "torus", "divisions": [12, 6]}, "thickness": 0.2,
               "material": {"builtin": "fur", "size": [16, 16, 16]}}}]}


def schema_validator():
    store = {}
    for name in ("scene", "report", "sweep"):
        with open(os.path.join(ROOT, "api", name + ".schema.json")) as file:
            schema = json.load(file)
        store[schema["$id"]] = schema
    return jsonschema.Draft202012Validator(
        schema, resolver=jsonschema.RefResolver(schema["$id"], schema, store=store))


class Sweep(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        cls.folder = cls.holder.name
        cls.scene = cls.write("<tiny> & 'co'.json", TINY)
        cls.out = os.path.join(cls.folder, "out")
        cls.run_ok = cls.pelt(cls.scene, "-o", cls.out, "--quality", "4,16", "--repeats", "2",
                              "--verbose", "--threads", "2")

    @classmethod
    def tearDownClass(cls):
        cls.holder.cleanup()

    @classmethod
    def write(cls, name, scene):
        path = os.path.join(cls.folder, name)
        with open(path, "w") as file:
            json.dump(scene, file)
        return path

    @classmethod
    def pelt(cls, *arguments, **keywords):
        return subprocess.run([PELT, "sweep", *arguments], capture_output=True, timeout=120,
                              **keywords)

    def read(self, name):
        with open(os.path.join(self.out, name), "rb") as file:
            return file.read()

    def refused(self, code, words, *arguments):
        run = self.pelt(*arguments)
        self.assertEqual(run.returncode, code, run.stderr)
        self.assertIn(words, run.stderr.decode())
        self.assertEqual(run.stdout, b"")

    def test_files(self):
        self.assertEqual(self.run_ok.returncode, 0, self.run_ok.stderr)
        expected = {"sweep.json", "sweep.csv", "sweep.html", "reference.png", "reference.exr"}
        for series in ("tetra-walk", "tetra-sorted"):
            for quality in (4, 16):
                for view in ("", "-difference", "-flip"):
                    expected.add(f"{series}-{quality}{view}.png")
        self.assertLessEqual(expected, set(os.listdir(self.out)))
        self.assertFalse([name for name in os.listdir(self.out) if "tmp" in name])
        for name in expected:
            if name.endswith(".png"):
                self.assertEqual(self.read(name)[:8], b"\x89PNG\r\n\x1a\n", name)

    def test_json(self):
        document = json.loads(self.read("sweep.json"))
        self.assertEqual([f"{list(e.absolute_path)}: {e.message}"
                          for e in schema_validator().iter_errors(document)], [])
        self.assertEqual(document["repeats"], 2)
        self.assertEqual(document["reference"]["pixels"], 64 * 64)
        self.assertTrue(document["reference"]["all"])
        self.assertEqual(document["scene"]["image"]["width"], 64)
        names = [series["name"] for series in document["series"]]
        self.assertEqual(names[:2], ["tetra-walk", "tetra-sorted"])
        fronts = 0
        for series in document["series"][:2]:
            coarse, fine = series["points"]
            self.assertLess(fine["error"]["rmse"], coarse["error"]["rmse"])
            self.assertLess(fine["discretisation"]["rmse"], coarse["discretisation"]["rmse"] / 4)
            self.assertEqual(series["limit_quality"], 64)
            self.assertGreater(series["order"]["value"], 1)
            for point in (coarse, fine):
                fronts += point["front"]
                times = point["time_ms"]
                self.assertLessEqual(times["total"]["p10"], times["total"]["p90"])
                self.assertLessEqual(times["stages"]["draw"], times["first"] + times["total"]["p90"])
        self.assertGreaterEqual(fronts, 1)

    def test_csv_says_what_json_says(self):
        document = json.loads(self.read("sweep.json"))
        text = self.read("sweep.csv").decode()
        rows = list(csv.DictReader(text.splitlines()))
        points = [(series, point) for series in document["series"] for point in series["points"]]
        self.assertEqual(len(rows), len(points))
        for row, (series, point) in zip(rows, points):
            self.assertEqual(row["series"], series["name"])
            self.assertEqual(int(row["quality"]), point["quality"])
            if point["refused"]:
                continue
            self.assertEqual(float(row["rmse"]), point["error"]["rmse"])
            self.assertEqual(float(row["total_ms"]), point["time_ms"]["total"]["median"])
            self.assertEqual(float(row["discretisation"]), point["discretisation"]["rmse"])
            self.assertEqual(row["front"] == "1", point["front"])

    def test_page(self):
        page = self.read("sweep.html").decode()
        self.assertIn("&#60;tiny&#62; &#38; &#39;co&#39;.json", page)
        self.assertNotRegex(page, r"https?:|<script|<link|@import|url\((?!#)|\{\{")
        self.assertEqual(set(re.findall(r'\bsrc="([^"]{0,21})', page)), {"data:image/png;base64"})
        self.assertGreaterEqual(page.count("<title>"), 1 + 8)

    def test_table_and_progress(self):
        table, progress = self.run_ok.stdout.decode(), self.run_ok.stderr.decode()
        self.assertIn(os.path.join(self.out, "sweep.html"), table)
        self.assertRegex(table, r"tetra-walk +16 +[\d.]+ +[\d.]+")
        self.assertRegex(table, r"tetra-sorted: order of convergence [\d.]+ \(2 points\), model")
        for stage in ("draw, first: 1 of ", "draw, timed", "reference, all pixels", "compare"):
            self.assertIn(stage, progress)

    def test_json_alone_and_quiet(self):
        arguments = (self.scene, "--quality", "2", "--repeats", "1", "--series", "tetra-walk",
                     "--pixels", "50")
        run = self.pelt(*arguments, "--json")
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        document = json.loads(run.stdout)
        self.assertEqual(document["reference"]["pixels"], 50)
        self.assertFalse(document["reference"]["all"])
        self.assertEqual(len(document["series"]), 1)
        self.assertIsNone(document["series"][0]["points"][0]["error"]["flip"])
        self.assertGreater(document["series"][0]["points"][0]["error"]["rmse_standard_error"], 0)
        out = os.path.join(self.folder, "quiet")
        run = self.pelt(*arguments, "--quiet", "-o", out)
        self.assertEqual((run.returncode, run.stdout, run.stderr), (0, b"", b""))
        self.assertEqual(set(os.listdir(out)),
                         {"sweep.json", "sweep.csv", "sweep.html", "tetra-walk-2.png"})

    def test_a_refused_series_is_listed(self):
        # Parallel rays from a plane that cuts the shell: each would begin its walk in another cell.
        path = self.write("cut.json", {**TINY, "camera": {
            "eye": [0, 0, 0], "target": [1, 0, 0], "ortho_height": 3}})
        run = self.pelt(path, "--quality", "2", "--repeats", "1", "--pixels", "50", "--json")
        self.assertEqual(run.returncode, 0, run.stderr)
        walk, sort = json.loads(run.stdout)["series"][:2]
        self.assertIn("/objects/0/quality/order: cannot walk", walk["refused"])
        self.assertEqual(walk["points"], [{"quality": 2, "refused": walk["refused"]}])
        self.assertIsNone(sort["refused"])
        self.refused(5, "/objects: tetra-walk at 2: /objects/0/quality/order: cannot walk", path,
                     "--quality", "2", "--series", "tetra-walk", "--json")

    def test_wrong_usage(self):
        to = ("-o", os.path.join(self.folder, "never"))
        self.refused(2, "which scene?", *to)
        self.refused(2, "one scene", self.scene, self.scene, *to)
        self.refused(2, "where to?", self.scene)
        self.refused(2, "one of --quiet and --json", self.scene, "--quiet", "--json")
        self.refused(2, "/series/1: no series is named nope; there are tetra-walk", self.scene, *to,
                     "--series", "tetra-walk,nope")
        self.refused(2, "/quality/0: 0 is not within 1 to 4096", self.scene, *to, "--quality", "0")
        self.refused(2, "/quality/2: 8 is not more than 8", self.scene, *to, "--quality", "4,8,8")
        self.refused(2, "10000 qualities: at most 32", self.scene, *to, "--quality",
                     ",".join(map(str, range(1, 10001))))
        for wrong in ("abc", "4,", ",4", "4,,8", "-4", "4.5", "0x10", " 4", "99999999999999999999", ""):
            self.refused(2, "is not a value of --quality", self.scene, *to, "--quality", wrong)
        for wrong in ("none", "0", "-1", "1e3"):
            self.refused(2, "is not a value of --pixels", self.scene, *to, "--pixels", wrong)
        self.refused(2, "is not a value of --repeats", self.scene, *to, "--repeats", "0")
        self.refused(2, "/repeats: 1001", self.scene, *to, "--repeats", "1001")
        self.refused(2, "/threads: 257", self.scene, *to, "--threads", "257")
        self.refused(2, "is not an option", self.scene, *to, "--frobnicate")
        self.refused(2, "is a file, not a folder", self.scene, "-o", self.scene)
        self.assertFalse(os.path.exists(to[1]))

    def test_wrong_scenes(self):
        to = ("-o", os.path.join(self.folder, "never"))
        mesh = self.write("mesh.json", {"objects": [{"mesh": {"shape": "sphere"}}]})
        self.refused(3, "/objects: nothing to sweep", mesh, *to)
        large = self.write("large.json", {**TINY, "image": {"width": 4096, "height": 4096,
                                                            "samples": 1}})
        self.refused(3, "/image: ", large, *to)
        self.refused(3, "/objects: ", self.write("bad.json", {"objects": []}), *to)
        self.refused(2, "missing.json", "missing.json", *to)
        later = self.write("later.json", {**TINY, "objects": TINY["objects"] + [
            {"skeleton": {"builtin": "elm"}}]})
        self.refused(5, "/objects/1/skeleton", later, *to)
        self.assertFalse(os.path.exists(to[1]))

    def test_folder_cannot_be_made(self):
        nowhere = os.path.join(self.folder, "no", "such", "place")
        self.refused(1, "cannot be made: No such file", self.scene, "-o", nowhere)
        self.refused(1, "cannot be made: No such file", self.scene, "-o", nowhere + "///")

    def test_help(self):
        run = self.pelt("--help")
        self.assertEqual(run.returncode, 0)
        self.assertIn(b"usage: pelt sweep", run.stdout)


if __name__ == "__main__":
    unittest.main()
