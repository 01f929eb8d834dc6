#!/usr/bin/env python3
"""What Pelt promises in numbers, measured: prints a table for each figure with the median, the spread
from the 10th to the 90th percentile, and the command that gives it. Everything is warm: the first
runs are not counted.

Usage: bench.py BUILD [--json] [--only demo,error,reference,service,jobs,sequence,sort,plan,slicing,dufort,filter,choice,torus,memory,cold] [--repeats N]
The exit code is 0 whatever was measured: a machine may be slow or busy; numbers are for reading."""

import argparse
import http.client
import json
import math
import os
import platform
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

import choice
import dufort
import filter as filters
import table1
import torus
from bench_sequence import bench_sequence

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXAMPLES = os.path.join(ROOT, "api", "examples")


def percentile(values, p):
    values = sorted(values)
    at = p * (len(values) - 1)
    low = math.floor(at)
    high = min(low + 1, len(values) - 1)
    return values[low] + (values[high] - values[low]) * (at - low)


def spread(values):
    return {"median": percentile(values, 0.5), "p10": percentile(values, 0.1),
            "p90": percentile(values, 0.9), "runs": len(values)}


def text(s, unit="ms", digits=1):
    return f"{s['median']:.{digits}f} {unit} [{s['p10']:.{digits}f}-{s['p90']:.{digits}f}]"


class Daemon:
    """pelt serve on a free port, with a connection that is kept alive."""

    def __init__(self, pelt, *options):
        self.process = subprocess.Popen(
            [pelt, "serve", "--listen", "127.0.0.1:0", *options], stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True)
        line = self.process.stdout.readline()
        match = re.search(r"http://([^:]+):(\d+)", line)
        if not match:
            raise SystemExit(f"the daemon did not start: {line!r}")
        self.connection = http.client.HTTPConnection(match.group(1), int(match.group(2)),
                                                     timeout=120)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()
        self.process.terminate()
        self.process.wait(30)

    def children(self):
        with open(f"/proc/{self.process.pid}/task/{self.process.pid}/children") as file:
            return [int(pid) for pid in file.read().split()]

    def post(self, body, content_type, accept):
        """Milliseconds from before the first byte of the request to the last of the reply."""
        began = time.perf_counter()
        self.connection.request("POST", "/v1/render", body,
                                {"Content-Type": content_type, "Accept": accept})
        reply = self.connection.getresponse()
        data = reply.read()
        ms = (time.perf_counter() - began) * 1000
        if reply.status != 200:
            raise SystemExit(f"the daemon answered {reply.status}: {data[:400]!r}")
        return ms, reply, data


def multipart(scene, assets):
    boundary = "pelt-bench-boundary"
    parts = [("scene", "application/json", json.dumps(scene).encode())]
    parts += [(name, "application/octet-stream", data) for name, data in assets.items()]
    body = b"".join(
        f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; filename="{name}"\r\n'
        f"Content-Type: {kind}\r\n\r\n".encode() + data + b"\r\n" for name, kind, data in parts)
    return body + f"--{boundary}--\r\n".encode(), f"multipart/form-data; boundary={boundary}"


def demo_scene(side):
    with open(os.path.join(EXAMPLES, "demo.json")) as file:
        scene = json.load(file)
    scene["image"].update(width=side, height=side)
    with open(os.path.join(EXAMPLES, "assets", "bunny.glb"), "rb") as file:
        return scene, {"assets/bunny.glb": file.read()}


def bench_demo(pelt, repeats):
    """Each stage of the demo scene at 512 x 512, warm."""
    body, kind = multipart(*demo_scene(512))
    stages, totals, report = {}, [], {}
    with Daemon(pelt, "--workers", "1") as daemon:
        for run in range(repeats + 2):
            _, _, data = daemon.post(body, kind, "application/json")
            report = json.loads(data)["report"]
            if run < 2:
                continue
            for stage, ms in report["timing_ms"].items():
                (totals if stage == "total" else stages.setdefault(stage, [])).append(ms)
    rows = [{"figure": f"demo 512 x 512: {stage}", "measured": spread(ms), "unit": "ms"}
            for stage, ms in stages.items() if max(ms) > 0]
    rows.append({"figure": "demo 512 x 512: total", "measured": spread(totals), "unit": "ms",
                 "note": f"{report['work']['tetrahedra']} tetrahedra, "
                         f"{report['work']['samples']} samples, {report['renderer']['threads']} threads"})
    return rows


