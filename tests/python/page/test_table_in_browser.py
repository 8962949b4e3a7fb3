"""The table of pockets in a real browser: its order, its filter, and what a phone shows of it."""

import pytest

from debulk.page.pockets import worst_first

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


@pytest.mark.parametrize(
    ("name", "value", "down"),
    [
        ("#", lambda p: p.id, False),
        ("area", lambda p: p.area_mm2, True),
        ("peak", lambda p: p.peak_mm, True),
        ("at x, y", lambda p: p.centroid_mm[0], False),
        ("why", lambda p: p.reason, False),
    ],
)
def test_a_click_sorts_by_numbers_as_numbers_and_another_turns_the_order(browser, path, report, name, value, down):
    browser.open(path)
    click(browser, name)
    values = [value(report.pocket(k)) for k in browser.run(IDS)]
    assert values == sorted(values, reverse=down)
    column = head(browser, name)
    assert [k for k, way in enumerate(sorts(browser)) if way] == [column]
    assert sorts(browser)[column] == ("descending" if down else "ascending")
    click(browser, name)
    values = [value(report.pocket(k)) for k in browser.run(IDS)]
    assert values == sorted(values, reverse=not down)


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
    assert len(visible_heads(browser)) == 18


def test_a_phone_shows_verdict_ridge_and_reason_of_every_pocket(browser, path, report):
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
    assert any("m" in head and "ridge" in head for head in visible_heads(browser)) and len(visible_heads(browser)) == 3
