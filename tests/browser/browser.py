"""Chromium without a screen, driven through its debugging pipe (file descriptors 3 and 4, messages
that end in a 0 byte): what a page looks like to a browser, with nothing but the standard library.

`with Browser() as browser: page = browser.open(path, width=360)`. Nothing is fetched from anywhere."""

import json
import os
import shutil
import subprocess
import sys
import tempfile

FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--disable-dev-shm-usage", "--remote-debugging-pipe"]


def find():
    """Chromium's path; leaves the test as skipped where there is none."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if not path:
        print("no chromium here")
        sys.exit(77)
    return path


class Browser:
    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="pelt-browser-")
        read_3, self.to = os.pipe()
        self.back, write_4 = os.pipe()

        def descriptors():
            # Both ends may lie on 3 or 4 already: out of the way first.
            spare = [os.dup(os.dup(os.dup(read_3))), os.dup(os.dup(os.dup(write_4)))]
            os.dup2(spare[0], 3)
            os.dup2(spare[1], 4)

        self.process = subprocess.Popen(
            [find(), *FLAGS, "--user-data-dir=" + self.folder, "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            close_fds=False, preexec_fn=descriptors)
        os.close(read_3)
        os.close(write_4)
        self.buffer, self.next_id, self.events = b"", 0, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.call("Browser.close")
            self.process.wait(20)
        except (OSError, subprocess.TimeoutExpired, EOFError):
            self.process.kill()
            self.process.wait()
        os.close(self.to)
        os.close(self.back)
        shutil.rmtree(self.folder, ignore_errors=True)

    def receive(self):
        while b"\0" not in self.buffer:
            more = os.read(self.back, 1 << 16)
            if not more:
                raise EOFError("the browser is gone")
            self.buffer += more
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, session=None, **parameters):
        self.next_id += 1
        message = {"id": self.next_id, "method": method, "params": parameters}
        if session:
            message["sessionId"] = session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            reply = self.receive()
            if reply.get("id") == self.next_id:
                if "error" in reply:
                    raise RuntimeError(f"{method}: {reply['error']}")
                return reply["result"]
            self.events.append(reply)

    def open(self, path, width, height=800):
        return Page(self, path, width, height)


class Page:
    def __init__(self, browser, path, width, height):
        self.browser = browser
        target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.call("Target.attachToTarget", targetId=target,
                                    flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=width < 600)
        browser.events.clear()
        self.call("Page.navigate", url="file://" + os.path.abspath(path))
        while not self.seen("Page.loadEventFired"):
            browser.events.append(browser.receive())

    def call(self, method, **parameters):
        return self.browser.call(method, self.session, **parameters)

    def seen(self, *methods):
        """The events of these names so far."""
        return [event["params"] for event in self.browser.events if event.get("method") in methods]

    def complaints(self):
        """What a console would show."""
        return self.seen("Log.entryAdded", "Runtime.exceptionThrown", "Runtime.consoleAPICalled")

    def requests(self):
        return [event["request"]["url"] for event in self.seen("Network.requestWillBeSent")]

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"])
        return result["result"].get("value")
