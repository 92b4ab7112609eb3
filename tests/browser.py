"""A headless Chromium, where one is installed, driven through a pipe: nothing else is needed for it."""

import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager

NAMES = (os.environ.get("RIBBONFEM_BROWSER", ""), "chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
SWITCHES = ("--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
# the browser reads at 3 and writes at 4: the pipe goes there, by way of numbers that are neither
START = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])
"""


class Page:
    """A page of a browser: what is evaluated in it, and what it said and asked for by itself."""

    def __init__(self, send, receive):
        self.send, self.receive = send, receive
        self.number, self.session = 0, None
        self.console, self.asked = [], []

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.send.write(json.dumps(message).encode() + b"\0")
        self.send.flush()
        while True:
            answer = self._next()
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def _next(self):
        raw = bytearray()
        while (byte := self.receive.read(1)) != b"\0":
            assert byte, "the browser has gone"
            raw += byte
        told = json.loads(raw)
        said, more = told.get("method"), told.get("params")
        if said == "Runtime.exceptionThrown":
            self.console.append(more["exceptionDetails"])
        elif said == "Runtime.consoleAPICalled":
            self.console.append(more["args"])
        elif said == "Log.entryAdded" and more["entry"]["level"] == "error":
            self.console.append(more["entry"])
        elif said == "Network.requestWillBeSent":
            self.asked.append(more["request"]["url"])
        return told

    def evaluate(self, text):
        result = self.call("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")


@contextmanager
def opened(path, folder, width, height=844, *switches):
    """A page of a file, in a window of that width; `folder` is the browser's own."""
    to_read, to_send = os.pipe()
    to_receive, to_write = os.pipe()
    words = [BROWSER, *SWITCHES, *switches, f"--user-data-dir={folder}", "--remote-debugging-pipe"]
    start = [sys.executable, "-c", START, str(to_read), str(to_write), *words]
    process = subprocess.Popen(start, pass_fds=(to_read, to_write), stderr=subprocess.DEVNULL)
    os.close(to_read)
    os.close(to_write)
    with os.fdopen(to_send, "wb") as send, os.fdopen(to_receive, "rb") as receive:
        page = Page(send, receive)
        try:
            target = page.call("Target.createTarget", url="about:blank")["targetId"]
            page.session = page.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            for domain in ("Runtime", "Log", "Network", "Page"):
                page.call(f"{domain}.enable")
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
            page.call("Emulation.setDeviceMetricsOverride", **size)
            page.call("Page.navigate", url=path.as_uri())
            while page._next().get("method") != "Page.loadEventFired":
                pass
            yield page
        finally:
            process.terminate()
            process.wait(timeout=30)
