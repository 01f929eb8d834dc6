#!/usr/bin/env python3
"""Table 1 of Dufort, Leblanc & Poulin 2005, and their Earth, beside what this machine does.
bench.py --only dufort calls it; dufort.py RESULTS.json (of bench.py --json) prints the table in Markdown."""

import json
import os
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "scenes")
MAKER = os.path.join(HERE, "..", "tools", "make_dufort.py")

# Triangles (12 for each of the mesh), texture, samples, frames a second at 512 x 512: NVIDIA 6800 GT of
# 256 MB, Athlon64 3500+. The Earth is in Figure 1 alone.
PAPER = {
    "dufort-teapot-bust": ("Teapot (Beethoven)", 25704, "128 x 128 x 32", 10, 4),
    "dufort-teapot-weave": ("Teapot (weave)", 25704, "64 x 64 x 32", 20, 5),
    "dufort-vase-trees": ("Vase (trees)", 103680, "128 x 128 x 32", 10, 2),
    "dufort-vase-dragons": ("Vase (dragons)", 103680, "128 x 128 x 32", 10, 2),
    "dufort-plane-trees": ("Plane (trees)", 384, "128 x 128 x 32", 15, 16),
    "dufort-tube-rocks": ("Tube (rocks)", 1440, "512 x 512 x 32", 10, 30),
    "dufort-earth": ("Earth with clouds", None, None, None, None)}
PEEL_SIDE = 256  # a picture is drawn a hundred times and more
PACKAGE = "three-globe"
EARTH = {"earth-height.png": "example/img/earth-topology.png",
         "earth-color.jpg": "example/img/earth-blue-marble.jpg"}


def lay_earth(package, folder):
    """The Earth's scene with its pictures beside it, in a folder of its own."""
    for name, source in EARTH.items():
        shutil.copy(os.path.join(package, source), os.path.join(folder, name))
    subprocess.run(["/usr/bin/python3", MAKER, "--clouds", os.path.join(package, "example/clouds/clouds.png"),
                    os.path.join(folder, "earth-clouds.png"), "512", "16"], check=True)
    shutil.copy(os.path.join(SCENES, "fetched", "dufort-earth.json"), folder)


