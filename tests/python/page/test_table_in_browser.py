"""The table of pockets in a real browser: its order, its filter, and what a phone shows of it."""

import dataclasses

import pytest

from debulk.results.deciding import worst_first
from debulk.results.report import ExcessReport
from debulk.verdict import Verdict

IDS = "Array.from(document.querySelectorAll('.sortable tbody tr'), row => Number(row.cells[0].textContent))"
ROWS = "Array.from(document.querySelectorAll('.sortable tbody tr'))"
SHOWN = ROWS + ".filter(row => row.checkVisibility()).map(row => Number(row.cells[0].textContent))"


@pytest.fixture(scope="module")
def path(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("table") / "report.html"
    report.save(path)
    return path


def head(browser, name):
    """Number of the column whose heading begins so."""
    heads = browser.run("Array.from(document.querySelectorAll('.sortable th'), th => th.textContent)")
    return next(k for k, text in enumerate(heads) if text.startswith(name))


def click(browser, name):
    browser.run(f"document.querySelectorAll('.sortable th')[{head(browser, name)}].querySelector('button').click()")


def sorts(browser):
    return browser.run("Array.from(document.querySelectorAll('.sortable th'), th => th.getAttribute('aria-sort'))")


def test_failures_come_first(browser, path, report):
    browser.open(path)
    severity = [report.pocket(k).verdict.severity for k in browser.run(IDS)]
    assert severity == sorted(severity, reverse=True) and len(set(severity)) == 4
    cards = browser.run("Array.from(document.querySelectorAll('article'), card => Number(card.id.slice(7)))")
    assert cards == browser.run(IDS) == [p.id for p in worst_first(report.pockets)]


def certified(pocket):
    return None if pocket.solve is None else "yes" if pocket.solve.certified else "no"


COLUMNS = {
    "#": (lambda p: p.id, False),
    "verdict": (lambda p: p.verdict.severity, False),  # they stand the worst first: the first click turns that
    "why": (lambda p: p.reason, False),
    "ridgemm": (lambda p: p.deciding_ridge and p.deciding_ridge.height_mm, True),
    "marginmm": (lambda p: p.deciding_ridge and round(0.6 - p.deciding_ridge.most_mm, 2), False),
    "at x, y": (lambda p: p.centroid_mm[0], False),
    "area": (lambda p: p.area_mm2, True),
    "peak": (lambda p: p.peak_mm, True),
    "measured": (lambda p: p.measured_share, False),
    "Δ": (lambda p: p.spacing_mm, False),
    "ridge byexcess": (lambda p: p.excess and p.excess.height_mm, False),
    "ridge ofthe net": (lambda p: p.ridge_height_mm, False),
    "elasticfold": (lambda p: p.elastic_mm, False),
    "RMS": (lambda p: p.rms_mm and round(p.rms_mm, 3), False),
    "its margin": (lambda p: p.rms_mm and round(0.3 - p.rms_mm, 3), False),
    "the paper": (lambda p: p.paper_verdict and p.paper_verdict.severity, False),
    "certified": (certified, False),
}


@pytest.fixture(scope="module")
def varied(report, tmp_path_factory):
    """Return a report with a value in each column, on both sides of each limit, and its page."""
    excess = [0.2, 0.9, None, 2.1, 0.4, None, 10.5]
    paper = [Verdict.CEASE, Verdict.CREASE, None, Verdict.UNDECIDED, Verdict.CEASE, None, Verdict.CREASE]
    pockets = tuple(
        dataclasses.replace(
            p,
            excess=h and ExcessReport(
                length_mm=h, height_mm=h, range_mm=(h, h), alone_mm=h, elastic_mm=3 * h, noise_mm=0.0,
                uncertainty_mm=0.0, bridge_bound_mm=0.0,
            ),
            decided_by="excess" if h else "paper",
            paper_verdict=v,
        )
        for p, h, v in zip(report.pockets, excess, paper, strict=True)
    )  # fmt: skip
    path = tmp_path_factory.mktemp("varied") / "report.html"
    varied = dataclasses.replace(report, pockets=pockets)
    varied.save(path)
    return varied, path


@pytest.mark.parametrize("name", COLUMNS)
def test_a_click_sorts_by_numbers_as_numbers_and_another_turns_the_order(browser, varied, name):
    (report, path), (value, down) = varied, COLUMNS[name]
    browser.open(path)
    column = head(browser, name)
    for turned in (down, not down):
        click(browser, name)
        values = [value(report.pocket(k)) for k in browser.run(IDS)]
        known = [one for one in values if one is not None]
        assert values == sorted(known, reverse=turned) + [None] * (len(values) - len(known))
        assert len(set(known)) > 1
        assert [k for k, way in enumerate(sorts(browser)) if way] == [column]
        assert sorts(browser)[column] == ("descending" if turned else "ascending")


def test_every_column_is_sorted_by_a_test(browser, varied):
    browser.open(varied[1])
    assert sorted(head(browser, name) for name in COLUMNS) == list(range(len(sorts(browser))))


def test_what_is_not_known_comes_last_whichever_way(browser, path, report):
    browser.open(path)
    for _ in range(2):
        click(browser, "ridge")
        ids = browser.run(IDS)
        assert report.pocket(ids[-1]).ridge_height_mm is None
        assert None not in [report.pocket(k).ridge_height_mm for k in ids[:-1]]


def test_the_keyboard_sorts(browser, path, report):
    browser.open(path)
    browser.run(f"document.querySelectorAll('.sortable th')[{head(browser, 'peak')}].querySelector('button').focus()")
    browser("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r", windowsVirtualKeyCode=13)
    browser("Input.dispatchKeyEvent", type="keyUp", key="Enter", code="Enter", windowsVirtualKeyCode=13)
    browser.settle()
    peaks = [report.pocket(k).peak_mm for k in browser.run(IDS)]
    assert peaks == sorted(peaks, reverse=True)


def test_the_filter_hides_verdicts_and_says_how_many_are_left(browser, path, report):
    browser.open(path)
    press = "document.querySelector('.filter [data-verdict=cease]').click()"
    browser.run(press)
    left = [p.id for p in report.pockets if p.verdict.value != "cease"]
    assert sorted(browser.run(SHOWN)) == left
    assert browser.run("document.querySelector('.filter output').textContent") == f"{len(left)} of 7 shown"
    assert browser.run("document.querySelector('.filter .cease').getAttribute('aria-pressed')") == "false"
    browser.run(press)
    assert sorted(browser.run(SHOWN)) == [p.id for p in report.pockets]
    assert browser.run("document.querySelector('.filter output').textContent") == ""


def visible_heads(browser):
    shown = "Array.from(document.querySelectorAll('.sortable th')).filter(th => th.checkVisibility())"
    return browser.run(f"{shown}.map(th => th.textContent)")


def test_few_columns_and_the_rest_on_demand_also_without_a_script(browser, path):
    browser.open(path, script=False)
    browser("Emulation.setScriptExecutionDisabled", value=False)
    assert len(visible_heads(browser)) == 8
    browser.run("document.querySelector('.all').click()")
    assert len(visible_heads(browser)) == 17


def test_a_phone_shows_verdict_ridge_margin_place_and_reason_of_every_pocket(browser, path, report):
    browser.open(path, width=360, phone=True)
    texts = browser.run("Array.from(document.querySelectorAll('.sortable tbody tr'), row => row.innerText)")
    boxes = browser.run(
        "Array.from(document.querySelectorAll('.sortable tbody td')).filter(td => td.checkVisibility())"
        ".map(td => { const r = td.getBoundingClientRect(); return [r.left, r.right]; })"
    )
    assert all(left >= 0 and right <= 360 for left, right in boxes)
    for pocket, text in zip(worst_first(report.pockets), texts, strict=True):
        assert pocket.verdict.name in text and pocket.reason in text
        if pocket.ridge_height_mm is not None:
            assert f"{pocket.ridge_height_mm:.2f}" in text
        if pocket.deciding_ridge is not None:
            margin = 0.6 - pocket.deciding_ridge.most_mm
            assert f"{margin:+.2f}".replace("-", "−") in text
        x, y = (f"{value:.0f}" for value in pocket.centroid_mm)
        assert f"{x},\u00a0{y}" in text
    assert len(visible_heads(browser)) == 3
