"""One ridge for each pocket: that of the worst case under which it was judged, the same wherever it is shown."""

import csv
import dataclasses
import io
import re

import pytest

from debulk.page.map_ridges import says
from debulk.page.report import page
from debulk.report import Report
from debulk.results.deciding import DecidingRidge, worst_first
from debulk.results.edge_friction import EdgeEnd, EdgeFriction
from debulk.results.half_seen import HalfSeen, HoleBeside, Way
from debulk.results.report import ExcessReport
from debulk.verdict import Verdict

EXCESS = ExcessReport(
    length_mm=1.0, height_mm=0.31, range_mm=(0.28, 0.35), alone_mm=0.35, elastic_mm=2.1, noise_mm=0.01,
    uncertainty_mm=0.03, bridge_bound_mm=0.0, verdict=Verdict.CEASE,
)  # fmt: skip
NOTHING = EdgeEnd(verdict=Verdict.CEASE, reason="")
UNKNOWN = Way(holes="filled in", verdict=Verdict.CEASE, reason="")
HOLE = HoleBeside(centre_mm=(0.0, 0.0), area_mm2=900.0, of="scan")


def held(low, high):
    ends = [
        EdgeEnd(verdict=Verdict.CEASE, reason="", ridge_range_mm=(0.0, 0.0)),
        EdgeEnd(verdict=Verdict.CREASE, reason="", ridge_range_mm=(low, high)),
    ]
    return EdgeFriction(slipping=ends[0], held=ends[1], held_nodes=4)


@pytest.fixture
def doubtful(report):
    """Two undecided pockets whose own figures are harmless."""
    calm = dataclasses.replace(
        report.pockets[0], verdict=Verdict.UNDECIDED, reason="friction decides", ridge_height_mm=0.0,
        ridge_range_mm=(0.0, 1.19), edge_friction=held(0.87, 1.19),
    )  # fmt: skip
    ways = (
        Way(holes="filled in", verdict=Verdict.CEASE, reason="", ridge_range_mm=(0.28, 0.35)),
        Way(holes="on the mold", verdict=Verdict.CREASE, reason="", ridge_range_mm=(0.9, 2.5)),
    )
    beside = dataclasses.replace(
        report.pockets[1], verdict=Verdict.UNDECIDED, excess=EXCESS, decided_by="excess",
        half_seen=HalfSeen(holes=(HOLE,), rim_share=0.1, ways=ways),
    )  # fmt: skip
    return dataclasses.replace(report, verdict=Verdict.UNDECIDED, reason="two", pockets=(calm, beside))


def test_what_is_not_known_gives_no_ridge(report):
    bare = dataclasses.replace(
        report.pockets[0], ridge_height_mm=None, ridge_range_mm=None, excess=None, bridge_height_mm=None,
        edge_friction=EdgeFriction(slipping=NOTHING, held=NOTHING, held_nodes=2),
        half_seen=HalfSeen(holes=(HOLE,), rim_share=0.1, ways=(UNKNOWN,)),
    )  # fmt: skip
    assert bare.deciding_ridge is None
    known = dataclasses.replace(bare, ridge_height_mm=0.4)
    assert known.deciding_ridge == (0.4, (0.4, 0.4), "net")
    assert known.deciding_ridge.margin_mm(None) is None
    assert (known.deciding_ridge.spread, DecidingRidge(0.4, (0.2, 0.4), "net").spread) == ("", "(0.20 to 0.40)")
    first, second = (dataclasses.replace(known, id=k) for k in (3, 4))
    worst = dataclasses.replace(known, id=9, verdict=Verdict.INVALID)
    unknown = dataclasses.replace(bare, id=1)
    assert [p.id for p in worst_first([unknown, second, first, worst])][-3:] == [3, 4, 1]
    assert worst_first([first, worst])[0] is worst