def measure(build, repeats):
    """One dictionary for each scene and way; of a scene that cannot be drawn, its name and `skipped`."""
    environment = dict(os.environ, PELT_LIBDIR=os.path.abspath(os.path.join(build, "lib/pelt")))
    program = os.path.abspath(os.path.join(build, "tests/bench/bench_dufort"))

    def run(folder, scenes):
        done = subprocess.run([program, str(repeats), *(name + ".json" for name in scenes)], cwd=folder,
                              env=environment, check=True, stdout=subprocess.PIPE, text=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    results = run(SCENES, [name for name in PAPER if name != "dufort-earth"])
    package = os.path.join(build, "npm", PACKAGE)
    if not os.path.exists(package):
        return results + [{"scene": "dufort-earth.json", "skipped": f"{PACKAGE} is not there: "
                           f"deploy/dependencies/fetch.sh bench {build}/npm"}]
    with tempfile.TemporaryDirectory() as folder:
        lay_earth(package, folder)
        return results + run(folder, ["dufort-earth"])


def rows(build, repeats, spread, text):
    """For bench.py: `spread` and `text` are its own."""
    table = []
    for r in measure(build, repeats):
        name = PAPER[r["scene"][:-5]][0]
        if "skipped" in r:
            table.append({**r, "figure": name, "value": "skipped", "note": r["skipped"]})
            continue
        _, _, _, samples, fps = PAPER[r["scene"][:-5]]
        beside = f"paper {fps} fps, {1000 / fps:.0f} ms (6800 GT); " if fps else ""
        parts = ", ".join(f"{what[:-3]} {spread(r[what])['median']:.0f}"
                          for what in ("sort_ms", "shadow_ms", "draw_ms") if max(r[what]) >= 0.5)
        table.append({**r, "figure": f"{name}, {r['way']}, {r['samples']} samples", "measured": spread(r["ms"]),
                      "processor": spread(r["processor_ms"]), "unit": "ms", "digits": 0,
                      "paper_ms": 1000 / fps if fps else None, "paper_samples": samples,
                      "note": f"{parts}; processor {text(spread(r['processor_ms']), digits=0)}; "
                              f"RMSE {r['rmse']:.2g}; {beside}"
                              f"{12 * r['prisms']} triangles, {r['fragments'] / 1e6:.2f} M fragments"})
    return table


def peel_rows(build, repeats, spread, text):
    """Depth peeling, which the paper gave up for its sort: 20 s against 0.5 s a picture of the vase."""
    environment = dict(os.environ, PELT_LIBDIR=os.path.abspath(os.path.join(build, "lib/pelt")))
    program = os.path.abspath(os.path.join(build, "tests/bench/bench_peel"))
    done = subprocess.run([program, str(repeats), "dufort-vase-dragons.json", str(PEEL_SIDE)], cwd=SCENES,
                          env=environment, check=True, stdout=subprocess.PIPE, text=True)
    table = []
    results = [json.loads(line) for line in done.stdout.splitlines()]
    base = spread(results[0]["processor_ms"])["median"]
    for r in results:
        # What is peeled needs no sort; the picture that it was peeled from was sorted all the same.
        ms = r["draw_ms"] if r["way"] == "peeled" else [d + s for d, s in zip(r["draw_ms"], r["sort_ms"])]
        processor = spread(r["processor_ms"])
        paper = {"peeled": "paper 20 s; ", "sorted": "paper 0.5 s; "}.get(r["way"], "")
        table.append({**r, "figure": f"vase (dragons), {r['side']} x {r['side']}, {r['way']}", "measured": spread(ms),
                      "processor": processor, "unit": "ms", "digits": 0,
                      "note": f"{r['layers']} pass{'es' if r['layers'] > 1 else ''}, {paper}processor "
                              f"{text(processor, digits=0)}, {processor['median'] / base:.2f} of sorted; "
                              f"off from sorted by {r['from_sorted_rms']:.2g} rms"})
    return table


def markdown(results):
    """The table for a README: `results` are rows() or what measure() gave."""
    def cell(r):
        low, mid, high = (percentile(r["ms"], p) for p in (0.1, 0.5, 0.9))
        sorted_ = " sorted," if r["order"] == "sorted" and r["way"] != "published" else ""
        return (f"{mid:,.0f} [{low:,.0f}-{high:,.0f}] ms,{sorted_} processor {percentile(r['processor_ms'], 0.5):,.0f}, "
                f"RMSE {r['rmse']:.2g}")
    lines = ["| scene | triangles | texture | samples | paper, 6800 GT | as published, here | as here, its samples | at its default |",
             "|---|---|---|---|---|---|---|---|"]
    for scene, (name, triangles, texture, samples, fps) in PAPER.items():
        mine = {r["way"]: r for r in results if r["scene"] == scene + ".json" and "way" in r}
        if not mine:
            continue
        first = mine["published"]
        lines.append(
            f"| {name} | {triangles or 12 * first['prisms']:,} | {texture or '512 x 512 x 32, 16'} | "
            f"{samples or first['samples']} | {f'{1000 / fps:,.0f} ms ({fps} fps)' if fps else ''} | "
            f"{cell(first)} | {cell(mine['as here'])} | {cell(mine['default'])}, "
            f"{mine['default']['samples']} samples |")
    return "\n".join(lines)


def percentile(values, p):
    values = sorted(values)
    at = p * (len(values) - 1)
    low = int(at)
    return values[low] + (values[min(low + 1, len(values) - 1)] - values[low]) * (at - low)


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        print(markdown(json.load(file)["dufort"]))
