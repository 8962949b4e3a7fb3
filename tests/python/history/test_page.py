"""The page of a history: its counts, its rates, and what it does with hostile words."""

import dataclasses
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from debulk import Report, Verdict
from debulk.cli import app
from debulk.comparison import Comparison
from debulk.history import History
from debulk.history.control import control
from debulk.history.overview import overview
from debulk.history.page import page
from debulk.history.search import Search
from debulk.history.tables import connected
from debulk.results.agreement import agreement
from debulk.results.chain import ChainFigure, ChainReport
from debulk.results.comparison import PocketComparison
from html_reader import read

HOSTILE = "</script><img src=x onerror='window.hacked=1'>\"`"


def of(report, time, **changes):
    return dataclasses.replace(report, trace=dataclasses.replace(report.trace, time_utc=time), **changes)


@pytest.fixture(scope="module")
def history(tmp_path_factory, report):
    """Two layups with what became of them, one of which an operator corrects, and one with hostile words."""
    there = History(tmp_path_factory.mktemp("page") / "cell.sqlite")
    for k, measured in enumerate((Verdict.CREASE, Verdict.CEASE)):
        layup = of(report, f"2026-03-0{k + 1}T12:00:00.000Z")
        pockets = [
            PocketComparison(id=p.id, outline_mm=p.outline_mm, predicted=p.verdict, measured=measured, reason="")
            for p in report.pockets
        ]
        there.add_comparison(Comparison(pockets=tuple(pockets), max_rms_mm=0.3, max_peak_mm=0.6), layup)
    there.add_outcome(1, 1, "cease")
    there.add(of(report, HOSTILE, version=HOSTILE, reason=HOSTILE, recipe={HOSTILE: {HOSTILE: HOSTILE}}))
    return there


@pytest.fixture(scope="module")
def html(history):
    return page(history)


def test_the_page_nests_loads_nothing_and_is_escaped(html):
    reader = read(html)
    assert not {tag for tag, _ in reader.elements} & {"link", "iframe", "object", "img", "form"}
    assert "://" not in html and html.count("<script") == 1 and "onerror='" not in html


def test_the_confusion_matrix_and_its_rates(history, html, report):
    text = " ".join("".join(read(html).text).split())
    cease = [p.id for p in report.pockets if p.verdict is Verdict.CEASE]
    crease = [p.id for p in report.pockets if p.verdict is Verdict.CREASE]
    assert 1 in cease
    # Of layup 1 all creased but pocket 1, of which an operator said otherwise; of layup 2 all ceased.
    escapes, needless = len(cease) - 1, len(crease)
    right = len(crease) + 1 + len(cease)
    total = 2 * (len(cease) + len(crease))
    assert f"{right} of {total}" in text
    assert f"{escapes} of {2 * len(cease)}" in text and f"{needless} of {2 * len(crease)}" in text
    found = agreement(right, total)
    assert f"{100 * found.low:.1f} to {100 * found.high:.1f}" in text
    assert "3 layups, 2026-03-01" in text and f"{len(report.pockets):.1f}" in text


def test_a_layup_that_is_invalid_leaves_no_empty_place(tmp_path):
    there = History(tmp_path / "cell.sqlite")
    for verdict in (Verdict.CEASE, Verdict.INVALID, Verdict.CEASE):
        there.add(Report(verdict=verdict, reason="", pockets=()))
    figure = page(there).split("<h2>Pockets over time</h2>")[1].split("</figure>")[0]
    (stroke,) = re.findall(r'<rect class="invalid" x="([\d.]+)"', figure)
    assert 272 < float(stroke) < 492  # the second of three columns
    assert "INVALID" in figure


def test_an_empty_history_and_a_search_without_a_find(history, tmp_path):
    from debulk.history.search import Search

    assert "0 layups" in page(history, Search(part="nobody's"))
    there = History(tmp_path / "c.sqlite")
    there.add(Report(verdict=Verdict.CEASE, reason="", pockets=()))
    assert "1 layup<" in page(there)


def test_the_interval_of_many_pockets_is_that_of_a_normal_law():
    found = agreement(90_000, 100_000)
    spread = 1.96 * (0.9 * 0.1 / 100_000) ** 0.5
    assert (found.low, found.high) == pytest.approx((0.9 - spread, 0.9 + spread), abs=2e-5)


def run(*words):
    return CliRunner().invoke(app, ["history", *map(str, words)])


def test_the_commands(history, tmp_path, report):
    out = tmp_path / "h.html"
    assert run("page", history.path, "-o", out).exit_code == 0 and out.read_text() == page(history)
    listed = run("list", history.path, "--verdict", "invalid", "--since", "2026-03-02")
    assert listed.exit_code == 0 and re.search(r"^ *3 +2026-03-02", listed.stdout, re.MULTILINE)
    assert run("list", history.path, "--part", "no").stdout == "no layup fits\n"
    for record in (1, 2):
        assert run("get", history.path, record, "-o", tmp_path / f"{record}.json").exit_code == 0
    assert Report.load(tmp_path / "1.json").reason == report.reason
    assert len(Comparison.load(tmp_path / "2.json").pockets) == len(report.pockets)
    new = tmp_path / "new.sqlite"
    assert "1.json: record 1\n" in run("add", new, tmp_path / "1.json").stdout
    assert "1.json: is record 1 already" in run("add", new, tmp_path / "1.json").stdout
    assert run("outcome", new, 1, 2, "crease").stdout == "record 2\n"
    assert run("export", new, "-o", tmp_path / "p.csv", "--table", "pocket").stdout.endswith("p.csv, 7 rows\n")
    assert run("check", new).exit_code == 0 and "2 records, none changed" in run("check", new).stdout
    for words, part in (
        (("list", tmp_path / "no.sqlite"), "there is no such history"),
        (("list", new, "--near", "a"), "--near: expected two numbers"),
        (("list", new, "--verdict", "good"), "verdict: expected one of"),
        (("page", new, "-o", "x.pdf"), "ending in .html"),
        (("get", new, 5, "-o", tmp_path / "5.json"), "there is no record 5"),
    ):
        done = run(*words)
        assert (done.exit_code, done.stderr.count("\n")) == (2, 1) and part in done.stderr


def test_a_chain_that_drifts_is_charted_against_what_was_qualified(tmp_path, report):
    """The scatter creeps up within its limits, by a standard deviation in ten scans, as over weeks."""
    there = History(tmp_path / "cell.sqlite")
    rng = np.random.default_rng(2)
    for k in range(60):
        noise_mm = 0.05 + 0.001 * rng.standard_normal() + 0.0001 * max(0, k - 30)
        one = ChainFigure(
            name="noise_mm", says="scatter of the points", unit="mm", measured=noise_mm, low=0.03, high=0.07
        )
        chain = ChainReport(name="cell", sha256="", made_utc="", figures=(one,))
        there.add(of(report, f"2026-03-{1 + k // 2:02}T12:{k % 2}0:00.000Z", chain=chain))
    there.add(of(report, "2026-04-01T12:00:00.000Z"))  # of no chain
    with connected(there.path) as connection:
        seen = overview(connection, Search())
    (title,) = seen.chain
    assert title == "chain: scatter of the points, mm (qualified from 0.03 to 0.07)"
    found = control(seen.chain[title], 30)
    assert np.isnan(found.values[-1]) and not found.signals["shift"][:30].any() and found.signals["shift"][45:].any()
    assert title in page(there, baseline=30)
    assert there.check().passed
