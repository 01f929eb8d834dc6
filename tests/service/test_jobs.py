#!/usr/bin/python3
"""Long work under /v1/jobs: its whole life, its results, and all that can go wrong with it."""

import json
import math
import os
import re
import signal
import subprocess
import tempfile
import threading
import time

from harness import (ENDLESS, PATIENCE_S, PELT, SHELL, SMALL, TETRAHEDRON, TETRAHEDRON_FACES,
                     Daemon, glb, main, multipart, read_reply, scene)

# Few voxels on a ray: its truth takes a moment, and the path that takes few steps is far from it.
COARSE = {"shell": {"mesh": {"shape": "torus", "divisions": [24, 12]}, "thickness": 0.2,
                    "tiles": [3, 2], "material": {"builtin": "fur", "size": [16, 16, 8]}},
          "quality": {"samples": 4}}
TINY = scene(side=48, objects=[COARSE])
# A ray of the reference visits every voxel that it crosses, here thousands; a path takes few steps.
FOREVER = scene(side=128, objects=[{
    "shell": {"mesh": {"shape": "sphere"}, "thickness": 0.5, "tiles": [1000, 500],
              "material": {"builtin": "fur"}}, "quality": {"samples": 1}}])
# The two files of its picture fit in no MiB: hair is noise, which does not compress.
LARGE = scene(side=320)
NAMES = ["picture.png", "picture.exr", "reference.png", "reference.exr", "error.exr", "error.png",
         "flip.png", "report.json"]
STAMP = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z")


def post(daemon, document, path="/v1/jobs", **headers):
    return daemon.post(document, path=path, accept="application/json", **headers)


def submit(daemon, document, **headers):
    reply = post(daemon, document, **headers)
    assert reply.status == 202, (reply.status, reply.body)
    assert reply.headers["Location"] == "/v1/jobs/" + reply.json()["id"], reply.headers
    return reply.headers["Location"]


def look(daemon, where):
    reply = daemon.get(where)
    assert reply.status == 200, (reply.status, reply.body)
    return reply.json()


def until_state(daemon, where, *states):
    daemon.until(lambda: look(daemon, where)["state"] in states, f"{where} is {states}")
    return look(daemon, where)


def until_runs(daemon, where, what="reference"):
    daemon.until(lambda: look(daemon, where)["progress"]["what"] == what, f"{where} is at {what}")


def children(daemon, word="job"):
    """Its workers; or its other processes, whatever state they are in: one that is dying has no
    words any more."""
    found = []
    for pid in daemon.worker_pids():
        try:
            with open(f"/proc/{pid}/cmdline") as file:
                is_worker = file.read().split("\0")[1:2] == ["worker"]
        except FileNotFoundError:
            continue
        if is_worker == (word == "worker"):
            found.append(pid)
    return found


