#!/usr/bin/python3
"""Workers that die or hang: one request pays for it, the daemon never does."""

import os
import signal
import time

from harness import ENDLESS, LONG, Daemon, main, read_reply, scene


def busy_worker(daemon):
    daemon.until_busy()
    return daemon.worker_pids()[0]


def test_killed_from_outside_is_tried_again():
    with Daemon("--workers", "1") as daemon:
        whole = daemon.post(LONG).body
        waiting = daemon.send(LONG)
        os.kill(busy_worker(daemon), signal.SIGKILL)
        reply = read_reply(waiting)
        assert (reply.status, reply.body) == (200, whole), reply.status
        assert daemon.metric("pelt_retries_total") == 1
        assert daemon.metric('pelt_worker_restarts_total{reason="killed"}') == 1
        daemon.check_good()


def test_killed_twice_is_told_but_not_quarantined():
    with Daemon("--workers", "1") as daemon:
        waiting = daemon.send(ENDLESS)
        first = busy_worker(daemon)
        os.kill(first, signal.SIGKILL)
        daemon.until(lambda: daemon.worker_pids() not in ([], [first]), "another worker")
        os.kill(busy_worker(daemon), signal.SIGKILL)
        reply = read_reply(waiting)
        assert (reply.status, reply.slug()) == (500, "worker-crashed"), reply.body
        daemon.check_good()
        waiting = daemon.send(ENDLESS)
        daemon.until_busy()  # it is taken again
        assert daemon.metric("pelt_quarantined_scenes") == 0
        waiting.close()


def test_stopped_in_mid_render_is_a_timeout():
    with Daemon("--workers", "1", "--timeout-ms", "3000") as daemon:
        waiting = daemon.send(ENDLESS)
        os.kill(busy_worker(daemon), signal.SIGSTOP)
        reply = read_reply(waiting)
        assert (reply.status, reply.slug()) == (504, "deadline"), reply.body
        daemon.until_idle(1)  # a new worker; on a busy machine that takes longer than this limit
        daemon.check_good()
        assert daemon.metric('pelt_worker_restarts_total{reason="deadline"}') == 1
        assert daemon.metric("pelt_retries_total") == 0


def test_too_slow_is_a_timeout():
    with Daemon("--workers", "1", "--timeout-ms", "1500") as daemon:
        start = time.monotonic()
        reply = daemon.post(ENDLESS)
        assert (reply.status, reply.slug()) == (504, "deadline"), reply.body
        assert time.monotonic() - start >= 1.5
        daemon.until_idle(1)
        daemon.check_good()


def test_crashing_scene_is_quarantined():
    with Daemon("--workers", "1") as daemon:
        for crash in [signal.SIGSEGV, signal.SIGABRT]:
            waiting = daemon.send(ENDLESS) if crash == signal.SIGSEGV else waiting
            before = busy_worker(daemon)
            os.kill(before, crash)
            daemon.until(lambda: daemon.worker_pids() not in ([], [before]), "another worker")
        reply = read_reply(waiting)
        assert (reply.status, reply.slug()) == (500, "worker-crashed"), reply.body
        assert daemon.metric("pelt_quarantined_scenes") == 1
        assert daemon.metric('pelt_worker_restarts_total{reason="crash"}') == 2
        reply = daemon.post(ENDLESS)
        assert (reply.status, reply.slug()) == (422, "quarantined"), reply.body
        assert 3500 < int(reply.headers["Retry-After"]) <= 3600, reply.headers
        daemon.check_good()
        other = daemon.send(scene(side=2048, samples=4))  # another scene is not meant
        daemon.until_busy()
        other.close()


def test_idle_workers_are_replaced():
    with Daemon("--workers", "2") as daemon:
        daemon.until_idle(2)
        for deadly in [signal.SIGKILL, signal.SIGSEGV, signal.SIGKILL]:
            pids = daemon.worker_pids()
            for pid in pids:
                os.kill(pid, deadly)
            daemon.until(lambda: len(set(daemon.worker_pids()) - set(pids)) == 2, "new workers")
            daemon.until_idle(2)
        daemon.check_good()


def test_workers_end_with_the_front():
    with Daemon("--workers", "2") as daemon:
        pids = daemon.worker_pids()
        waiting = daemon.send(ENDLESS)
        daemon.until_busy()
        daemon.process.kill()
        daemon.process.wait()
        waiting.close()
        deadline = time.monotonic() + 30
        while any(os.path.exists(f"/proc/{pid}") and
                  open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()[0] != "Z"
                  for pid in pids):
            assert time.monotonic() < deadline, "workers outlive the front"
            time.sleep(0.02)


def test_limits_of_a_worker():
    with Daemon("--workers", "1") as daemon:
        with open(f"/proc/{daemon.worker_pids()[0]}/limits") as file:
            limits = dict((line[:26].strip(), line[26:].split()[0]) for line in file)
        assert limits["Max core file size"] == "0", limits
        assert limits["Max address space"] in (str(3 << 30), "unlimited"), limits
        with open(f"/proc/{daemon.worker_pids()[0]}/environ") as file:
            names = [row.split("=")[0] for row in file.read().split("\0")]
        assert "LP_NUM_THREADS" in names


main(globals())
