"""The page in a real browser, which no other test asks: it draws, it turns, it fits, and nothing complains.

Chromium is driven by its DevTools protocol over two pipes: JSON, each message ended by a zero byte. Where it is not
installed (Debian: apt-get install chromium) these tests are skipped; .ci/run installs it.
"""

import base64
import dataclasses
import itertools
import json
import os
import re
import select
import shutil
import subprocess
import time

import cv2
import numpy as np
import pytest

from debulk import Grid
from debulk.comparison import Comparison
from debulk.report import Report
from debulk.results.comparison import PocketComparison
from debulk.verdict import Verdict

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
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt-get install chromium")

HOSTILE = "</script><img src=x onerror='window.hacked=1'><script>window.hacked=1</script>\"'`${window.hacked=1}"


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
            case "Network.requestWillBeSent" if not what["request"]["url"].startswith(("file:", "data:")):
                self.complaints.append(what["request"]["url"])

    def open(self, path, width=1200, height=900, scale=1, dark=False, script=True, phone=False):
        self.complaints.clear()
        self("Emulation.setScriptExecutionDisabled", value=not script)
        self("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
        ])  # fmt: skip
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone)
        self("Emulation.setTouchEmulationEnabled", enabled=phone)
        self.events.clear()
        self("Page.navigate", url=path.as_uri())
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


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    opened = Browser(tmp_path_factory.mktemp("chromium"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def pages(report, tmp_path_factory):
    """Return the folder of the pages: a report, and reports at the limits of what can be shown."""
    folder = tmp_path_factory.mktemp("pages")
    report.save(folder / "report.html")
    for verdict in Verdict:
        Report(verdict=verdict, reason="nothing raised", pockets=()).save(folder / f"empty_{verdict}.html")
    hostile = dataclasses.replace(
        report,
        reason=HOSTILE,
        source={HOSTILE: HOSTILE},
        warnings=(HOSTILE,),
        version=HOSTILE,
        recipe={**report.recipe, HOSTILE: {HOSTILE: HOSTILE}},
        timings_ms={HOSTILE: 1.0},
        pockets=tuple(dataclasses.replace(p, reason=HOSTILE) for p in report.pockets),
    )
    hostile.save(folder / "hostile.html")
    many = tuple(dataclasses.replace(report.pockets[k % 5], id=k + 1) for k in range(100))
    dataclasses.replace(report, pockets=many).save(folder / "many.html")
    compared = [
        PocketComparison(
            id=p.id,
            outline_mm=p.outline_mm,
            predicted=p.verdict,
            measured=Verdict.CREASE if p.id % 2 else Verdict.CEASE,
            reason=HOSTILE,
            predicted_rms_mm=p.rms_mm,
            predicted_rms_range_mm=p.rms_range_mm,
            measured_rms_mm=0.2 + 0.03 * p.id,
            predicted_ridge_mm=p.ridge_height_mm,
            measured_peak_mm=0.4 + 0.1 * p.id,
            noise_mm=0.05,
        )
        for p in report.pockets
    ]
    height_map = Grid(report.height_map.values / 10, report.height_map.origin_mm, report.height_map.spacing_mm)
    comparison = Comparison(
        pockets=tuple(compared), max_rms_mm=0.3, max_peak_mm=0.6, laid_height_mm=0.25, height_map=height_map,
        ply_outline_mm=report.ply_outline_mm, warnings=(HOSTILE,),
    )  # fmt: skip
    comparison.save(folder / "comparison.html")
    Comparison(pockets=(), max_rms_mm=0.3, max_peak_mm=0.6).save(folder / "empty_comparison.html")
    return folder


@pytest.mark.parametrize("width", [360, 1200])
@pytest.mark.parametrize(
    "name", ["report", "hostile", "many", "comparison", "empty_comparison", *(f"empty_{v}" for v in Verdict)]
)
def test_nothing_complains_and_nothing_sticks_out(browser, pages, name, width):
    browser.open(pages / f"{name}.html", width=width, phone=width < 500, dark=width < 500)
    browser.settle()
    assert browser.complaints == []
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run("window.hacked === undefined && document.documentElement.classList.contains('scripted')")
    assert len(np.unique(browser.picture()[::4, ::4].astype(np.int32) @ [65536, 256, 1])) > 20


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("script", [False, True])
def test_every_drawing_shows(browser, pages, dark, script):
    """Nothing of map, nets and sections is blank: each has many colours, seen on the screen."""
    browser.open(pages / "report.html", dark=dark)
    where = "svg => { const r = svg.getBoundingClientRect(); return [r.x, r.y + scrollY, r.width, r.height]; }"
    boxes = browser.run(
        f"Array.from(document.querySelectorAll('.map > svg, .net:not(.coarse *), .section-plot'), {where})"
    )
    assert len(boxes) == 1 + 6 * 3
    if not script:
        browser.open(pages / "report.html", dark=dark, script=False)
    whole = browser.picture(whole=True)
    for x, y, width, height in np.array(boxes).round().astype(int).tolist():
        drawing = whole[y : y + height, x : x + width].reshape(-1, 3) // 16
        colours, counts = np.unique(drawing @ [256, 16, 1], return_counts=True)
        assert len(colours) > 8
        assert counts.max() < 0.97 * len(drawing)
    paper = whole[-5:].mean()
    assert paper < 60 if dark else paper > 240


def test_the_coarse_net_waits_behind_its_switch(browser, pages):
    browser.open(pages / "report.html")
    shown = "document.querySelector('#pocket-2 .coarse .net').checkVisibility({contentVisibilityAuto: true})"
    line = "getComputedStyle(document.querySelector('#pocket-2 .net-after')).display"
    assert not browser.run(shown) and browser.run(line) == "none"
    browser.run("document.querySelector('#pocket-2 .coarse summary').click()")
    browser.settle()
    assert browser.run(shown) and browser.run(line) != "none"
    other = line.replace("pocket-2", "pocket-3")
    assert browser.run(other) == "none"


def net_box(browser, pocket):
    browser.run(f"document.querySelector('#pocket-{pocket}').scrollIntoView()")
    browser.settle()
    return browser.run(
        f"(() => {{ const r = document.querySelector('#pocket-{pocket} .net').getBoundingClientRect();"
        " return [r.x, r.y, r.width, r.height]; })()"
    )


def markups(browser, pocket):
    return browser.run(f"Array.from(document.querySelectorAll('#pocket-{pocket} .net'), svg => svg.innerHTML)")


def numbers(markup):
    """Elements with their places, in the order in which they are painted."""
    marks = re.findall(r"<(\w+)([^>]*)>", markup)
    return [(tag, re.findall(r'(?:class|fill)="([^"]*)"', rest), re.findall(r"-?\d+\.\d", rest)) for tag, rest in marks]


def press(browser, key):
    for kind in ("keyDown", "keyUp"):
        browser("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" and len(key) == 1 else "")
    browser.settle()


def mouse(browser, kind, x, y, **more):
    browser("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, **more)


def test_the_script_draws_what_the_still_picture_shows(browser, pages):
    browser.open(pages / "report.html")
    net_box(browser, 2)
    still = markups(browser, 2)
    browser.run("document.querySelector('#pocket-2 .net').focus()")
    press(browser, "Home")
    drawn = markups(browser, 2)
    assert drawn != still  # closing tags: it is the script's
    for a, b in zip(map(numbers, still), map(numbers, drawn), strict=True):
        key = str
        for (tag, look, place), (other_tag, other_look, other_place) in zip(
            sorted(a, key=key), sorted(b, key=key), strict=True
        ):
            assert (tag, look) == (other_tag, other_look)
            assert np.array(place, float) == pytest.approx(np.array(other_place, float), abs=0.11)


def test_the_mouse_turns_both_nets_of_a_pocket_and_no_other(browser, pages):
    browser.open(pages / "report.html")
    x, y, width, height = net_box(browser, 2)
    x, y = x + width / 2, y + height / 2
    seen, others, before = browser.picture(), markups(browser, 3), markups(browser, 2)
    mouse(browser, "mousePressed", x, y, clickCount=1)
    for k in range(1, 6):
        mouse(browser, "mouseMoved", x + 20 * k, y + 6 * k)
    mouse(browser, "mouseReleased", x + 100, y + 30, clickCount=1)
    browser.settle()
    after = markups(browser, 2)
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert np.mean(np.any(seen != browser.picture(), axis=2)) > 0.01
    assert markups(browser, 3) == others
    # Nothing turns when the button is up.
    mouse(browser, "mouseMoved", x, y)
    browser.settle()
    assert markups(browser, 2) == after
    assert browser.complaints == []


def test_a_turned_net_is_a_solid_seen_from_elsewhere(browser, pages, report):
    """From above, the nodes' places are those of the plan, turned and scaled."""
    browser.open(pages / "report.html")
    net_box(browser, 1)
    browser.run("document.querySelector('#pocket-1 [data-deed=above]').click()")
    for _ in range(9):
        browser.run("document.querySelector('#pocket-1 [data-deed=right]').click()")
    browser.settle()
    net = report.pockets[0].net
    drawn = np.array(re.findall(r'<circle cx="(\S+)" cy="(\S+)"', markups(browser, 1)[0]), float) * [1, -1]
    plan = net.nodes_mm[net.kinds == 0, :2]
    spread, expected = (np.linalg.svd(p - p.mean(axis=0))[1] for p in (drawn, plan))
    assert spread / expected == pytest.approx(np.full(2, (spread / expected)[0]), rel=0.01)
    drawn -= drawn.mean(axis=0)
    assert np.ptp(drawn[:, 1]) > np.ptp(drawn[:, 0])  # the long side, which lay across, now runs upwards


def test_keys_and_buttons_turn_and_bring_back(browser, pages):
    browser.open(pages / "report.html")
    net_box(browser, 1)
    browser.run("document.querySelector('#pocket-1 .net').focus()")
    press(browser, "Home")
    start = markups(browser, 1)
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "ArrowRight", "ArrowDown"):
        last = markups(browser, 1)
        press(browser, key)
        assert markups(browser, 1) != last
    assert markups(browser, 1) == start
    for _ in range(40):
        press(browser, "ArrowDown")
    press(browser, "Home")
    assert markups(browser, 1) == start
    caption = "document.querySelector('#pocket-1 .heights').textContent"
    said = browser.run(caption)
    browser.run("document.querySelector('#pocket-1 [data-deed=lower]').click()")
    browser.settle()
    assert browser.run(caption) != said
    browser.run("document.querySelector('#pocket-1 [data-deed=back]').click()")
    browser.settle()
    assert browser.run(caption) == said and markups(browser, 1) == start


def test_a_finger_turns_too(browser, pages):
    browser.open(pages / "report.html", width=360, phone=True)
    x, y, _, height = net_box(browser, 1)
    before = markups(browser, 1)
    browser("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x + 60, "y": y + height / 2}])
    for k in range(1, 9):
        browser("Input.dispatchTouchEvent", type="touchMove", touchPoints=[{"x": x + 60 + 15 * k, "y": y + height / 2}])
    browser("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.settle()
    assert markups(browser, 1) != before


def test_nets_without_a_still_picture_are_drawn_when_they_come_into_sight(browser, pages):
    browser.open(pages / "many.html")
    empty = browser.run("Array.from(document.querySelectorAll('.net:empty'), net => net.closest('article').id)")
    assert len(empty) > 10
    pocket = int(empty[-1].removeprefix("pocket-"))
    net_box(browser, pocket)
    assert all("<path" in markup for markup in markups(browser, pocket))


def test_it_prints(browser, pages):
    browser.open(pages / "report.html")
    pages_of_pdf = browser.pdf()
    assert pages_of_pdf.startswith(b"%PDF") and len(pages_of_pdf) > 50_000
