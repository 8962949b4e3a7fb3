"""The page in a real browser, which no other test asks: it draws, it turns, it fits, and nothing complains."""

import dataclasses
import re

import numpy as np
import pytest

from debulk import Grid
from debulk.chain import Chain
from debulk.chain.anova import crossed
from debulk.chain.record import Figure
from debulk.comparison import Comparison
from debulk.history import History
from debulk.history.page import page as history_page
from debulk.page import difference, stack
from debulk.report import Report
from debulk.results.check_texts import CHECK_TEXTS
from debulk.results.comparison import PocketComparison
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict

HOSTILE = "</script><img src=x onerror='window.hacked=1'><script>window.hacked=1</script>\"'`${window.hacked=1}"


@pytest.fixture(scope="module")
def pages(report, tmp_path_factory):
    """Return the folder of the pages: a report, and reports at the limits of what can be shown."""
    folder = tmp_path_factory.mktemp("pages")
    report.save(folder / "report.html")
    excess = Grid(np.zeros((60, 80), dtype=np.float32), np.array([-80.0, -60.0]), 2.0)
    excess.values[25:35, 30:50] = 1.0
    shear = dataclasses.replace(excess, values=np.full((60, 80), 12.0, dtype=np.float32))
    dataclasses.replace(report, excess_map=excess, shear_map=shear).save(folder / "long.html")
    for verdict in Verdict:
        Report(verdict=verdict, reason="nothing raised", pockets=()).save(folder / f"empty_{verdict}.html")
    checks = tuple(Finding(text.name, Verdict.INVALID, "found") for text in CHECK_TEXTS)
    dataclasses.replace(report, verdict=Verdict.INVALID, findings=checks).save(folder / "checks.html")
    hostile = dataclasses.replace(
        report,
        reason=HOSTILE,
        source={HOSTILE: HOSTILE},
        warnings=(HOSTILE,),
        version=HOSTILE,
        recipe={**report.recipe, HOSTILE: {HOSTILE: HOSTILE}},
        timings_ms={HOSTILE: 1.0},
        left_out=(LeftOut(what=HOSTILE, why=HOSTILE, bound=HOSTILE, place_mm=(300.0, 300.0)),),
        trace=dataclasses.replace(report.trace, context={"part": HOSTILE, HOSTILE: HOSTILE}),
        pockets=tuple(dataclasses.replace(p, reason=HOSTILE) for p in report.pockets),
    )
    hostile.save(folder / "hostile.html")
    layups = [
        stack.Layup(hostile, HOSTILE, "report.html"),
        *(stack.Layup(Report(verdict=v, reason="", pockets=()), f"{v}.json") for v in Verdict),
        stack.Layup(report, "report.json", "report.html"),
    ]
    (folder / "stack.html").write_text(stack.page(layups), encoding="utf-8")
    (folder / "difference.html").write_text(difference.page(hostile, report, (HOSTILE, "b.json")), encoding="utf-8")
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
            predicted_ridges_mm=tuple(line[:, :2] for ridge in p.ridges for line in ridge.lines_mm),
            predicted_place_mm=p.ridges[0].place_spread_mm if p.ridges else None,
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
    history = History(folder / "cell.sqlite")
    history.add_comparison(comparison, hostile)
    for k in range(24):  # control charts have limits from twenty layups on
        history.add(dataclasses.replace(report, trace=dataclasses.replace(report.trace, context={"ply": k})))
    (folder / "history.html").write_text(history_page(history), encoding="utf-8")
    peaks = np.random.default_rng(5).normal(size=(18, 1, 1)) + np.random.default_rng(6).normal(0, 0.05, (18, 2, 5))
    studies = (crossed(1e6 * peaks, "area", "mm²"), crossed(peaks, HOSTILE, "mm", tolerance=0.6))
    chain = Chain(
        name=HOSTILE, made_utc="2026-03-01T12:00:00.000Z", debulk="0.1.0", scans=10, doubts=(HOSTILE,), studies=studies,
        figures=(Figure(name="noise_mm", mean=0.05, sd=0.001, low=0.03, high=0.07),),
    )  # fmt: skip
    chain.save(folder / "chain.html")
    return folder