def test_a_whole_life():
    """From 202 to 404; what comes out is what the command line makes of the same scene."""
    with Daemon("--workers", "1") as daemon, tempfile.TemporaryDirectory() as folder:
        assert children(daemon) == []
        reply = post(daemon, TINY, **{"X-Request-Id": "tiny"})
        assert reply.status == 202, reply.body
        told = reply.json()
        where = reply.headers["Location"]
        assert re.fullmatch("[0-9a-f]{32}", told["id"]), told
        assert told["kind"] == "reference" and told["results"] == [], told
        assert told["state"] in ("queued", "running") and told["finished"] is None, told
        told = until_state(daemon, where, "done")
        assert told["progress"]["share"] == 1 and told["progress"]["done"] == 48 * 48, told
        assert told["progress"]["elapsed_s"] > 0 and told["progress"]["left_s"] is None, told
        assert "error" not in told, told
        stamps = [told[name] for name in ("created", "started", "finished")]
        assert all(map(STAMP.fullmatch, stamps)) and stamps == sorted(stamps), stamps
        assert [row["name"] for row in told["results"]] == NAMES, told
        daemon.until(lambda: children(daemon) == [], "the process has ended")

        files = {}
        for row in told["results"]:
            got = daemon.get(row["href"])
            assert got.status == 200 and len(got.body) == row["bytes"], (row, got.status)
            assert got.headers["Content-Type"] == row["media_type"], (row, got.headers)
            files[row["name"]] = got.body
            with open(os.path.join(folder, "job-" + row["name"]), "wb") as file:
                file.write(got.body)
        head = daemon.request("HEAD", where + "/result/reference.exr")
        assert head.body == b"" and head.headers["Content-Length"] == str(
            len(files["reference.exr"])), head.headers

        # The main result, by Accept.
        for accept, name in [("image/png", "reference.png"), ("*/*", "reference.png"),
                             ("image/x-exr", "reference.exr"), ("application/json", "report.json"),
                             ("image/png;q=0.1, image/x-exr", "reference.exr")]:
            got = daemon.get(where + "/result", Accept=accept)
            assert (got.status, got.body) == (200, files[name]), (accept, got.status)
            assert got.headers["Vary"] == "Accept", got.headers
        got = daemon.get(where + "/result", Accept="text/html")
        assert (got.status, got.slug()) == (406, "not-acceptable"), got.body

        # The same bytes as POST /v1/render and pelt reference.
        assert daemon.post(TINY).body == files["picture.png"]
        assert daemon.post(TINY, accept="image/x-exr").body == files["picture.exr"]
        with open(os.path.join(folder, "scene.json"), "w") as file:
            json.dump(TINY, file)

        def pelt(*arguments):
            return subprocess.run([os.path.abspath(PELT), "reference", "scene.json", *arguments],
                                  cwd=folder, check=True, capture_output=True, text=True).stdout
        pelt("-o", "reference.png")
        printed = pelt("-o", "reference.exr", "--compare", "job-picture.exr", "--flip-map", "flip.png")
        for name in ["reference.png", "reference.exr", "flip.png"]:
            with open(os.path.join(folder, name), "rb") as file:
                assert file.read() == files[name], name

        # The same errors, to the digits that are printed.
        report = json.loads(files["report.json"])
        errors = report["errors"]
        for name in ["touched", "whole"]:
            row = errors[name]
            line = (f"  {name:<8} {row['pixels']:9d} pixels  rmse {row['rmse']:.3e}"
                    f"  largest {row['max_abs']:.3e}  p99 {row['p99']:.3e}\n")
            assert line in printed, (line, printed)
        line = (f"{errors['coverage']} pixels  psnr {errors['psnr_db']:.2f} dB"
                f"  flip {errors['flip']:.5f}")
        assert line in printed, (line, printed)
        assert 0 < errors["whole"]["rmse"] < 0.1 and errors["not_finite"] == 0, errors
        assert report["reference"]["time_s"] > 0 and report["reference"]["unresolved"] == 0, report
        assert report["report"]["plan"]["passes"], report
        white = report["maps"]["error_png_white"]
        # The power of two that is not below the largest error of a pixel.
        assert math.frexp(white)[0] == 0.5, white
        assert errors["whole"]["p99"] <= white < 2 * errors["whole"]["max_abs"], (white, errors)

        log = daemon.log()
        for event in ["job queued", "job started", "job done"]:
            assert re.search(rf'{event} .*id="tiny" job="{told["id"]}"', log), (event, log)
        assert daemon.request("DELETE", where).status == 204
        for reply in [daemon.request("DELETE", where), daemon.get(where),
                      daemon.get(where + "/result"), daemon.get(where + "/result/flip.png")]:
            assert (reply.status, reply.slug()) == (404, "not-found"), reply.body
        rows = daemon.metrics()
        assert rows['pelt_jobs_total{state="done"}'] == 1 and rows["pelt_job_seconds_count"] == 1
        assert rows["pelt_job_seconds_sum"] > 0 and rows["pelt_job_result_bytes"] == 0, rows