def bench_service(pelt, repeats):
    """The client's wall time less all stages but queue and parse, assets cached."""
    body, kind = multipart(*demo_scene(256))
    overheads = []
    with Daemon(pelt, "--workers", "1") as daemon:
        for run in range(3 * repeats + 3):
            ms, reply, _ = daemon.post(body, kind, "image/png")
            stages = dict(re.findall(r"(\w+);dur=([\d.]+)", reply.headers["Server-Timing"]))
            inner = sum(float(value) for stage, value in stages.items()
                        if stage not in ("total", "queue", "parse"))
            if run >= 3:
                overheads.append(ms - inner)
    return [{"figure": "service overhead, 256 x 256, assets cached", "asked": "at most 3 ms",
             "measured": spread(overheads), "unit": "ms", "digits": 2,
             "met": percentile(overheads, 0.5) <= 3}]


def bench_jobs(pelt, repeats):
    """Pictures beside a job: POST /v1/render of a fur sphere, 256 x 256, one connection."""
    # Its process is stopped before every second request, so that both halves have the same machine.
    scene = json.dumps({"image": {"width": 256, "height": 256, "samples": 1}, "objects": [
        {"shell": {"mesh": {"shape": "sphere"}, "material": {"builtin": "fur"}}}]})
    long = json.dumps({**json.loads(scene), "image": {"width": 1024, "height": 1024, "samples": 1}})
    alone, beside = [], []
    with Daemon(pelt, "--workers", "2") as daemon:
        workers = set(daemon.children())
        ask = daemon.connection.request
        ask("POST", "/v1/jobs", long, {"Content-Type": "application/json"})
        job = daemon.connection.getresponse()
        job.read()
        while True:
            ask("GET", job.headers["Location"])
            told = json.loads(daemon.connection.getresponse().read())
            if told["progress"]["what"] == "reference":
                break
            time.sleep(0.1)
        process, = set(daemon.children()) - workers
        for run in range(max(30, repeats) + 3):
            for signalled, times in ((signal.SIGSTOP, alone), (signal.SIGCONT, beside)):
                os.kill(process, signalled)
                time.sleep(0.1)
                ms, _, _ = daemon.post(scene, "application/json", "image/png")
                if run >= 3:
                    times.append(ms)
        ask("DELETE", job.headers["Location"])
        daemon.connection.getresponse().read()
    return [{"figure": "a picture, the job stopped", "measured": spread(alone), "unit": "ms"},
            {"figure": "a picture, the job running", "measured": spread(beside), "unit": "ms"},
            {"figure": "ratio of the medians",
             "value": f"{percentile(beside, 0.5) / percentile(alone, 0.5):.3f}"}]


def bench_sort(build, repeats):
    """SXMPVO on closed tori, 512 x 512 A-buffer; growth between the smallest and the largest."""
    rows, points = [], []
    for asked in (10000, 30000, 100000, 300000, 1000000):
        run = subprocess.run([os.path.join(build, "tests/bench/bench_sort"), str(asked),
                              str(repeats)], check=True, capture_output=True, text=True)
        result = json.loads(run.stdout)
        s = spread(result["ms"])
        points.append((result["tetrahedra"], s["median"]))
        rows.append({"figure": f"SXMPVO, {result['tetrahedra']} tetrahedra", "measured": s,
                     "unit": "ms", "note": f"{result['fragments']} fragments, {result['edges']} "
                                           f"edges, {result['cycles']} cycles"})
    logs = [(math.log(n), math.log(ms)) for n, ms in points]
    mean_x = sum(x for x, _ in logs) / len(logs)
    mean_y = sum(y for _, y in logs) / len(logs)
    slope = (sum((x - mean_x) * (y - mean_y) for x, y in logs)
             / sum((x - mean_x) ** 2 for x, _ in logs))
    # n log n has no single exponent: its own, fitted to the same n, is the bar.
    bar_logs = [(x, x + math.log(x)) for x, _ in logs]
    bar_y = sum(y for _, y in bar_logs) / len(bar_logs)
    bar = (sum((x - mean_x) * (y - bar_y) for x, y in bar_logs)
           / sum((x - mean_x) ** 2 for x, _ in bar_logs))
    rows.append({"figure": "SXMPVO, growth", "asked": f"no faster than n log n (n^{bar:.2f})",
                 "value": f"n^{slope:.2f}", "met": slope <= bar})
    return rows


def ratio(pairs, column):
    """Of one column of the times of pictures drawn in turns, forced to planned."""
    return spread([forced[column] / planned[column] for planned, forced in pairs])


