"""A real browser for the tests of the pages.

Chromium is driven by its DevTools protocol over two pipes: JSON, each message ended by a zero byte. Where it is not
installed (Debian: apt-get install chromium) its tests are skipped; .ci/run installs it.
"""

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import time

import cv2
import numpy as np
import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-sandbox",  # as root it starts only so
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--hide-scrollbars",
)
PATIENCE_S = 60.0


class Browser:
    """One Chromium, one page, and everything that it complained of."""

    def __init__(self, folder):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()

        def wire():  # the protocol's descriptors are 3 and 4; copies first, for one pipe may sit on the other's number
            a, b = os.dup(theirs_in), os.dup(theirs_out)
            os.dup2(a, 3)
            os.dup2(b, 4)

        self.process = subprocess.Popen(
            [CHROMIUM, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
            preexec_fn=wire, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(theirs_in)
        os.close(theirs_out)
        self.inbox, self.outbox, self.rest = ours_in, ours_out, b""
        self.numbers, self.session, self.complaints, self.events = itertools.count(1), None, [], []
        self.own = ("file:", "data:")
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self.session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self(f"{domain}.enable")

    def __call__(self, method, **parameters):
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self.session is not None:
            message["sessionId"] = self.session
        os.write(self.outbox, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._note(answer)

    def _read(self):
        end = time.monotonic() + PATIENCE_S
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.inbox], [], [], max(0.0, end - time.monotonic()))
            assert ready, "Chromium does not answer"
            data = os.read(self.inbox, 1 << 20)
            assert data, "Chromium has ended"
            self.rest += data
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def _note(self, event):
        self.events.append(event.get("method"))
        what = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown" | "Log.entryAdded":
                self.complaints.append(what)
            case "Runtime.consoleAPICalled" if what["type"] in ("error", "warning", "assert"):
                self.complaints.append(what)
            case "Network.requestWillBeSent" if not what["request"]["url"].startswith(self.own):
                self.complaints.append(what["request"]["url"])

    def open(self, page, width=1200, height=900, scale=1, dark=False, script=True, phone=False):
        """Open a file, by its path, or an address, whose server may be asked for more."""
        address = page if isinstance(page, str) else page.as_uri()
        self.own = ("file:", "data:", *([page] if isinstance(page, str) else []))
        self.complaints.clear()
        self("Emulation.setScriptExecutionDisabled", value=not script)
        self("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
        ])  # fmt: skip
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)
        self("Emulation.setTouchEmulationEnabled", enabled=phone)
        self.events.clear()
        self("Page.navigate", url=address)
        while "Page.loadEventFired" not in self.events:
            self._note(self._read())

    def run(self, script):
        """Value of an expression in the page."""
        out = self("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in out, out
        return out["result"].get("value")

    def settle(self):
        """Wait until two frames have been drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")

    def picture(self, whole=False, clip=None):
        more = {"captureBeyondViewport": True} if whole or clip else {}
        if whole:
            size = self("Page.getLayoutMetrics")["cssContentSize"]
            clip = {"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 16000), "scale": 1}
        if clip:
            more["clip"] = clip
        data = base64.b64decode(self("Page.captureScreenshot", format="png", **more)["data"])
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)

    def pdf(self):
        return base64.b64decode(self("Page.printToPDF", printBackground=False, preferCSSPageSize=True)["data"])

    def press(self, key, shift=False):
        for kind in ("keyDown", "keyUp"):
            text = key if kind == "keyDown" and len(key) == 1 else ""
            self("Input.dispatchKeyEvent", type=kind, key=key, text=text, modifiers=8 * shift)
        self.settle()

    def mouse(self, kind, x, y, **more):
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, **more)

    def close(self):
        self.session = None
        try:
            self("Browser.close")
            self.process.wait(10)
        except (AssertionError, OSError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait(10)
        os.close(self.inbox)
        os.close(self.outbox)


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Return the one Chromium of all tests."""
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed: apt-get install chromium")
    opened = Browser(tmp_path_factory.mktemp("chromium"))
    yield opened
    opened.close()