@pytest.mark.parametrize("width", [360, 1200])
@pytest.mark.parametrize(
    "name",
    [
        "report",
        "hostile",
        "many",
        "comparison",
        "empty_comparison",
        "stack",
        "difference",
        "history",
        "chain",
        *(f"empty_{v}" for v in Verdict),
    ],
)
def test_nothing_complains_and_nothing_sticks_out(browser, pages, name, width):
    browser.open(pages / f"{name}.html", width=width, phone=width < 500, dark=width < 500)
    browser.settle()
    assert browser.complaints == []
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run("window.hacked === undefined && document.documentElement.classList.contains('scripted')")
    assert len(np.unique(browser.picture()[::4, ::4].astype(np.int32) @ [65536, 256, 1])) > 20
    wider = (
        "[...document.querySelectorAll('td, th')].filter(c => c.checkVisibility() && c.scrollWidth > c.clientWidth + 1)"
    )
    assert browser.run(f"{wider}.map(c => c.textContent.slice(0, 80))") == []  # or it stands on the next one
    tracks = "[...document.querySelectorAll('.bars')].map(b => [...b.querySelectorAll('.track')])"
    ends = f"{tracks}.map(t => new Set(t.map(e => Math.round(e.getBoundingClientRect().left))).size)"
    assert max(browser.run(ends), default=1) == 1  # one scale for all bars of a chart


@pytest.mark.parametrize("width", [360, 800, 1200])
def test_a_link_of_the_checklist_keeps_its_line_beside_a_long_sentence(browser, pages, width):
    browser.open(pages / "checks.html", width=width)
    heights = browser.run("[...document.querySelectorAll('.deeds .at a')].map(a => a.getBoundingClientRect().height)")
    assert len(heights) > 10 and max(heights) < 40


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("script", [False, True])
def test_every_drawing_shows(browser, pages, dark, script):
    """Nothing of map, nets and sections is blank: each has many colours, seen on the screen."""
    browser.open(pages / "report.html", dark=dark)
    where = "svg => { const r = svg.getBoundingClientRect(); return [r.x, r.y + scrollY, r.width, r.height]; }"
    unfold = "for (const card of document.querySelectorAll('details.card')) card.open = true"
    browser.run(unfold)
    boxes = browser.run(
        f"Array.from(document.querySelectorAll('.map-view > svg, .net:not(.coarse *), .section-plot'), {where})"
    )
    assert len(boxes) == 1 + 6 * 3
    if not script:
        browser.open(pages / "report.html", dark=dark, script=False)
        browser("Emulation.setScriptExecutionDisabled", value=False)
        browser.run(unfold)
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
    browser.run("document.querySelector('#pocket-2 > details').open = true")
    assert not browser.run(shown) and browser.run(line) == "none"
    browser.run("document.querySelector('#pocket-2 .coarse summary').click()")
    browser.settle()
    assert browser.run(shown) and browser.run(line) != "none"
    other = line.replace("pocket-2", "pocket-3")
    assert browser.run(other) == "none"


def net_box(browser, pocket):
    browser.run(f"document.querySelector('#pocket-{pocket} > details').open = true")
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


def test_the_script_draws_what_the_still_picture_shows(browser, pages):
    browser.open(pages / "report.html")
    net_box(browser, 2)
    still = markups(browser, 2)
    browser.run("document.querySelector('#pocket-2 .net').focus()")
    browser.press("Home")
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
    browser.mouse("mousePressed", x, y, clickCount=1)
    for k in range(1, 6):
        browser.mouse("mouseMoved", x + 20 * k, y + 6 * k)
    browser.mouse("mouseReleased", x + 100, y + 30, clickCount=1)
    browser.settle()
    after = markups(browser, 2)
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert np.mean(np.any(seen != browser.picture(), axis=2)) > 0.01
    assert markups(browser, 3) == others
    # Nothing turns when the button is up.
    browser.mouse("mouseMoved", x, y)
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
    browser.press("Home")
    start = markups(browser, 1)
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "ArrowRight", "ArrowDown"):
        last = markups(browser, 1)
        browser.press(key)
        assert markups(browser, 1) != last
    assert markups(browser, 1) == start
    for _ in range(40):
        browser.press("ArrowDown")
    browser.press("Home")
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


