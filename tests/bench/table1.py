"""Table 1 of Lensch, Daubert & Seidel 2002, beside what this machine does: bench.py --only slicing calls it."""

import json
import os
import subprocess

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes")

# Frames a second at 512 x 512: {(planes, board): (hybrid, hardware with reject, without)}. GF3, GF4:
# GeForce 3 and 4, each with an Athlon of 1 GHz. The copy at hand gives the rows of 500 planes in another
# order than the others; they are told apart by their figures.
PAPER = {
    "torus-egg.json": {(250, "GF3"): (38, 10, 1.6), (250, "GF4"): (38, 25, 4),
                       (500, "GF3"): (20, 5, 0.8), (500, "GF4"): (20, 13, 2),
                       (1000, "GF3"): (12, 3, 0.4), (1000, "GF4"): (12, 6, 1)},
    "terrain-smoke.json": {(250, "GF3"): (14, 6, 0.3), (250, "GF4"): (13, 12, 0.7),
                           (500, "GF3"): (7, 3, 0.1), (500, "GF4"): (7, 6, 0.4),
                           (1000, "GF3"): (1, 1.4, 0.1), (1000, "GF4"): (4, 3, 0.2)}}
COLUMN = {"hybrid": 0, "hardware": 1, "hardware, no reject": 2}


def measure(build, repeats):
    """One dictionary for each scene, number of planes and method."""
    environment = dict(os.environ, PELT_LIBDIR=os.path.abspath(os.path.join(build, "lib/pelt")))
    program = os.path.abspath(os.path.join(build, "tests/bench/bench_table1"))
    run = subprocess.run([program, str(repeats), *PAPER], cwd=SCENES, env=environment, check=True,
                         stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def paper_ms(result, board):
    column = COLUMN.get(result["method"])
    figures = PAPER[result["scene"]].get((result["planes"], board))
    return 1000 / figures[column] if figures and column is not None else None


def rows(build, repeats, spread, text):
    """For bench.py: `spread` and `text` are its own."""
    table = []
    for r in measure(build, repeats):
        wall, processor = spread(r["ms"]), spread(r["processor_ms"])
        paper = [paper_ms(r, board) for board in ("GF3", "GF4")]
        beside = f"paper {paper[0]:.0f} ms (GF3), {paper[1]:.0f} ms (GF4); " if paper[0] else ""
        planes = f"{r['planes']:4} planes" if r["planes"] else "its default"
        table.append({**r, "figure": f"{r['scene'][:-5]}, {planes}, {r['method']}",
                      "measured": wall, "processor": processor, "unit": "ms", "digits": 0,
                      "paper_ms": dict(zip(("GF3", "GF4"), paper)),
                      "note": f"RMSE {r['rmse']:.2g}; {beside}processor {text(processor, digits=0)}; "
                              f"{r['outlines']} polygons, {r['fragments'] / 1e6:.2f} M fragments"})
    return table


def markdown(results, median):
    """The table for a README."""
    lines = []
    for scene in PAPER:
        mine = [r for r in results if r["scene"] == scene]
        lines += [f"| {scene[:-5]} | 250 planes | 500 | 1,000 | paper, GF3 / GF4 (250; 500; 1,000) |",
                  "|---|---|---|---|---|"]
        methods = list(dict.fromkeys(r["method"] for r in mine))
        for method in methods:
            cells, paper = [], []
            for planes in (250, 500, 1000):
                found = [r for r in mine if r["method"] == method and r["planes"] in (planes, 0)]
                cells.append(f"{median(found[0]['processor_ms']):,.0f} ms, {found[0]['rmse']:.2g}"
                             if found else "")
                ms = [paper_ms(found[0], board) if found else None for board in ("GF3", "GF4")]
                if ms[0]:
                    paper.append(f"{ms[0]:,.0f} / {ms[1]:,.0f}")
            if method == "tetra":
                cells = [cells[0] + ", at its default", "", ""]
            lines.append(f"| {method} | " + " | ".join(cells) + f" | {'; '.join(paper)} |")
        lines.append("")
    return "\n".join(lines)