def bench_plan(build, repeats):
    """Draw time with a part put in that the scene does not need, to that without it; same picture."""
    program = os.path.join(build, "tests/bench/bench_plan")
    run = subprocess.run([program, str(repeats)], check=True, stdout=subprocess.PIPE, text=True)
    rows = []
    for line in run.stdout.splitlines():
        r = json.loads(line)
        before, after = r["planned"], r["forced"]
        every = ratio(r["ms"], 1)
        rows.append({
            "figure": f"{r['part']}: {r['scene']}", "measured": ratio(r["ms"], 0), "unit": "x",
            "digits": 2, "all_stages": every, "planned": before, "forced": after,
            "planned_draw_ms": spread([planned[0] for planned, _ in r["ms"]]),
            "largest_difference": r["largest"], "rms_difference": r["rms"],
            "note": f"all stages {every['median']:.2f} x; "
                    f"passes {before['passes']} to {after['passes']}, "
                    f"draws {before['draws']} to {after['draws']}, "
                    f"uploads {before['bytes'] / 1e6:.2f} to {after['bytes'] / 1e6:.2f} MB, "
                    f"fetches a sample {before['fetches']:.1f} to {after['fetches']:.1f}; "
                    f"pictures off by {r['largest']:.1g} at most, {r['rms']:.1g} rms"})
    modules = dict(os.environ, PELT_LIBDIR=os.path.abspath(os.path.join(build, "lib/pelt")))
    for number in range(2):
        opened = [json.loads(subprocess.run([program, "--library", str(number)], check=True,
                                            capture_output=True, env=modules).stdout)
                  for _ in range(repeats + 1)][1:]
        rows.append({"figure": f"{opened[0]['library']}: nothing to read",
                     "measured": spread([o["ms"] for o in opened]), "unit": "ms",
                     "mapped": opened[0]["mapped"], "resident_kib": opened[0]["kib"],
                     "note": f"to open it: {opened[0]['mapped']} libraries more, "
                             f"{opened[0]['kib'] / 1024:.1f} MiB resident"})
    return rows


def bench_slicing(build, repeats):
    """Table 1 of Lensch et al. 2002: planes x methods, 512 x 512; error against the reference."""
    return table1.rows(build, repeats, spread, text)


def bench_dufort(build, repeats):
    """Table 1 of Dufort et al. 2005, 512 x 512, one sample a pixel: sort, shadow and draw of a picture;
    error against the reference; then depth peeling against sorted and walked cells."""
    return dufort.rows(build, repeats, spread, text) + dufort.peel_rows(build, repeats, spread, text)


def bench_filter(build, repeats):
    """quality.filter, one sample a pixel against 64 unfiltered ones, 1 to 64 times as far; all views of a distance."""
    return filters.rows(build, repeats, spread, text)


def bench_choice(build, repeats):
    """What path auto stands on: the rates of renderer/cost.c, and how far off they are here."""
    return choice.rows(build, repeats)


def bench_slicing_cost(build, repeats):
    """What slicing costs: growth with planes and with prisms, methods and maps, memory."""
    run = subprocess.run([os.path.join(build, "tests/bench/bench_slicing_cost"), str(repeats)],
                         check=True, stdout=subprocess.PIPE, text=True)
    return [json.loads(line) for line in run.stdout.splitlines()]


def bench_torus(build, repeats):
    """Rays that walk through a fur torus, 512 x 512, all layers; growth with the number of tetrahedra."""
    return torus.rows(build, repeats, spread, percentile, text)


def resident_mib(pid, field="VmRSS"):
    with open(f"/proc/{pid}/status") as file:
        for line in file:
            if line.startswith(field + ":"):
                return int(line.split()[1]) / 1024
    raise SystemExit(f"process {pid} has no {field}")


