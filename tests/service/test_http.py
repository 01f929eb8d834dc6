#!/usr/bin/python3
"""What every reply carries, and the resources one by one."""

import base64
import json
import os
import shutil
import signal
import subprocess
import time

from harness import LONG, PELT, SHELL, SMALL, Daemon, main, read_reply, scene

STAGES = "queue parse assets bake upload sort shadow choose draw readback error encode".split()


def timings(reply):
    return {name: float(rest[len("dur="):]) for name, rest in
            (part.strip().split(";") for part in reply.headers["Server-Timing"].split(","))}


def check_headers(reply):
    assert reply.headers["X-Request-Id"], reply.headers
    assert timings(reply)["total"] >= 0, reply.headers
    if reply.status >= 400:
        assert reply.headers["Content-Type"] == "application/problem+json", reply.headers
        if reply.body:
            problem = reply.json()
            assert problem["status"] == reply.status, problem
            assert problem["request_id"] == reply.headers["X-Request-Id"], problem


def test_every_reply_has_its_headers():
    with Daemon("--workers", "1") as daemon:
        for method, path, status in [
                ("GET", "/livez", 200), ("HEAD", "/livez", 200), ("GET", "/readyz", 200),
                ("GET", "/metrics", 200), ("GET", "/openapi.yaml", 200),
                ("GET", "/v1/capabilities", 200), ("HEAD", "/v1/capabilities", 200),
                ("GET", "/", 404), ("GET", "/v1/render/", 404), ("POST", "/v1/jobs", 415),
                ("GET", "/v1/render", 405), ("DELETE", "/v1/plan", 405), ("POST", "/livez", 405),
                ("BREW", "/metrics", 405), ("POST", "/v1/render", 415)]:
            reply = daemon.request(method, path)
            assert reply.status == status, (method, path, reply.status, reply.body)
            check_headers(reply)
            assert method != "HEAD" or reply.body == b""
            if status == 405:
                assert reply.headers["Allow"] in ("POST", "GET, HEAD"), reply.headers
        daemon.check_good()


def test_request_ids():
    with Daemon("--workers", "1") as daemon:
        assert daemon.get("/livez", X_Request_Id="a.b-c_1:2+3/4=").headers["X-Request-Id"] == \
            "a.b-c_1:2+3/4="
        made = [daemon.get("/livez").headers["X-Request-Id"] for _ in range(2)]
        assert made[0] != made[1]
        for bad in ["x" * 65, "with space", 'quo"te', "\xe4"]:
            assert daemon.get("/livez", X_Request_Id=bad).headers["X-Request-Id"] != bad
        reply = daemon.post("{", **{"X-Request-Id": "told"})
        assert reply.json()["request_id"] == "told"
        daemon.until(lambda: 'id="told"' in daemon.log(), "the id is in the log")


def test_media_types():
    with Daemon("--workers", "1") as daemon:
        magic = {"image/png": b"\x89PNG", "image/x-exr": b"\x76\x2f\x31\x01",
                 "application/json": b"{"}
        for accept, expected in [
                ("image/png", "image/png"), ("*/*", "image/png"), ("image/*", "image/png"),
                ("image/x-exr", "image/x-exr"), ("application/json", "application/json"),
                ("application/*", "application/json"), ("IMAGE/PNG", "image/png"),
                ("image/png;q=0.5, image/x-exr", "image/x-exr"),
                ("image/png;q=0, image/*;q=0.5", "image/x-exr"),
                ("text/html, application/json;q=0.1", "application/json"),
                ("", "image/png")]:
            reply = daemon.post(SMALL, accept=accept)
            assert reply.status == 200, (accept, reply.status, reply.body)
            assert reply.headers["Content-Type"] == expected, (accept, reply.headers)
            assert reply.body.startswith(magic[expected]), (accept, reply.body[:8])
            check_headers(reply)
        for accept in ["text/html", "image/jpeg", "image/png;q=0", "*/*;q=0", "image"]:
            reply = daemon.post(SMALL, accept=accept)
            assert (reply.status, reply.slug()) == (406, "not-acceptable"), (accept, reply.body)
        for kind in ["text/plain", "application/x-www-form-urlencoded", "application/jsonx"]:
            reply = daemon.request("POST", "/v1/render", json.dumps(SMALL), {"Content-Type": kind})
            assert reply.status == 415, (kind, reply.body)
        reply = daemon.request("POST", "/v1/render", json.dumps(SMALL),
                               {"Content-Type": "application/json", "Content-Encoding": "gzip"})
        assert reply.status == 415, reply.body
        reply = daemon.request("POST", "/v1/render", json.dumps(SMALL),
                               {"Content-Type": "Application/JSON; charset=utf-8"})
        assert reply.status == 200, reply.body


