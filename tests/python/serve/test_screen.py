"""The operator's screen in a real browser: every state shows as what it is, and what is old never looks new."""

import dataclasses
import re
import time

import numpy as np
import pytest

from debulk import Report, Verdict, rings

WIDE = {"width": 1920, "height": 1080}
STATE = "document.documentElement.dataset.state"
WORD = "document.getElementById('word').textContent"


@pytest.fixture
def screen(browser, running):
    """Open the screen of a service on which nothing was inspected."""
    service = running()
    browser.open(service.url, **WIDE)
    wait(browser, f"{STATE} === 'nothing'")
    yield browser, service
    browser.open("about:blank")


def wait(browser, condition, most_s=15):
    end = time.monotonic() + most_s
    while not browser.run(condition):
        assert time.monotonic() < end, (condition, browser.run(STATE))
        time.sleep(0.05)
    browser.settle()


def inspected(browser, service, report, **asked):
    service.quick.report = report
    service.done(service.post(**asked))
    wait(browser, f"{STATE} === '{report.verdict.name}'")


def colour(browser, selector, name="background-color"):
    return browser.run(f"getComputedStyle(document.querySelector('{selector}')).getPropertyValue('{name}')")


def test_nothing_was_inspected_yet(screen):
    browser, _ = screen
    assert browser.run(WORD) == "NO SCAN YET"
    assert browser.complaints == []


def test_each_verdict_has_its_word_its_sign_and_its_colour_and_comes_by_itself(screen, report):
    browser, service = screen
    colours = set()
    for verdict in Verdict:
        pockets = report.pockets if verdict is Verdict.CREASE else ()
        shown = dataclasses.replace(report, verdict=verdict, reason=f"because of {verdict.name}", pockets=pockets)
        inspected(browser, service, shown, part="A-17", ply="3")
        assert browser.run(WORD) == verdict.name
        assert browser.run("document.getElementById('what').textContent") == "A-17, ply 3"
        assert re.fullmatch(r"\d+ s ago", browser.run("document.getElementById('age').textContent"))
        assert browser.run("document.querySelector('h1').scrollWidth <= document.querySelector('h1').clientWidth")
        colours.add(colour(browser, "header"))
    assert len(colours) == len(Verdict)
    assert browser.run("document.querySelectorAll('#last li').length") == len(Verdict)
    assert browser.complaints == []


def test_what_to_do_can_be_read_from_three_metres(screen, report):
    """16 minutes of arc are 14 mm at 3 m: capitals of 0.72 of the font's height on a screen 400 mm high."""
    browser, service = screen
    inspected(browser, service, report, part="A-17")
    for selector in ("h1", "#what", "#do li"):
        pixels = float(colour(browser, selector, "font-size").removesuffix("px"))
        assert 0.72 * pixels / 1080 * 400 >= 14
    deeds = browser.run("document.getElementById('do').innerText")
    assert "scan again" in deeds and "(610, 130) mm" in deeds
    numbers = browser.run("[...document.querySelectorAll('#map text')].map(text => text.textContent)")
    bad = [str(pocket.id) for pocket in report.pockets if pocket.verdict is not Verdict.CEASE]
    assert sorted(filter(None, numbers)) == sorted(bad)  # the numbers that reason and checklist name
    assert browser.run("document.getElementById('do').scrollHeight <= document.getElementById('do').clientHeight")
    assert re.search(r"and \d+ more", deeds)
    assert browser.run("document.querySelectorAll('#map polygon').length") == 1
    low, high = report.ply_outline_mm.min(axis=0), report.ply_outline_mm.max(axis=0)
    window = low + np.array([(0.4, 0.4), (0.6, 0.4), (0.6, 0.6)]) * (high - low)
    cut = dataclasses.replace(report, ply_outline_mm=rings.outline([report.ply_outline_mm, window], "ply_outline"))
    inspected(browser, service, cut, part="A-18")
    wait(browser, "document.querySelectorAll('#map polygon').length === 2")
    assert colour(browser, "#map polygon ~ polygon", "fill") == colour(browser, "html")
    sizes = browser.run("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert sizes[0] <= 1920 and sizes[1] <= 1080


def test_while_a_scan_is_inspected_the_last_verdict_is_not_shown_as_its(screen):
    browser, service = screen
    inspected(browser, service, service.quick.report)
    service.quick.gate.clear()
    service.post(part="B-2")
    wait(browser, f"{STATE} === 'running'")
    assert browser.run(WORD) == "INSPECTING"
    assert browser.run("document.getElementById('what').textContent") == "B-2"
    service.quick.gate.set()
    wait(browser, f"{STATE} === 'CEASE'")


def test_a_lost_connection_shows_and_heals(screen):
    browser, service = screen
    inspected(browser, service, service.quick.report, part="A-17")
    new = colour(browser, "header")
    service.stop()
    wait(browser, f"{STATE} === 'lost'")
    assert "CONNECTION LOST" in browser.run("document.getElementById('alarm').innerText")
    assert colour(browser, "header") != new
    assert "line-through" in colour(browser, "h1", "text-decoration-line")
    service.start()  # another run: it knows nothing of the verdict before
    wait(browser, f"{STATE} === 'nothing'", 30)
    assert browser.run(WORD) == "NO SCAN YET"


def test_an_old_verdict_loses_its_colour(screen):
    browser, service = screen
    inspected(browser, service, service.quick.report)
    new = colour(browser, "header")
    newest = next(reversed(service.service.results))
    old = dataclasses.replace(service.service.results[newest], finished_utc="2020-01-01T00:00:00.000Z")
    service.service.results[newest] = old
    wait(browser, "document.documentElement.hasAttribute('data-old')")
    assert colour(browser, "header") != new


def test_a_name_from_outside_is_text(screen):
    browser, service = screen
    hostile = "<img src=x onerror='window.hacked=1'>"
    inspected(browser, service, Report(verdict=Verdict.INVALID, reason=hostile, pockets=()), part=hostile)
    assert browser.run("window.hacked === undefined && document.querySelectorAll('img').length === 0")
    assert browser.complaints == []