@pytest.mark.parametrize("dark", [False, True])
def test_the_map_shows_where_fibres_are_too_long(browser, pages, dark):
    browser.open(pages / "long.html", dark=dark)
    shown = "['heights', 'excess', 'shear'].map(k => document.querySelector(`.map image.${k}`).checkVisibility())"
    assert browser.run(shown) == [True, False, False]
    browser.run("document.querySelector('[data-layer=excess]').click()")
    assert browser.run(shown) == [False, True, False]
    # The middle of the place where the fibres are 1 mm too long: half of that, and 0.43 thicknesses.
    browser.run("document.querySelector('.map svg').scrollIntoView()")
    middle = "(r => [r.x + r.width / 2, r.y + r.height / 2])(document.querySelector('{}').getBoundingClientRect())"
    at = browser.run(middle.format(".map image.excess"))
    browser("Input.dispatchMouseEvent", type="mouseMoved", x=at[0], y=at[1])
    browser.settle()
    assert "a ridge of 0.63 mm" in browser.run("document.querySelector('.map .readout').textContent")
    browser.run("document.querySelector('[data-layer=shear]').click()")
    browser.settle()
    assert browser.run(shown) == [False, False, True]
    assert "shear of 12.0 degrees" in browser.run("document.querySelector('.map .readout').textContent")
    browser.run("document.querySelector('[data-layer=heights]').click()")
    assert browser.run(shown) == [True, False, False]


def test_it_prints(browser, pages):
    browser.open(pages / "report.html")
    pages_of_pdf = browser.pdf()
    assert pages_of_pdf.startswith(b"%PDF") and len(pages_of_pdf) > 50_000


def test_on_paper_the_key_stands_beside_the_map_and_no_row_is_hidden(browser, pages):
    browser.open(pages / "report.html", width=700)
    browser.run("document.querySelector('.filter .cease').click()")
    browser("Emulation.setEmulatedMedia", media="print")
    browser.settle()
    where = "(r => [r.x, r.y, r.right])(document.querySelector('{}').getBoundingClientRect())"
    _, map_top, map_right = browser.run(where.format(".map-view > svg"))
    key_left, key_top, _ = browser.run(where.format(".map-key"))
    assert key_left >= map_right and abs(key_top - map_top) < 20
    hidden = "Array.from(document.querySelectorAll('.sortable tbody tr')).filter(row => !row.checkVisibility()).length"
    assert browser.run(hidden) == 0
    for gone in (".readout", ".filter", ".buttons", ".table-tools"):
        assert browser.run(f"document.querySelector('{gone}').checkVisibility()") is False
    # A header group is repeated on every sheet, in Chromium only where it may not be broken.
    style = "(s => [s.display, s.breakInside])(getComputedStyle(document.querySelector('.running')))"
    assert browser.run(style) == ["table-header-group", "avoid"]
    assert browser.run("document.querySelector('.running').textContent.trim()").endswith("UTC · INVALID")
    browser("Emulation.setEmulatedMedia", media="")


def test_sixteen_pockets_are_filed_on_six_sheets(browser, report, tmp_path):
    """Pockets of all verdicts, the record and the recipe; the title block leaves room to sign."""
    many = tuple(dataclasses.replace(report.pockets[k % 7], id=k + 1) for k in range(16))
    filed = dataclasses.replace(report, pockets=many, left_out=report.left_out * 5)
    filed.save(tmp_path / "filed.html")
    browser.open(tmp_path / "filed.html")
    assert 2 <= len(re.findall(rb"/Type\s*/Page[^s]", browser.pdf())) <= 6
    assert not browser.run("document.querySelector('.title-block').checkVisibility()")
    browser("Emulation.setEmulatedMedia", media="print")
    try:
        block = browser.run("document.querySelector('.title-block').innerText")
        for told in ("A-17", "recipe approved by", "operator", "date, signature", "SHA-256", "debulk "):
            assert told in block
        empty = "Array.from(document.querySelectorAll('.title-block dd')).filter(dd => !dd.textContent).length"
        assert browser.run(empty) == 3  # approval, operator and signature are written by hand
    finally:
        browser("Emulation.setEmulatedMedia", media="")
