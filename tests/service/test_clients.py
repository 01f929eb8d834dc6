#!/usr/bin/python3
"""Many clients, and clients that leave."""

import collections
import threading

from harness import ENDLESS, LONG, SMALL, Daemon, main, read_reply, scene


def test_200_at_once_on_a_queue_of_8():
    """Everyone gets an answer: a picture, or 503 with the seconds after which to come again."""
    with Daemon("--workers", "2", "--queue", "8") as daemon:
        daemon.until_idle(2)
        answers, lock = [], threading.Lock()
        together = threading.Barrier(200)
        medium = scene(side=128)

        def client():
            together.wait()
            reply = daemon.post(medium)
            with lock:
                answers.append(reply)
        threads = [threading.Thread(target=client) for _ in range(200)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        count = collections.Counter(reply.status for reply in answers)
        assert len(answers) == 200 and set(count) == {200, 503}, count
        assert count[200] >= 8, count
        for reply in answers:
            assert reply.headers["X-Request-Id"] and reply.headers["Server-Timing"]
            if reply.status == 503:
                assert reply.slug() == "queue-full", reply.body
                assert 1 <= int(reply.headers["Retry-After"]) <= 600, reply.headers
                assert reply.json()["retryable"] is True
        assert len({reply.body for reply in answers if reply.status == 200}) == 1
        daemon.check_good()


def test_retry_after_follows_the_queue():
    with Daemon("--workers", "1", "--queue", "4") as daemon:
        daemon.post(LONG)  # teaches it what a picture takes: far more than 200 ms
        waiting = [daemon.send(ENDLESS)]
        daemon.until_busy()
        waiting += [daemon.send(SMALL) for _ in range(4)]
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 4, "the queue is full")
        reply = daemon.post(SMALL)
        assert (reply.status, reply.slug()) == (503, "queue-full"), reply.body
        # Six pictures of at least (0.8 * 200 + 0.2 * LONG) ms each.
        assert int(reply.headers["Retry-After"]) >= 2, reply.headers
        for client in waiting:
            client.close()
        daemon.until_idle(1)
        daemon.check_good()


def test_hanging_up_frees_the_queue():
    with Daemon("--workers", "1", "--queue", "2") as daemon:
        running = daemon.send(ENDLESS)
        daemon.until_busy()
        queued = [daemon.send(ENDLESS) for _ in range(2)]
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 2, "the queue is full")
        assert daemon.post(SMALL).status == 503
        queued[0].close()
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 1, "a place is free")
        good = daemon.send(SMALL)
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 2, "it is taken")
        queued[1].close()
        running.close()  # work that nobody waits for ends, long before it is done
        assert read_reply(good).status == 200
        assert daemon.metric("pelt_cancelled_total") == 3
        assert daemon.metric('pelt_worker_restarts_total{reason="cancelled"}') == 1
        daemon.check_good()


def test_short_work_is_finished_for_nobody():
    """A worker whose client left gets a moment: killing it would cost more than the picture. On a
    busy machine the moment may be too short for a picture, but not for each of ten."""
    with Daemon("--workers", "1") as daemon:
        daemon.check_good()
        for _ in range(10):
            daemon.until_idle(1)
            daemon.send(SMALL).close()
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 0, "nothing waits")
        daemon.check_good()
        assert daemon.metric("pelt_cancelled_total") > 0
        assert daemon.metric('pelt_worker_restarts_total{reason="cancelled"}') < 10, daemon.log()


def test_waiting_has_an_end():
    with Daemon("--workers", "1", "--timeout-ms", "1000") as daemon:
        clients = [daemon.send(ENDLESS) for _ in range(6)]
        statuses = collections.Counter(read_reply(client).status for client in clients)
        # Each runs into the limit, or has waited for as long as it may.
        assert set(statuses) == {503, 504} and sum(statuses.values()) == 6, statuses
        daemon.until_idle(1)
        daemon.check_good()


def test_two_requests_on_one_connection():
    with Daemon("--workers", "1") as daemon:
        client = daemon.connect()
        for _ in range(3):
            client.sendall(b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n"
                           b"GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n")
            data = b""
            while data.count(b"\r\n\r\n") < 2 or not data.endswith(b"ready\n"):
                data += client.recv(4096)
            assert data.count(b"HTTP/1.1 200 ") == 2, data
        client.close()


main(globals())