def test_report_and_timings_add_up():
    with Daemon("--workers", "1") as daemon:
        reply = daemon.post(SMALL, accept="application/json")
        document = reply.json()
        picture = base64.b64decode(document["image"]["data"], validate=True)
        assert picture == daemon.post(SMALL).body, "the same scene, other bytes"
        report = document["report"]
        timing = report["timing_ms"]
        told = sum(timing[stage] for stage in STAGES)
        assert abs(told - timing["total"]) <= max(2, 0.05 * timing["total"]), timing
        assert timing["parse"] > 0 and timing["encode"] > 0 and timing["queue"] > 0, timing
        header = timings(reply)
        for stage in STAGES + ["total"]:
            assert abs(header[stage] - timing[stage]) < 0.01, (stage, header, timing)
        again = daemon.post(report["resolved"])
        assert again.body == picture, "the resolved scene draws another picture"
        plan = daemon.post(SMALL, path="/v1/plan", accept="application/json").json()
        assert plan["report"]["plan"]["passes"] == report["plan"]["passes"], plan
        assert "image" not in plan


def test_capabilities():
    with Daemon("--workers", "1", "--queue", "5", "--timeout-ms", "12345") as daemon:
        told = daemon.get("/v1/capabilities").json()
        names = {row["name"]: row["state"] for row in told["paths"]}
        assert set(names) == {"tetra", "slicing", "gdm", "distance", "frusta", "auto"}, names
        assert names["tetra"] == names["slicing"] == "ready", names
        for row in told["materials"]:
            document = scene(objects=[{"shell": {**SHELL["shell"],
                                                 "material": {"builtin": row["name"]}}}])
            status = daemon.post(document, path="/v1/plan", accept="*/*").status
            assert status == (200 if row["state"] == "ready" else 501), (row, status)
        assert told["limits"]["queue"] == 5 and told["limits"]["timeout_ms"] == 12345, told
        assert told["renderer"]["gl_renderer"], told


def test_metrics():
    with Daemon("--workers", "1") as daemon:
        before = daemon.metrics()
        daemon.check_good()
        daemon.get("/nowhere")
        after = daemon.metrics()

        def grew(name):
            return after.get(name, 0) - before.get(name, 0)
        assert grew('pelt_requests_total{resource="render",status="200"}') == 1, after
        assert grew('pelt_requests_total{resource="other",status="404"}') == 1, after
        assert grew('pelt_stage_seconds_count{stage="draw"}') == 1, after
        assert grew("pelt_sent_bytes_total") > 100 and grew("pelt_received_bytes_total") > 50
        text = daemon.get("/metrics").body
        if shutil.which("promtool"):
            subprocess.run(["promtool", "check", "metrics"], input=text, check=True)


def test_readiness():
    """Where nothing was drawn for ten seconds a canary is: that finds a worker which hangs while
    idle, and it is replaced. Busy is not unready."""
    with Daemon("--workers", "1") as good, Daemon("--workers", "1") as bad:
        assert bad.get("/readyz").body == b"ready\n"
        waiting = bad.send(LONG)
        bad.until_busy()
        assert bad.get("/readyz").body == b"ready\n"
        assert read_reply(waiting).status == 200
        drawn_s = bad.metric("pelt_uptime_seconds")
        hung = bad.worker_pids()[0]
        os.kill(hung, signal.SIGSTOP)
        while bad.metric("pelt_uptime_seconds") <= drawn_s + 10:
            time.sleep(0.2)
        assert good.get("/readyz").body == b"ready\n", "a canary can be drawn"
        reply = bad.get("/readyz")
        assert (reply.status, reply.slug()) == (504, "deadline"), reply.body
        bad.until_idle(1)
        assert bad.worker_pids() != [hung]
        assert bad.get("/readyz").body == b"ready\n"
        bad.check_good()


def test_help_and_usage():
    told = subprocess.run([PELT, "serve", "--help"], capture_output=True, text=True)
    assert told.returncode == 0
    for option in ["--listen", "--assets", "--workers", "--queue", "--timeout-ms", "--log",
                   "--backend", "--device", "--require-hardware", "--jobs-queue",
                   "--jobs-keep-mib", "--jobs-keep-s", "--job-timeout-s"]:
        assert option in told.stdout, option
    for arguments in [["--nonsense"], ["--workers"], ["--workers", "0"], ["--queue", "x"],
                      ["--log", "xml"], ["--listen", "nowhere"], ["--help=1"],
                      ["--listen", "::1:80"], ["extra"]]:
        done = subprocess.run([PELT, "serve", *arguments], capture_output=True, text=True)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, (arguments, done)


main(globals())