def test_assets_and_the_list():
    document = scene(side=24, objects=[{"mesh": {"asset": "t.glb"}}])
    parts = [("scene", document), ("t.glb", glb(TETRAHEDRON, TETRAHEDRON_FACES))]
    with Daemon("--workers", "1") as daemon:
        assert daemon.get("/v1/jobs").json() == {"jobs": []}
        reply = daemon.post_parts(parts, path="/v1/jobs?kind=reference", accept="*/*")
        assert reply.status == 202, reply.body
        first = reply.headers["Location"]
        second = submit(daemon, TINY)
        listed = daemon.get("/v1/jobs").json()["jobs"]
        assert ["/v1/jobs/" + row["id"] for row in listed] == [first, second], listed
        # In order, and one at a time.
        until_state(daemon, second, "done")
        rows = [look(daemon, where) for where in (first, second)]
        assert rows[0]["state"] == "done" and rows[0]["finished"] <= rows[1]["started"], rows
        picture = daemon.get(first + "/result/picture.png").body
        assert picture == daemon.post_parts(parts).body
        errors = daemon.get(first + "/result/report.json").json()["errors"]
        assert errors["touched"]["pixels"] > 50 and errors["coverage"] < 20, errors


def test_progress_rises_and_delete_ends_the_process():
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, FOREVER)
        waiting = submit(daemon, FOREVER)
        until_runs(daemon, where)
        shares = [look(daemon, where)["progress"]["share"]]

        def rises():
            shares.append(look(daemon, where)["progress"]["share"])
            return shares[-1] > shares[0]
        daemon.until(rises, "progress")
        assert shares == sorted(shares) and 0 < shares[-1] < 1, shares
        told = look(daemon, where)
        assert told["state"] == "running" and told["progress"]["left_s"] > 0, told
        assert told["progress"]["total"] == 128 * 128, told
        assert look(daemon, waiting)["progress"]["what"] == "waiting"
        pids = children(daemon)
        assert len(pids) == 1, pids
        with open(f"/proc/{pids[0]}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        assert fields[16] == "19", fields  # nice
        with open(f"/proc/{pids[0]}/limits") as file:
            assert re.search(r"Max core file size +0 ", file.read())

        for path in ["/result", "/result/picture.png"]:  # too early
            for early in (where, waiting):
                reply = daemon.get(early + path)
                assert (reply.status, reply.slug()) == (409, "not-done"), reply.body
                assert int(reply.headers["Retry-After"]) >= 1, reply.headers
        assert daemon.request("DELETE", waiting).status == 204
        deleted_s = time.monotonic()
        assert daemon.request("DELETE", where).status == 204
        daemon.until(lambda: children(daemon) == [], "the process ends")
        assert not os.path.exists(f"/proc/{pids[0]}")
        print(f"the process ended {time.monotonic() - deleted_s:.3f} s after DELETE")
        for gone in (where, waiting):
            assert look(daemon, gone)["state"] == "cancelled"
            assert daemon.request("DELETE", gone).status == 404
            assert daemon.get(gone + "/result").status == 404
        rows = daemon.metrics()
        assert rows['pelt_jobs_total{state="cancelled"}'] == 2, rows
        assert rows["pelt_job_result_bytes"] == 0 and rows["pelt_job_crashes_total"] == 0, rows
        until_state(daemon, submit(daemon, TINY), "done")


def test_a_sweep():
    """POST /v1/sweep gives what `pelt sweep` gives of the same scene, but for its times."""
    with Daemon("--workers", "1") as daemon, tempfile.TemporaryDirectory() as folder:
        where = daemon.post(TINY, path="/v1/sweep?quality=4,8&repeats=2", accept="application/json")
        assert where.status == 202, where.body
        where = where.headers["Location"]
        assert look(daemon, where)["kind"] == "sweep"
        job = until_state(daemon, where, "done", "failed")
        assert job["state"] == "done", job
        assert [row["name"] for row in job["results"]] == [
            "sweep.json", "sweep.csv", "sweep.html", "reference.png", "reference.exr"]
        with open(os.path.join(folder, "scene.json"), "w") as file:
            json.dump(TINY, file)
        subprocess.run([PELT, "sweep", os.path.join(folder, "scene.json"), "--quality", "4,8",
                        "--repeats", "2", "-o", folder, "--quiet"], check=True, timeout=120)
        with open(os.path.join(folder, "sweep.json")) as file:
            here = json.load(file)
        there = daemon.get(where + "/result", Accept="application/json").json()
        for a, b in zip(here["series"], there["series"], strict=True):
            assert a["name"] == b["name"] and a["model"] == b["model"]
            for p, q in zip(a["points"], b["points"], strict=True):
                assert p["quality"] == q["quality"] and p["error"] == q["error"]
        with open(os.path.join(folder, "reference.exr"), "rb") as file:
            assert file.read() == daemon.get(where + "/result/reference.exr").body
        assert daemon.get(where + "/result", Accept="text/html").body[:15].lower() == b"<!doctype html>"
        assert daemon.get(where + "/result", Accept="text/csv").body.count(b"\n") >= 5
        for query, word in (("quality=4,x", "quality"), ("quality=0", "quality"), ("depth=3", "depth"),
                            ("series=none", "none"), ("repeats=0", "repeats"), ("pixels=few", "pixels"),
                            ("threads=64", "threads"), ("quality=", "quality")):
            reply = daemon.post(TINY, path="/v1/sweep?" + query, accept="application/json")
            assert reply.status == 400 and word in reply.body.decode(), (query, reply.body)
        # Deleted at once, whatever it is at.
        where = daemon.post(FOREVER, path="/v1/sweep", accept="application/json").headers["Location"]
        until_runs(daemon, where, look(daemon, where)["progress"]["what"])
        assert daemon.request("DELETE", where).status == 204
        daemon.until(lambda: not children(daemon), "no process is left")


def test_methods_and_names():
    with Daemon("--workers", "1") as daemon:
        nowhere = "/v1/jobs/" + "0" * 32
        for method, path, status, allow in [
                ("GET", nowhere, 404, None), ("DELETE", nowhere, 404, None),
                ("GET", nowhere + "/result", 404, None), ("GET", nowhere + "/result/x", 404, None),
                ("GET", "/v1/jobs/", 404, None), ("GET", "/v1/jobs/x/y", 404, None),
                ("GET", "/v1/jobs/" + "x" * 70, 404, None), ("GET", nowhere + "/result/", 404, None),
                ("GET", nowhere + "/result/x/y", 404, None),
                ("DELETE", "/v1/jobs", 405, "GET, HEAD, POST"),
                ("POST", nowhere, 405, "GET, HEAD, DELETE"),
                ("PUT", nowhere, 405, "GET, HEAD, DELETE"),
                ("DELETE", nowhere + "/result", 405, "GET, HEAD"),
                ("POST", nowhere + "/result/x", 405, "GET, HEAD"),
                ("POST", "/v1/jobs", 415, None)]:
            reply = daemon.request(method, path)
            assert reply.status == status, (method, path, reply.status, reply.body)
            assert reply.headers["Allow"] == allow, (method, path, reply.headers)
        assert daemon.get("/v1/jobs", Accept="text/html").status == 406
        assert post(daemon, TINY, path="/v1/jobs").status == 202


def test_what_is_refused():
    with Daemon("--workers", "1") as daemon:
        later = scene(objects=[{"skeleton": {"builtin": "elm"}}, {"skeleton": {"builtin": "pine"}}])
        for document, status, slug, pointers in [
                ("", 400, "bad-json", [""]), ("{", 400, "bad-json", None),
                ({"image": {"width": 0}, "objects": [SHELL], "x": 1}, 422, "invalid-scene",
                 ["/image/width", "/x"]),
                (scene(side=8192, samples=256), 422, "too-complex", None),
                (scene(objects=[{"mesh": {"asset": "none.glb"}}]), 422, "asset-not-found",
                 ["/objects/0/mesh/asset"]),
                (later, 501, "not-implemented",
                 ["/objects/0/skeleton", "/objects/1/skeleton"])]:
            reply = post(daemon, document)
            assert (reply.status, reply.slug()) == (status, slug), (document, reply.body)
            if pointers is not None:
                told = [error["pointer"] for error in reply.json()["errors"]]
                assert sorted(told) == sorted(pointers), reply.body
        for query in ["kind=bake", "kind=", "kind=reference&kind=reference", "samples=4",
                      "kind=reference&x=y", "a%0Ab=c", "x=" + "y" * 1100]:
            reply = post(daemon, TINY, path="/v1/jobs?" + query)
            assert (reply.status, reply.slug()) == (400, "bad-request"), (query, reply.body)
        assert daemon.get("/v1/jobs").json() == {"jobs": []}
        assert daemon.metric('pelt_jobs_total{state="failed"}') == 0


def test_an_asset_that_cannot_be_read_fails_the_job():
    """What only its process can find out is told in the job, with the pointer."""
    document = scene(side=24, objects=[{"mesh": {"asset": "t.glb"}}])
    kind, body = multipart([("scene", document), ("t.glb", b"no glTF at all")])
    with Daemon("--workers", "1") as daemon:
        reply = daemon.request("POST", "/v1/jobs", body, {"Content-Type": kind, "X-Request-Id": "r"})
        assert reply.status == 202, reply.body
        told = until_state(daemon, reply.headers["Location"], "failed")
        error = told["error"]
        assert error["type"] == "/problems/bad-asset" and error["request_id"] == "r", told
        assert error["errors"][0]["pointer"] == "/objects/0/mesh/asset", told
        reply = daemon.get("/v1/jobs/" + told["id"] + "/result")
        assert (reply.status, reply.slug()) == (404, "not-found"), reply.body
        assert daemon.metric('pelt_jobs_total{state="failed"}') == 1
        assert daemon.request("DELETE", "/v1/jobs/" + told["id"]).status == 204


def test_a_full_queue():
    with Daemon("--workers", "1", "--jobs-queue", "2") as daemon:
        running = submit(daemon, FOREVER)
        until_state(daemon, running, "running")
        waiting = [submit(daemon, TINY) for _ in range(2)]
        reply = post(daemon, TINY)
        assert (reply.status, reply.slug()) == (503, "queue-full"), reply.body
        assert int(reply.headers["Retry-After"]) >= 1, reply.headers
        daemon.check_good()  # pictures have a queue of their own
        assert daemon.request("DELETE", waiting[0]).status == 204
        assert post(daemon, TINY).status == 202
        rows = daemon.metrics()
        assert rows['pelt_jobs{state="queued"}'] == 2 and rows['pelt_jobs{state="running"}'] == 1


def test_crashes():
    """A process that dies of what a scene can cause fails its job, and the second time the scene is
    refused, as with workers. One that is killed from outside is tried once more."""
    with Daemon("--workers", "1") as daemon:
        workers = children(daemon, "worker")
        for crashes, deadly in enumerate([signal.SIGSEGV, signal.SIGABRT], 1):
            where = submit(daemon, FOREVER)
            until_runs(daemon, where)
            os.kill(children(daemon)[0], deadly)
            told = until_state(daemon, where, "failed")
            assert told["error"]["type"] == "/problems/worker-crashed", told
            assert f"signal {int(deadly)}" in told["error"]["detail"] and told["results"] == [], told
            assert daemon.metric("pelt_job_crashes_total") == crashes
        for path in ["/v1/jobs", "/v1/render"]:
            reply = post(daemon, FOREVER, path=path)
            assert (reply.status, reply.slug()) == (422, "quarantined"), reply.body
            assert int(reply.headers["Retry-After"]) > 3000, reply.headers

        other = {**FOREVER, "ambient": [0.2, 0.2, 0.2]}
        where = submit(daemon, other)
        until_runs(daemon, where)
        pids = children(daemon)
        os.kill(pids[0], signal.SIGKILL)
        daemon.until(lambda: children(daemon) not in ([], pids), "another process")
        until_runs(daemon, where)
        assert daemon.metric("pelt_job_retries_total") == 1
        os.kill(children(daemon)[0], signal.SIGKILL)
        told = until_state(daemon, where, "failed")
        assert "2 of 2 attempts" in told["error"]["detail"], told
        assert daemon.metric("pelt_quarantined_scenes") == 1  # outside kills do not count
        daemon.check_good()
        assert children(daemon, "worker") == workers, "workers are not concerned"
        until_state(daemon, submit(daemon, TINY), "done")


def test_too_slow():
    with Daemon("--workers", "1", "--job-timeout-s", "1") as daemon:
        where = submit(daemon, FOREVER)
        told = until_state(daemon, where, "failed")
        assert told["error"]["type"] == "/problems/deadline", told
        assert told["progress"]["elapsed_s"] >= 1, told
        daemon.until(lambda: children(daemon) == [], "the process ends")
        # Stopped is as bad as slow.
        where = submit(daemon, FOREVER)
        daemon.until(lambda: children(daemon), "a process")
        os.kill(children(daemon)[0], signal.SIGSTOP)
        until_state(daemon, where, "failed")
        assert daemon.metric("pelt_quarantined_scenes") == 0


def test_results_expire():
    with Daemon("--workers", "1", "--jobs-keep-s", "1") as daemon:
        where = submit(daemon, TINY)
        daemon.until(lambda: daemon.get(where).status == 410, "it expires")
        for path in ["", "/result", "/result/flip.png"]:
            reply = daemon.get(where + path)
            assert (reply.status, reply.slug()) == (410, "gone"), reply.body
        assert daemon.request("DELETE", where).status == 410
        assert daemon.metric("pelt_jobs_expired_total") == 1
        assert daemon.get("/v1/jobs").json() == {"jobs": []}
        assert daemon.metric("pelt_job_result_bytes") == 0


def test_results_that_are_too_large():
    """More than is kept of all jobs together: the job fails, with the limit in its error."""
    with Daemon("--workers", "1", "--jobs-keep-mib", "1") as daemon:
        told = until_state(daemon, submit(daemon, LARGE), "failed")
        assert told["error"]["type"] == "/problems/too-complex", told
        assert str(1 << 20) in told["error"]["detail"], told
        daemon.until(lambda: children(daemon) == [], "the process ends")
        assert daemon.metric("pelt_job_result_bytes") == 0
        until_state(daemon, submit(daemon, TINY), "done")


def test_sigterm_cancels():
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, FOREVER)
        submit(daemon, FOREVER)
        until_runs(daemon, where)
        pids = children(daemon)
        start_s = time.monotonic()
        daemon.process.terminate()
        assert daemon.process.wait(PATIENCE_S) == 0, daemon.log()
        print(f"stopped after {time.monotonic() - start_s:.3f} s")
        assert "jobs_cancelled=2" in daemon.log(), daemon.log()
        assert not os.path.exists(f"/proc/{pids[0]}")