def test_an_undecided_pocket_shows_the_worst_case_and_not_the_harmless_one(doubtful):
    calm, beside = doubtful.pockets
    assert calm.deciding_ridge == (1.19, (0.87, 1.19), "its rim held")
    assert beside.deciding_ridge == (2.5, (0.9, 2.5), "what was not seen on the mold")
    assert calm.deciding_ridge.margin_mm(0.6) == pytest.approx(-0.59)
    assert [p.id for p in worst_first(doubtful.pockets)] == [2, 1]


def test_where_nothing_decided_the_higher_of_excess_and_net_counts(report):
    """As for a pocket that shares a fibre with another one: its own net is flat, and its excess is what is feared."""
    shared = dataclasses.replace(
        report.pockets[2], excess=EXCESS, decided_by="", ridge_height_mm=0.0, ridge_range_mm=(0.0, 0.0),
        bridge_height_mm=None, half_seen=None, edge_friction=None,
    )  # fmt: skip
    assert shared.deciding_ridge == (EXCESS.range_mm[1], EXCESS.range_mm, "excess length")
    high = dataclasses.replace(shared, ridge_height_mm=3.0, ridge_range_mm=(2.0, 4.0))
    assert high.deciding_ridge == (3.0, (2.0, 4.0), "net")


def test_without_another_case_it_is_that_of_the_criterion_that_decides(report):
    one = dataclasses.replace(report.pockets[0], excess=EXCESS, decided_by="excess")
    assert one.deciding_ridge == (0.31, (0.28, 0.35), "excess length")
    assert dataclasses.replace(one, decided_by="paper").deciding_ridge.by == "net"
    assert report.pockets[5].deciding_ridge is None  # a pocket that was not judged


def test_one_ridge_height_everywhere(doubtful):
    """Text, CSV, map, table, chart, card, notebook and plot, for a pocket with three heights by three models."""
    heights = {1: "1.19", 2: "2.50"}
    rows = {int(row["id"]): row for row in csv.DictReader(io.StringIO(csv_of(doubtful)))}
    html = page(doubtful)
    lines = {int(line.split()[0]): line for line in doubtful.table().splitlines() if line.split()[0] in "12"}
    for pocket in doubtful.pockets:
        height = heights[pocket.id]
        assert f"{float(rows[pocket.id]['ridge_mm']):.2f}" == height
        assert float(rows[pocket.id]["margin_mm"]) == pytest.approx(0.6 - float(height))
        assert lines[pocket.id].split()[2] == height
        assert says(pocket).endswith(f"ridge {height} mm")
        assert f"pocket {pocket.id}: UNDECIDED, ridge {height} mm" in html
        card = html.split(f'id="pocket-{pocket.id}"')[1].split("</article>")[0]
        first, others = card.split('<details class="models">')
        assert re.search(rf"<dt>ridge</dt><dd>{height} ", first)
        # Heights of other models stand under that name, and in no caption.
        assert "ridge of the net" in others and "ridge of the net</dt>" not in first
        captions = " ".join(re.findall(r"<figcaption>(.*?)</figcaption>", first))
        assert "highest ridge" in captions or "as the net has it" in captions
        assert "mm" not in re.sub(r"before: up to [\d.]+ mm|coarse net at its minimum: up to [\d.]+ mm", "", captions)
    chart = html.split("Ridge that decides, mm")[1].split("</figure>")[0]
    assert re.findall(r'bar-text">([\d.]+)', chart) == ["2.50", "1.19"]
    shown = doubtful._repr_html_()
    assert all(f">{height}</td>" in shown for height in heights.values())


def csv_of(report):
    from debulk.results.report_csv import csv_text

    return csv_text(report)


def test_the_plot_draws_the_ridges_of_the_page(doubtful):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    ax = Report.plot(doubtful)
    try:
        assert {text.get_text() for text in ax.texts} == {"1 ?: 1.19 mm", "2 ?: 2.50 mm"}
        lines = [line.get_xydata() for line in ax.lines]
        for pocket in doubtful.pockets:
            for ridge in pocket.ridges[0].lines_mm:
                assert any(one.shape == ridge[:, :2].shape and (one == ridge[:, :2]).all() for one in lines)
    finally:
        matplotlib.pyplot.close("all")
