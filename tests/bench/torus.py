"""The figures asked of rays that walk: fur on a torus at three sizes, and growth up to a million
tetrahedra (bench_torus.c). For bench.py."""

import json
import math
import os
import subprocess


def rows(build, repeats, spread, percentile, text):
    program = os.path.join(build, "tests/bench/bench_torus")

    def run(*arguments):
        done = subprocess.run([program, str(min(repeats, 101)), *arguments], check=True,
                              stdout=subprocess.PIPE, text=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    table = []
    for r in run():
        total = spread(r["total_ms"])
        row = {**r, "figure": f"{r['tetrahedra']:6} tetrahedra, {r['way']}", "measured": total,
               "unit": "ms", "note": f"draw {percentile(r['draw_ms'], 0.5):.0f}, sort {r['sort_ms']:.0f}, "
                                     f"processor {text(spread(r['cpu_ms']))}; RMSE {r['rmse']:.2g}"}
        if r["way"] == "default":
            row["asked"] = f"at most {r['asked_ms']:g} ms, RMSE 0.01"
            row["met"] = total["median"] <= r["asked_ms"] and r["rmse"] <= 0.01
        table.append(row)
    points = run("--growth")
    for column, what in (("total_ms", "all stages"), ("draw_ms", "draw"), ("cpu_ms", "processor")):
        slope = growth([(p["tetrahedra"], percentile(p[column], 0.5)) for p in points])
        table.append({"figure": f"growth from {points[0]['tetrahedra']} to "
                                f"{points[-1]['tetrahedra']} tetrahedra, {what}",
                      "asked": "exponent below 0.6", "value": f"n^{slope:.2f}", "met": slope < 0.6,
                      "note": ", ".join(f"{percentile(p[column], 0.5):.0f}" for p in points) + " ms"})
    return table


def growth(points):
    """The exponent of time against number: the slope of the logarithms."""
    logs = [(math.log(n), math.log(ms)) for n, ms in points]
    mean_x = sum(x for x, _ in logs) / len(logs)
    mean_y = sum(y for _, y in logs) / len(logs)
    return (sum((x - mean_x) * (y - mean_y) for x, y in logs)
            / sum((x - mean_x) ** 2 for x, _ in logs))