def test_the_process_ends_with_the_front():
    with Daemon("--workers", "1") as daemon:
        until_runs(daemon, submit(daemon, FOREVER))
        pid = children(daemon)[0]
        os.kill(pid, signal.SIGSTOP)  # it cannot find out by itself that its socket is closed
        daemon.process.kill()
        daemon.process.wait()
        deadline = time.monotonic() + PATIENCE_S
        while os.path.exists(f"/proc/{pid}") and \
                open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()[0] != "Z":
            assert time.monotonic() < deadline, "it outlives the front"
            time.sleep(0.02)


def test_a_client_that_hangs_up():
    with Daemon("--workers", "1") as daemon:
        client = daemon.send(TINY, path="/v1/jobs")
        reply = read_reply(client)
        assert reply.status == 202, reply.body
        client.close()
        until_state(daemon, reply.headers["Location"], "done")


def test_pictures_do_not_wait():
    """A picture is drawn while a job runs, and the job goes on."""
    with Daemon("--workers", "1") as daemon:
        where = submit(daemon, FOREVER)
        until_runs(daemon, where)
        before = daemon.post(SMALL).body
        replies = []
        threads = [threading.Thread(target=lambda: replies.append(daemon.post(SMALL)))
                   for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert [reply.status for reply in replies] == [200] * 4, replies
        assert all(reply.body == before for reply in replies)
        assert look(daemon, where)["state"] == "running"
        waiting = daemon.send(ENDLESS)
        daemon.until_busy()
        assert look(daemon, where)["state"] == "running"
        waiting.close()


def test_capabilities():
    with Daemon("--workers", "1", "--jobs-queue", "3", "--jobs-keep-s", "7",
                "--jobs-keep-mib", "2", "--job-timeout-s", "9") as daemon:
        told = daemon.get("/v1/capabilities").json()["jobs"]
        assert {"name": "reference", "route": "/v1/jobs"} in told["kinds"], told
        assert (told["queue"], told["keep_s"], told["keep_bytes"], told["timeout_s"]) == \
            (3, 7, 2 << 20, 9), told


main(globals())
