"""What `path: "auto"` stands on: bench.py --only choice calls it. Draws the pictures of bench_choice.c, fits the
rates of renderer/cost.c to them, and says how far off the committed ones are on this machine."""

import json
import os
import subprocess

WAYS, CONTENTS = ("walked", "sorted", "slabs"), ("even", "medium", "lit", "solid")
RATES = ("frame", "sample", "outline", "fragment", "step")


def figures(r):
    return [1, r["samples"], r["outlines"], r["fragments"], r["steps"]]


def fit(pictures):
    """Least squares of relative errors (of a millisecond at the least), no rate below 0: one coordinate
    after the other until they stay."""
    rows = [figures(r) for r in pictures]
    scale = [max(max(row[k] for row in rows), 1e-9) for k in range(len(RATES))]
    x = [[row[k] / scale[k] for k in range(len(RATES))] for row in rows]
    y = [r["ms"] for r in pictures]
    w = [1 / max(ms, 1) ** 2 for ms in y]
    indices = range(len(RATES))
    a = [[sum(w[i] * x[i][j] * x[i][k] for i in range(len(x))) for k in indices] for j in indices]
    b = [sum(w[i] * x[i][j] * y[i] for i in range(len(x))) for j in indices]
    rates = [0.0] * len(RATES)
    for _ in range(20000):
        for j in indices:
            if a[j][j] > 0:
                step = b[j] - sum(a[j][k] * rates[k] for k in indices)
                rates[j] = max(0, rates[j] + step / a[j][j])
    return [rate / s for rate, s in zip(rates, scale)]


def within(pairs):
    return sum(0.5 <= p / q <= 2 for p, q in pairs)


def rows(build, repeats):
    program = os.path.join(build, "tests/bench/bench_choice")
    run = subprocess.run([program, str(repeats)], check=True, stdout=subprocess.PIPE, text=True)
    pictures = [r for r in map(json.loads, run.stdout.splitlines()) if r["ms"] > 0]
    table = []
    for way in WAYS:
        for content in CONTENTS:
            mine = [r for r in pictures if (r["way"], r["contents"]) == (way, content)]
            rates = fit(mine)
            table.append({"figure": f"{way}, {content}", "rates": dict(zip(RATES, rates)),
                          "value": ", ".join(f"{name} {rate:.3g}"
                                             for name, rate in zip(RATES, rates) if rate > 1e-12),
                          "note": f"ms of the processor each; the committed rates are within a factor "
                                  f"of 2 of {within([(r['model_ms'], r['ms']) for r in mine])} of "
                                  f"{len(mine)} pictures"})
    scenes = {}
    for r in pictures:
        key = (r["contents"], r["shape"], r["side"], r["thickness"], r["fineness"])
        scenes.setdefault(key, {})[r["way"]] = r
    for way in WAYS[:2]:
        both = [(s["slabs"]["model_ms"] / s[way]["model_ms"], s["slabs"]["ms"] / s[way]["ms"])
                for s in scenes.values() if "slabs" in s and way in s]
        wrong = [real for model, real in both if (model > 1) != (real > 1)]
        table.append({"figure": f"slabs to {way}, by the committed rates",
                      "value": f"within a factor of 2 in {within(both)} of {len(both)}",
                      "note": f"the dearer one is taken in {len(wrong)}"
                              + (f", by a factor of {max(max(x, 1 / x) for x in wrong):.2f} at most"
                                 if wrong else "")})
    return table
