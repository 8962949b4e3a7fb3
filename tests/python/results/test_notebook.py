"""What a notebook shows of a report: HTML, a table of pandas, a picture."""

import dataclasses
import html
import math
import sys
from html.parser import HTMLParser

import pytest

from debulk import InputError
from debulk.comparison import Comparison, PocketComparison
from debulk.report import Report
from debulk.results.looks import VERDICT_SIGNS
from debulk.verdict import Verdict


class Reader(HTMLParser):
    """Keeps the words, the tags in order, and those that were not closed."""

    def __init__(self, text):
        super().__init__()
        self.words, self.tags, self.open = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def test_a_report_is_a_table_that_trusts_no_text(report):
    text = report._repr_html_()
    read = Reader(text)
    assert read.open == [] and set(read.tags) == {"div", "b", "span", "table", "tr", "th", "td"}
    assert html.escape("<script>alert('x')</script>") in text  # as text, that is
    assert read.tags.count("tr") == 1 + len(report.pockets)
    assert "INVALID" in read.words[1] and len(text) < 20_000
    assert "url(" not in text and "http" not in text  # it loads nothing


def test_a_pocket_and_an_empty_report(report):
    shown = Reader(report.pocket(2)._repr_html_())
    assert shown.tags.count("tr") == 2 and report.pocket(2).reason in " ".join(shown.words)
    empty = Reader(Report(verdict=Verdict.CEASE, reason="no pocket", pockets=())._repr_html_())
    assert "table" not in empty.tags and " no pocket" in empty.words


def test_a_comparison():
    pocket = PocketComparison(
        id=1,
        outline_mm=[[0, 0], [9, 0], [9, 9]],
        predicted=Verdict.CEASE,
        measured=Verdict.CREASE,
        reason="a ridge <1> stands",
        measured_share=1.0,
    )
    shown = Comparison(pockets=(pocket,), max_rms_mm=0.3, max_peak_mm=0.6)._repr_html_()
    assert "&lt;1&gt;" in shown and "CREASE" in shown and Reader(shown).open == []


def test_a_dataframe_holds_what_the_csv_holds(report, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = report.to_dataframe()
    report.save(tmp_path / "r.csv")
    read = pandas.read_csv(tmp_path / "r.csv", index_col="id")
    assert list(frame.columns) == list(read.columns) and list(frame.index) == list(read.index)
    for name in ("area_mm2", "rms_mm", "ridge_mm", "net_ridge_mm", "margin_mm", "kkt_error"):
        assert frame[name].dtype == "float64"
        assert frame[name].to_numpy() == pytest.approx(read[name].to_numpy(), nan_ok=True)
    assert math.isnan(frame.loc[6, "rms_mm"]) and frame.loc[6, "verdict"] == "INVALID"
    assert (frame["peak_mm"] > 8).tolist() == [p.peak_mm > 8 for p in report.pockets]
    assert Report(verdict=Verdict.CEASE, reason="no pocket", pockets=()).to_dataframe().empty


def test_a_plot_shows_every_pocket_where_it_is(report, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    ax = report.plot()
    try:
        labels = {text.get_text().partition(":")[0] for text in ax.texts}
        assert labels == {f"{p.id} {VERDICT_SIGNS[p.verdict]}" for p in report.pockets}
        entries = [text.get_text() for text in ax.get_legend().get_texts()]
        assert entries[:4] == ["✓ CEASE", "? UNDECIDED", "✕ CREASE", "∅ INVALID"]
        (low, high) = report.pockets[1].outline_mm.min(axis=0), report.pockets[1].outline_mm.max(axis=0)
        assert any((line.get_xydata().min(axis=0) == low).all() for line in ax.lines if len(line.get_xdata()))
        assert (high < [ax.get_xlim()[1], ax.get_ylim()[1]]).all()
        ax.figure.savefig(tmp_path / "map.png")
        assert (tmp_path / "map.png").stat().st_size > 20_000
        # into axes that are there, and without map, outline or pocket
        _, own = matplotlib.pyplot.subplots()
        bare = Report(verdict=Verdict.CEASE, reason="no pocket", pockets=())
        assert bare.plot(own) is own and own.get_title() == "CEASE: no pocket"
    finally:
        matplotlib.pyplot.close("all")


def test_no_label_of_a_plot_covers_another(report):
    """Twelve pockets in a cluster, nearer to each other than their labels are wide."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    small = report.pockets[6]
    away = [(dx * 90.0 - 500.0, dy * 40.0 + 200.0) for dx in range(4) for dy in range(3)]
    cluster = [
        dataclasses.replace(small, id=k, outline_mm=small.outline_mm + xy, ridges=()) for k, xy in enumerate(away)
    ]
    ax = dataclasses.replace(report, pockets=tuple(cluster)).plot()
    try:
        ax.figure.draw_without_rendering()  # as saving does: the layout may not bring them together
        boxes = [text.get_window_extent() for text in ax.texts]
        shared = [
            max(0, min(a.x1, b.x1) - max(a.x0, b.x0)) * max(0, min(a.y1, b.y1) - max(a.y0, b.y0))
            for k, a in enumerate(boxes)
            for b in boxes[:k]
        ]
        assert len(boxes) == 12 and max(shared) < 0.05 * boxes[0].width * boxes[0].height
    finally:
        matplotlib.pyplot.close("all")


@pytest.mark.parametrize(("name", "extra"), [("matplotlib", "plot"), ("pandas", "pandas")])
def test_what_is_missing_is_named_with_its_extra(report, monkeypatch, name, extra):
    for module in [module for module in sys.modules if module.partition(".")[0] == name]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setattr(sys, "meta_path", [Missing(name), *sys.meta_path])
    with pytest.raises(InputError, match=rf"{name} is not installed; install it by pip install 'debulk\[{extra}\]'"):
        report.plot() if extra == "plot" else report.to_dataframe()


class Missing:
    """Finds no such package."""

    def __init__(self, name):
        self.name = name

    def find_spec(self, module, path=None, target=None):
        if module.partition(".")[0] == self.name:
            raise ModuleNotFoundError(f"No module named {module!r}", name=self.name)
        return None
