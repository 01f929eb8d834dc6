"""Filters against 64-fold supersampling, at several distances (bench_filter.c). For bench.py."""

import json
import os
import subprocess


def rows(build, repeats, spread, text):
    program = os.path.join(build, "tests/bench/bench_filter")
    run = subprocess.run([program, str(min(repeats, 101))], check=True, stdout=subprocess.PIPE, text=True)
    table = []
    for line in run.stdout.splitlines():
        r = json.loads(line)
        processor = spread(r["processor_ms"])
        if r["filter"] == "none":
            unfiltered = processor["median"]
        table.append({**r, "figure": f"{r['scene']}, {r['distance']:2.0f} x, {r['filter']}",
                      "measured": spread(r["draw_ms"]), "processor": processor, "unit": "ms",
                      "note": f"RMSE {r['rmse']:.4f}, bias {r['bias']:+.4f}; processor {text(processor)}, "
                              f"{processor['median'] / unfiltered:.2f} x none; {r['views']} "
                              f"view{'s' if r['views'] > 1 else ''}, 64 samples {r['truth_ms']:.0f} ms"})
    return table