def bench_memory(pelt, repeats):
    """Resident memory of front and worker after the demo, peaks included."""
    body, kind = multipart(*demo_scene(512))
    with Daemon(pelt, "--workers", "1") as daemon:
        for _ in range(max(3, repeats // 3)):
            daemon.post(body, kind, "application/json")
        front = resident_mib(daemon.process.pid), resident_mib(daemon.process.pid, "VmHWM")
        worker = max((resident_mib(pid), resident_mib(pid, "VmHWM")) for pid in daemon.children())
    return [{"figure": f"memory, {who}", "asked": f"at most {limit} MB",
             "value": f"{rss:.1f} MiB (peak {peak:.1f})", "met": rss * 1.048576 <= limit}
            for who, limit, (rss, peak) in (("front", 25, front), ("worker", 300, worker))]


def bench_cold(pelt, repeats):
    """A process of its own for each picture: 256 x 256, no assets, shader cache warm."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for material in ("fur", "homogeneous"):
            scene = {"image": {"width": 256, "height": 256}, "objects": [
                {"shell": {"mesh": {"shape": "sphere"}, "material": {"builtin": material}}}]}
            path = os.path.join(folder, "scene.json")
            with open(path, "w") as file:
                json.dump(scene, file)
            walls, inner, cpu = [], [], []
            for run in range(repeats + 2):
                used = resource.getrusage(resource.RUSAGE_CHILDREN)
                began = time.perf_counter()
                done = subprocess.run([pelt, "render", path, "-o", os.path.join(folder, "o.png"),
                                       "--json"], check=True, capture_output=True)
                ms = (time.perf_counter() - began) * 1000
                now = resource.getrusage(resource.RUSAGE_CHILDREN)
                if run >= 2:
                    walls.append(ms)
                    inner.append(json.loads(done.stdout)["timing_ms"]["total"])
                    cpu.append(1000 * (now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime))
            rows.append({"figure": f"pelt render, cold process, {material} sphere",
                         "asked": "at most 500 ms", "measured": spread(walls), "unit": "ms",
                         "met": percentile(walls, 0.5) <= 500,
                         "note": f"report's total {percentile(inner, 0.5):.0f} ms, processor time "
                                 f"{percentile(cpu, 0.5):.0f} ms"})
    return rows


def bench_error(pelt, repeats):
    """Error against run time of the demo: textures by the tetrahedra's affine map, as published, and by
    the prisms' own; what an estimate costs. 256 x 256, 4 samples a pixel, drawings interleaved."""
    scene = demo_scene(256)[0]
    settings = [(kind, samples) for kind in ("affine", "exact") for samples in (8, 16, 32, 64)]

    def variant(kind, samples, error):
        made = json.loads(json.dumps(scene))
        made["report"] = {"error": error}
        for each in made["objects"]:
            if "shell" in each:
                each["quality"] = {"samples": samples, "map": kind}
        return made

    def run(folder, variants):
        names = []
        for i, made in enumerate(variants):
            names.append(os.path.join(folder, f"{i:04}.json"))
            with open(names[-1], "w") as file:
                json.dump(made, file)
        done = subprocess.run([pelt, "render", *names, "--out-dir", folder, "--json", "--assets",
                               EXAMPLES], check=True, capture_output=True, text=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        errors = run(folder, [variant(*setting, "reference") for setting in settings])
        order = settings + settings[::-1]  # every other round backwards
        rounds = (settings + [order[n % len(order)] for n in range(len(settings) * repeats)])
        drawn = run(folder, [variant(*setting, "none") for setting in rounds])[len(settings):]
        estimated = run(folder, [variant("exact", 32, "estimate")] * (repeats + 1))[1:]
        small = [thumbnail(shape, material, samples) for shape in ("sphere", "torus", "plane")
                 for material in ("fur", "clouds", "chain") for samples in (1, 4)]
        small_reports = run(folder, small * (repeats + 1))[len(small):]
    for setting, error in zip(settings, errors):
        times = [report["timing_ms"]["draw"] for at, report in zip(rounds[len(settings):], drawn)
                 if at == setting]
        found = error["error"]
        rows.append({"figure": f"{setting[0]} map, {setting[1]} samples: RMSE {found['rmse']:.4f} +- "
                               f"{found['rmse_standard_error']:.4f}, model {found['model']:.4f}, "
                               f"discretisation {found['discretisation']:.4f}; draw",
                     "measured": spread(times), "unit": "ms"})
    rows.append({"figure": "estimate, of what the picture takes without it", "asked": "at most 30 %",
                 "measured": spread(list(map(estimate_cost, estimated))), "unit": "%"})
    medians = [percentile(list(map(estimate_cost, small_reports[i::len(small)])), 0.5)
               for i in range(len(small))]
    totals = [report["timing_ms"]["total"] - report["timing_ms"]["error"] for report in small_reports]
    known = sum(1 for report in small_reports if report["error"]["model_pixels"])
    rows.append({"figure": f"the same, {len(small)} thumbnails of 128 x 128, medians of each",
                 "asked": "at most 30 %", "measured": spread(medians), "unit": "%",
                 "note": f"most {max(medians):.0f} %; pictures of {min(totals):.0f} to {max(totals):.0f} "
                         f"ms; model error known in {known / len(small_reports):.0%}"})
    return rows


def thumbnail(shape, material, samples):
    return {"image": {"width": 128, "height": 128, "samples": samples},
            "objects": [{"shell": {"mesh": {"shape": shape}, "base": {"color": [0.3, 0.2, 0.1]},
                                   "material": {"builtin": material}}}],
            "report": {"error": "estimate"}}


def estimate_cost(report):
    took = report["timing_ms"]
    return 100 * took["error"] / (took["total"] - took["error"] - took["encode"])


def bench_reference(pelt, repeats):
    """The reference, all cores."""
    scene = demo_scene(256)[0]
    scene["image"]["samples"] = 1
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "demo.json")
        with open(path, "w") as file:
            json.dump(scene, file)
        began = time.monotonic()
        subprocess.run([pelt, "reference", path, "--assets", EXAMPLES, "--quiet", "-o",
                        os.path.join(folder, "truth.png")], check=True, stderr=subprocess.DEVNULL)
        whole = time.monotonic() - began
        scene["report"] = {"error": "reference"}
        with open(path, "w") as file:
            json.dump(scene, file)
        some = []
        for _ in range(min(repeats, 3)):
            done = subprocess.run([pelt, "render", path, "--assets", EXAMPLES, "--json", "-o",
                                   os.path.join(folder, "a.png")], check=True, capture_output=True)
            some.append(json.loads(done.stdout)["timing_ms"]["error"] / 1000)
    return [{"figure": "the demo at 256 x 256, one sample a pixel", "asked": "at most 60 s",
             "measured": spread([whole]), "unit": "s"},
            {"figure": "4,096 pixels of it (report.error: reference)", "asked": "at most 5 s",
             "measured": spread(some), "unit": "s"}]


def print_table(rows):
    width = max(len(row["figure"]) for row in rows)
    for row in rows:
        measured = text(row["measured"], row["unit"], row.get("digits", 1)) \
            if "measured" in row else row["value"]
        verdict = {True: "met", False: "NOT MET", None: ""}[row.get("met")]
        asked = f"  asked: {row['asked']}" if "asked" in row else ""
        print(f"  {row['figure']:<{width}}  {measured:<28}{asked}  {verdict}"
              f"{'  ' + row['note'] if 'note' in row else ''}".rstrip())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--only", default="demo,error,reference,service,jobs,sequence,sort,plan,slicing,dufort,filter,choice,torus,memory,cold")
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    pelt = os.path.join(options.build, "pelt")
    table = {"demo": lambda n: bench_demo(pelt, n), "error": lambda n: bench_error(pelt, n),
             "reference": lambda n: bench_reference(pelt, n), "service": lambda n: bench_service(pelt, n),
             "jobs": lambda n: bench_jobs(pelt, n),
             "sequence": lambda n: bench_sequence(pelt, EXAMPLES, spread, n),
             "sort": lambda n: bench_sort(options.build, n),
             "plan": lambda n: bench_plan(options.build, n),
             "slicing": lambda n: (bench_slicing(options.build, min(n, 5))
                                   + bench_slicing_cost(options.build, min(n, 5))),
             "dufort": lambda n: bench_dufort(options.build, min(n, 5)),
             "filter": lambda n: bench_filter(options.build, min(n, 5)),
             "choice": lambda n: bench_choice(options.build, min(n, 3)),
             "torus": lambda n: bench_torus(options.build, n),
             "memory": lambda n: bench_memory(pelt, n), "cold": lambda n: bench_cold(pelt, n)}
    results = {}
    if not options.json:
        load = os.getloadavg()[0]
        print(f"{platform.machine()}, {os.cpu_count()} cores, load {load:.2f}; median "
              "[10th-90th percentile]")
    for name in options.only.split(","):
        results[name] = rows = table[name](options.repeats)
        if not options.json:
            print(f"\n{table_title(name)}  (tests/bench/bench.py {options.build} --only {name})")
            print_table(rows)
            sys.stdout.flush()
    if options.json:
        json.dump(results, sys.stdout, indent=1)
        print()


def table_title(name):
    return {"demo": bench_demo, "error": bench_error, "reference": bench_reference,
            "service": bench_service, "jobs": bench_jobs, "sequence": bench_sequence,
            "sort": bench_sort, "plan": bench_plan, "slicing": bench_slicing, "dufort": bench_dufort, "filter": bench_filter,
            "choice": bench_choice,
            "torus": bench_torus,
            "memory": bench_memory, "cold": bench_cold}[name].__doc__


if __name__ == "__main__":
    main()
