#!/usr/bin/python3
"""Starting and stopping."""

import json
import os
import signal
import socket
import subprocess
import tempfile

from harness import ENDLESS, LONG, PATIENCE_S, PELT, SMALL, Daemon, main, read_all, read_reply


def test_sigterm_finishes_what_is_in_flight():
    for stop in [signal.SIGTERM, signal.SIGINT]:
        with Daemon("--workers", "1") as daemon:
            idle = daemon.connect()
            running = daemon.send(LONG)
            daemon.until_busy()
            queued = [daemon.send(SMALL) for _ in range(3)]
            daemon.until(lambda: daemon.metric("pelt_queue_length") == 3, "all wait")
            daemon.process.send_signal(stop)
            assert read_all(idle) == b"", "an idle connection is closed"
            for client in [running, *queued]:
                reply = read_reply(client)
                assert reply.status == 200, reply.body
                assert reply.headers["Connection"] == "close"
            assert daemon.process.wait(PATIENCE_S) == 0, daemon.log()
            try:
                daemon.connect()
                raise AssertionError("it still listens")
            except ConnectionRefusedError:
                pass


def test_second_signal_ends_it_at_once():
    with Daemon("--workers", "1") as daemon:
        running = daemon.send(ENDLESS)
        daemon.until_busy()
        queued = daemon.send(SMALL)
        daemon.until(lambda: daemon.metric("pelt_queue_length") == 1, "it waits")
        daemon.process.terminate()
        daemon.until(lambda: "stopping" in daemon.log(), "it stops")
        daemon.process.terminate()
        assert daemon.process.wait(PATIENCE_S) == 7, daemon.log()
        for client in [running, queued]:
            client.close()


def test_a_body_on_its_way_is_waited_for():
    with Daemon("--workers", "1") as daemon:
        client = daemon.connect()
        client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                       b"Content-Length: 88\r\n\r\n")
        daemon.until(lambda: daemon.metric("pelt_connections") == 2, "it is connected")
        daemon.check_good()
        daemon.process.terminate()
        daemon.until(lambda: "stopping" in daemon.log(), "it stops")
        client.sendall(b"x" * 88)
        assert read_reply(client).status == 400
        assert daemon.process.wait(PATIENCE_S) == 0


def test_address_in_use():
    with Daemon("--workers", "1") as daemon:
        done = subprocess.run([PELT, "serve", "--listen", f"127.0.0.1:{daemon.port}"],
                              capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 1 and "in use" in done.stderr and done.stdout == "", done


def test_no_usable_gl():
    """The daemon says what is missing and ends; it does not restart workers for ever."""
    done = subprocess.run([PELT, "serve", "--listen", "127.0.0.1:0", "--require-hardware"],
                          capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 6 and done.stdout == "", done
    assert "pelt serve: " in done.stderr, done


def test_osmesa_draws_the_same():
    with Daemon("--workers", "1", "--backend", "egl") as egl, \
            Daemon("--workers", "1", "--backend", "osmesa") as osmesa:
        assert egl.post(SMALL).body == osmesa.post(SMALL).body
        assert osmesa.get("/v1/capabilities").json()["renderer"]["backend"] == "osmesa"


def test_systemd_is_told():
    with tempfile.TemporaryDirectory() as folder, \
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        path = os.path.join(folder, "notify")
        manager.bind(path)
        manager.settimeout(PATIENCE_S)
        with Daemon("--workers", "1", environment={"NOTIFY_SOCKET": path}) as daemon:
            assert manager.recv(256) == b"READY=1"
            daemon.check_good()
            daemon.process.terminate()
            assert manager.recv(256) == b"STOPPING=1"


def test_json_log():
    with Daemon("--workers", "1", "--log", "json") as daemon:
        daemon.request("GET", '/a"b%0a\\%ff%c3%a9')
        daemon.until(lambda: '"status":404' in daemon.log(), "the request is logged")
        rows = [json.loads(line) for line in daemon.log().split("\n") if line]
        told = [row for row in rows if row["event"] == "request"][0]
        assert told["path"] == '/a"b\n\\\ufffd\xe9' and told["level"] == "info", told


main(globals())
