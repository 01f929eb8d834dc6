#!/usr/bin/env python3
"""The page of a sweep in a browser: it fits phones, asks for nothing, complains of nothing, shows its
pictures, and no label of a chart is cut off."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from browser import Browser, find  # noqa: E402

PELT = os.environ.get("PELT", "build/pelt")
SCENE = {"image": {"width": 48, "height": 32, "samples": 1}, "objects": [
    {"shell": {"mesh": {"shape": "torus", "divisions": [12, 6]}, "thickness": 0.2,
               "material": {"builtin": "fur", "size": [16, 16, 16]}}}]}
# Texts of charts and scales that stick out of their picture, or lie on one another.
OUTSIDE = """[...document.querySelectorAll('svg.chart text, svg.scale text')].filter(text => {
  const a = text.getBoundingClientRect(), b = text.closest('svg').getBoundingClientRect();
  return a.left < b.left - 0.5 || a.right > b.right + 0.5 || a.top < b.top - 0.5 ||
         a.bottom > b.bottom + 0.5;
}).map(text => text.textContent)"""
OVERLAPPING = """[...document.querySelectorAll('svg.chart, svg.scale')].flatMap(svg => {
  const boxes = [...svg.querySelectorAll('text')].map(text => [text.textContent,
                                                               text.getBoundingClientRect()]);
  return boxes.flatMap(([s, a], i) => boxes.slice(i + 1).filter(([t, b]) =>
    a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3)
    .map(([t]) => s + ' on ' + t));
})"""


class SweepPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        scene = os.path.join(cls.holder.name, "a-scene-with-a-rather-long-name-for-a-phone.json")
        with open(scene, "w") as file:
            json.dump(SCENE, file)
        cls.pages = {}
        for name, pixels in (("all", "all"), ("sample", "200")):
            out = os.path.join(cls.holder.name, name)
            subprocess.run([PELT, "sweep", scene, "-o", out, "--quality", "2,4,8,16,32,64",
                            "--repeats", "1", "--pixels", pixels, "--quiet"], check=True, timeout=120)
            cls.pages[name] = os.path.join(out, "sweep.html")
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.__exit__()
        cls.holder.cleanup()

    def test_every_width(self):
        for name, path in self.pages.items():
            for width in (320, 360, 800, 1400):
                with self.subTest(page=name, width=width):
                    page = self.browser.open(path, width)
                    self.assertLessEqual(page.evaluate("document.documentElement.scrollWidth"), width)
                    self.assertEqual(page.complaints(), [])
                    self.assertEqual([url for url in page.requests()
                                      if not url.startswith(("file:", "data:"))], [])
                    self.assertEqual(page.evaluate(
                        "[...document.images].filter(i => !i.complete || !i.naturalWidth).length"), 0)
                    with open(os.path.join(os.path.dirname(path), "sweep.json")) as file:
                        drawn = sum(not point["refused"] for series in json.load(file)["series"]
                                    for point in series["points"])
                    self.assertGreaterEqual(drawn, 12)
                    self.assertEqual(page.evaluate("document.images.length"),
                                     drawn if name == "sample" else 1 + 3 * drawn)
                    self.assertEqual(page.evaluate(OUTSIDE), [])
                    self.assertEqual(page.evaluate(OVERLAPPING), [])
                    self.assertGreaterEqual(
                        page.evaluate("document.querySelectorAll('svg.chart g > title').length"), 24)
                    # Text is large enough to be read: 9 px at the least.
                    self.assertGreaterEqual(page.evaluate(
                        "Math.min(...[...document.querySelectorAll('svg.chart text')].map(t =>"
                        " parseFloat(getComputedStyle(t).fontSize) * t.getScreenCTM().a))"), 9)


if __name__ == "__main__":
    find()
    unittest.main()
