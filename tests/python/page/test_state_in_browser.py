"""What is folded on a page, how links open it, and that the address keeps what the reader has switched."""

import dataclasses

import numpy as np
import pytest

from debulk import Grid
from debulk.verdict import Verdict

QUERY = "new URLSearchParams(location.search).get('{}')"
TAB_STOPS = (
    "Array.from(document.querySelectorAll('a[href], button, summary, input, [tabindex=\"0\"]'))"
    ".filter(one => one.tabIndex >= 0 && one.checkVisibility()).length"
)


@pytest.fixture(scope="module")
def path(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("state") / "report.html"
    excess = Grid(np.full((60, 80), 1.0, dtype=np.float32), np.array([0.0, 0.0]), 10.0)
    dataclasses.replace(report, excess_map=excess).save(path)
    return path


def opened(browser, number):
    return browser.run(f"document.querySelector('#pocket-{number} > details').open")


def click(browser, selector):
    browser.run(f"document.querySelector(`{selector}`).click()")
    browser.run("new Promise(done => setTimeout(done, 30))")


def reopen(browser):
    """Open the address that the page has now."""
    address = browser.run("location.href")
    browser.events.clear()
    browser("Page.navigate", url="about:blank")
    browser("Page.navigate", url=address)
    browser.settle()
    browser.run("new Promise(done => document.readyState === 'complete' ? done() : addEventListener('load', done))")


def test_pockets_that_cease_are_folded_and_a_link_opens_them(browser, path, report):
    browser.open(path)
    assert {p.id: opened(browser, p.id) for p in report.pockets} == {
        p.id: p.verdict is not Verdict.CEASE for p in report.pockets
    }
    number = next(p.id for p in report.pockets if p.verdict is Verdict.CEASE)
    browser.run(f"location.hash = 'pocket-{number}'")
    browser.settle()
    assert opened(browser, number)
    assert abs(browser.run(f"document.querySelector('#pocket-{number}').getBoundingClientRect().top")) < 900
    click(browser, "[data-fold-all]")
    assert all(opened(browser, p.id) for p in report.pockets)


@pytest.mark.parametrize(
    ("selector", "name", "value", "again"),
    [
        ("[data-layer=excess]", "layer", "excess", "document.querySelector('.map').dataset.shows === 'excess'"),
        ("[data-verdict=cease]", "hide", "cease", "document.querySelector('tr[data-verdict=cease]').hidden"),
        ("input.all", "all", "1", "document.querySelector('input.all').checked"),
        (
            ".sortable th:nth-child(5) button",
            "sort",
            "4.ascending",
            "document.querySelector('.sortable th:nth-child(5)').getAttribute('aria-sort') === 'ascending'",
        ),
        ("#record summary", "fold", "record", "document.querySelector('#record > details').open"),
        ("#pocket-1 summary", "fold", "pocket-1", "document.querySelector('#pocket-1 > details').open"),
    ],
)
def test_the_address_keeps_what_was_switched(browser, path, selector, name, value, again):
    browser.open(path)
    assert browser.run("location.search") == ""
    click(browser, selector)
    assert browser.run(QUERY.format(name)) == value
    reopen(browser)
    assert browser.run(again) is True
    click(browser, selector)
    if name not in ("sort", "layer"):  # these have no off
        assert browser.run("location.search") == ""


def test_a_skip_link_comes_first_and_tab_stops_are_few(browser, path, report):
    browser.open(path)
    browser.press("Tab")
    assert browser.run("document.activeElement.className") == "skip"
    assert browser.run("document.activeElement.getBoundingClientRect().left") >= 0
    assert browser.run(TAB_STOPS) < 30 + 16 * len(report.pockets)
    contents = browser.run("Array.from(document.querySelectorAll('.contents a'), a => a.getAttribute('href'))")
    assert len(contents) >= 7
    for target in contents:
        assert browser.run(f"document.querySelector('{target}') !== null")
