"""The map in a real browser: what it says of the place under the cursor, held against the report."""

import re

import numpy as np
import pytest

from debulk import Grid
from debulk.report import Report
from debulk.verdict import Verdict

READOUT = "document.querySelector('.readout').textContent"


@pytest.fixture(scope="module")
def path(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "report.html"
    report.save(path)
    return path


def screen(browser, x, y):
    """Where a point of the mold frame is on the screen, the map scrolled into sight."""
    browser.run("document.querySelector('.map-view').scrollIntoView()")
    browser.settle()
    return browser.run(
        f"(() => {{ const p = new DOMPoint({x}, {-y}).matrixTransform(document.querySelector('.map-view > svg')"
        ".getScreenCTM()); return [p.x, p.y]; })()"
    )


def said(browser):
    """x, y and height that the page says, and the rest of its words."""
    browser.run("new Promise(done => setTimeout(done, 150))")  # the picture is decoded beside the script
    text = browser.run(READOUT).replace("−", "-")
    place = re.match(r"x (-?\d+), y (-?\d+) mm", text)
    height = re.search(r"(-?[\d.]+) mm above the reference", text)
    return (int(place[1]), int(place[2])), float(height[1]) if height else None, text


def height_at(report, x, y):
    """Mean height of a few cells, for the noise is a twentieth of a millimetre."""
    grid = report.height_map
    i, j = round((x - grid.origin_mm[0]) / grid.spacing_mm), round((y - grid.origin_mm[1]) / grid.spacing_mm)
    return float(grid.values[j, i])


@pytest.mark.parametrize("pocket", [2, 3, 4, 7])
def test_the_mouse_reads_place_height_and_pocket(browser, path, report, pocket):
    browser.open(path)
    x, y = report.pocket(pocket).centroid_mm
    u, v = screen(browser, x, y)
    browser("Input.dispatchMouseEvent", type="mouseMoved", x=u, y=v)
    (sx, sy), height, text = said(browser)
    assert (sx, sy) == pytest.approx((x, y), abs=2.0)
    near = [height_at(report, x + dx, y + dy) for dx in (-4, -2, 0, 2, 4) for dy in (-4, -2, 0, 2, 4)]
    assert np.nanmin(near) - 0.1 <= height <= np.nanmax(near) + 0.1
    assert f"pocket {pocket}: {report.pocket(pocket).verdict.name}" in text
    assert browser.complaints == []


def test_where_the_colours_end_it_says_or_more(browser, path, report):
    browser.open(path)
    u, v = screen(browser, *report.pocket(1).centroid_mm)
    browser("Input.dispatchMouseEvent", type="mouseMoved", x=u, y=v)
    assert "15.0 mm high or more" in said(browser)[2] and report.pocket(1).peak_mm == 15.0


def test_low_heights_are_read_as_well_as_high_ones(browser, tmp_path):
    """A ramp of heights beside a peak of 15 mm, read back at four places."""
    values = np.tile(np.linspace(0, 3, 301, dtype=np.float32), (100, 1))
    values[:, 290:] = 15.0
    values[80:, :50] = np.nan
    grid = Grid(values, np.array([-100.0, 50.0]), 1.0)
    Report(verdict=Verdict.CEASE, reason="", pockets=(), height_map=grid).save(tmp_path / "ramp.html")
    browser.open(tmp_path / "ramp.html")
    for x, expected in ((-40, 0.6), (0, 1.0), (100, 2.0), (180, 2.8)):
        u, v = screen(browser, x, 60)
        browser("Input.dispatchMouseEvent", type="mouseMoved", x=u, y=v)
        assert said(browser)[1] == pytest.approx(expected, abs=0.08)
    u, v = screen(browser, -80, 140)
    browser("Input.dispatchMouseEvent", type="mouseMoved", x=u, y=v)
    assert said(browser)[1] is None and "not seen" in said(browser)[2]


def test_a_finger_reads_the_map_and_stays_on_it(browser, path, report):
    """A tap in a pocket reads its height; the page does not leave for the pocket's card."""
    browser.open(path, width=360, phone=True)
    x, y = report.pocket(1).centroid_mm
    u, v = screen(browser, x + 40, y + 25)
    browser("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": u, "y": v}])
    browser("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    browser.settle()
    (sx, sy), height, text = said(browser)
    assert (sx, sy) == pytest.approx((x + 40, y + 25), abs=4) and height > 5 and "pocket 1" in text
    assert browser.run("location.hash") == ""


def test_the_keyboard_walks_over_the_map_and_goes_to_the_pocket(browser, path, report):
    browser.open(path)
    x, y = report.pocket(2).centroid_mm
    u, v = screen(browser, x, y)
    browser("Input.dispatchMouseEvent", type="mouseMoved", x=u, y=v)
    (before, _), _, _ = said(browser)
    browser.run("document.querySelector('.map-view > svg').focus()")
    browser.press("ArrowRight")
    (once, row), _, _ = said(browser)
    browser.press("ArrowLeft", shift=True)
    (back, _), _, _ = said(browser)
    browser.press("ArrowUp")
    (_, higher), _, _ = said(browser)
    assert before < once and once - back == pytest.approx(10 * (once - before), abs=2)
    assert higher > row
    assert browser.run("document.querySelector('.readout').getAttribute('aria-live')") == "polite"
    browser.press("Enter")
    assert browser.run("location.hash") == "#pocket-2"
    assert browser.run("document.querySelector('#pocket-2').getBoundingClientRect().top") < 300


def test_the_numbers_on_the_map_lead_to_the_cards_and_back(browser, path, report):
    browser.open(path)
    for pocket in report.pockets:
        assert browser.run(f"document.querySelector('.to-card[href=\"#pocket-{pocket.id}\"]') !== null")
        back = browser.run(f"document.querySelector('#pocket-{pocket.id} a').getAttribute('href')")
        assert back == f"#map-{pocket.id}" and browser.run(f"document.querySelector('{back}') !== null")


def test_without_its_script_the_map_stands_there_and_promises_nothing(browser, path):
    browser.open(path, script=False)
    browser("Emulation.setScriptExecutionDisabled", value=False)
    assert browser.run("getComputedStyle(document.querySelector('.readout')).display") == "none"
    assert browser.run("document.querySelector('.map-view > svg').getBoundingClientRect().height") > 200
