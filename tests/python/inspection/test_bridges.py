"""A ply too short for a hollow bridges it in the model; what counts is whether friction could hold it there."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from debulk import InputError, Inspector, Recipe, Report, Verdict, _core, ridge
from debulk.inspection.lines import bridges
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.results.bridge_section import BridgeSection

THICKNESS_MM = 0.3
HALF_PLY_MM = 600.0
SQUARE = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def clouds(radius_mm: float, half_width_mm: float, flatter: float, half_ply_mm: float):
    """Return the clouds of a mold with a dish of this radius, and of a ply over it on `flatter` times that radius."""
    x = np.arange(-half_ply_mm - 40, half_ply_mm + 41, 2.0)
    xx, yy = (v.ravel() for v in np.meshgrid(x, x))
    sag = np.maximum(0.0, half_width_mm**2 - xx**2 - yy**2) / (2 * radius_mm)
    on_ply = (np.abs(xx) < half_ply_mm) & (np.abs(yy) < half_ply_mm)
    top = np.where(on_ply, THICKNESS_MM - sag / flatter, -sag)
    return np.column_stack([xx, yy, -sag]), np.column_stack([xx, yy, top])


@cache
def inspector(radius_mm: float, half_width_mm: float, half_ply_mm: float, known_outline: bool, criterion: str):
    """Prepare for plies over a dish once: a preparation takes as long as an inspection."""
    reference, _ = clouds(radius_mm, half_width_mm, 1.0, half_ply_mm)
    recipe = Recipe(verdict={"criterion": criterion})
    return Inspector(recipe, reference, half_ply_mm * SQUARE if known_outline else None)


def inspect(
    radius_mm: float,
    half_width_mm: float,
    flatter: float,
    half_ply_mm: float = HALF_PLY_MM,
    known_outline: bool = True,
    criterion: str = "excess",
) -> Report:
    _, scan = clouds(radius_mm, half_width_mm, flatter, half_ply_mm)
    return inspector(radius_mm, half_width_mm, half_ply_mm, known_outline, criterion).inspect(scan)


def held_mm(half_ply_mm: float) -> float:
    """Height of a ply over a dish of 150 mm radius, 90 mm wide, that slips until friction holds it."""
    return 45.0**2 / 2 * (1 / 150 - 1 / (0.4 * (half_ply_mm - 45))) + THICKNESS_MM / 1.2


@pytest.fixture(scope="module")
def wide() -> Report:
    """A ply over a dish of 2 m radius: it would have to pull with some 250 N/mm."""
    return inspect(2000.0, 150.0, 2.5)


@pytest.fixture(scope="module")
def tight() -> Report:
    """A ply over a dish of 150 mm radius, which friction can hold 2.4 mm above it."""
    return inspect(150.0, 45.0, 2.5)


@pytest.fixture(scope="module")
def near_the_edge() -> Report:
    """The same, with so little ply round it that it slips until it stands 0.5 mm high; the net's stands as pinned."""
    return inspect(150.0, 45.0, 2.5, half_ply_mm=433.0)


def test_a_bridge_over_a_tight_hollow_counts(tight):
    (one,) = tight.pockets
    assert one.verdict is Verdict.CREASE and "bridge" in one.reason
    assert one.decided_by == "excess"
    assert one.bridge_height_mm > 2.0  # the net shows it, too


def test_the_sections_of_the_fibres_agree_with_it(tight):
    (one,) = tight.pockets
    section = one.bridge_section
    assert section.height_mm == pytest.approx(held_mm(HALF_PLY_MM), rel=0.2)  # the reference rounds the dish's rim
    assert 0.65 < section.range_mm[0] < section.height_mm < section.range_mm[1] < one.bridge_height_mm
    assert section.hold_n_per_mm == pytest.approx(0.04 * (HALF_PLY_MM - 45), rel=0.02)
    assert section.pull_n_per_mm == pytest.approx(0.1 * 2.5 * 150, rel=0.15)
    assert f"{section.range_mm[0]:.2f} to {section.range_mm[1]:.2f} mm by the sections" in one.reason


def test_near_the_limit_nothing_is_decided_whatever_the_net_shows(near_the_edge):
    (one,) = near_the_edge.pockets
    section = one.bridge_section
    assert held_mm(433.0) < 0.5
    assert section.height_mm == pytest.approx(held_mm(433.0), abs=0.12)
    assert one.bridge_height_mm > 4.0  # the net keeps the height that it had when pinned
    assert one.verdict is near_the_edge.verdict is Verdict.UNDECIDED
    assert one.decided_by == "excess"
    for figure in (*section.range_mm, section.lacks_mm):
        assert f"{figure:.2f}" in one.reason
    assert f"friction holds {section.hold_n_per_mm:.3g} N/mm" in one.reason
    # It pulls more than friction holds, and still stands off the hollow: that is meant, and said.
    assert section.pull_n_per_mm > section.hold_n_per_mm
    assert one.reason.endswith(": it slips in until it pulls no more than that")


@pytest.mark.parametrize(
    ("least_mm", "expected"), [(0.66, Verdict.CREASE), (0.64, Verdict.UNDECIDED), (0.0, Verdict.UNDECIDED)]
)
def test_all_of_their_range_is_to_be_above_the_limit_by_the_margin(monkeypatch, least_mm, expected):
    told = BridgeSection(
        height_mm=0.9,
        range_mm=(least_mm, 1.2),
        lacks_mm=0.1,
        lacks_error_mm=0.04,
        pull_n_per_mm=3.0,
        hold_n_per_mm=9.0,
    )
    monkeypatch.setattr(bridges, "_measured", lambda *_: told)
    (one,) = inspect(150.0, 45.0, 2.5).pockets
    assert (one.verdict, one.bridge_section) == (expected, told)
    assert f"{least_mm:.2f} to 1.20 mm by the sections" in one.reason and "slips" not in one.reason


@pytest.mark.parametrize(("most_mm", "expected"), [(0.54, Verdict.CEASE), (0.56, Verdict.UNDECIDED)])
def test_it_ceases_if_all_of_their_range_keeps_the_limit_by_the_margin(monkeypatch, most_mm, expected):
    told = BridgeSection(
        height_mm=0.3, range_mm=(0.0, most_mm), lacks_mm=0.1, lacks_error_mm=0.04, pull_n_per_mm=3.0, hold_n_per_mm=9.0
    )
    monkeypatch.setattr(bridges, "_measured", lambda *_: told)
    (one,) = inspect(150.0, 45.0, 2.5).pockets
    assert one.verdict is expected


def test_where_the_mold_is_not_known_the_ply_may_bridge(monkeypatch):
    monkeypatch.setattr(bridges, "_measured", lambda *_: None)
    (one,) = inspect(150.0, 45.0, 2.5).pockets
    assert one.verdict is Verdict.UNDECIDED and one.bridge_section is None
    assert "the mold is not known" in one.reason


def test_without_a_bridge_neither_its_height_nor_its_nodes_count():
    recipe = Recipe()
    gaps_mm, bridges = np.array([0.25, 4.0, 1.0, 9.0]), np.array([False, True, False, False])
    one = ridge.PostProcessed(
        gap_mm=gaps_mm,
        is_ridge=np.zeros(4, bool),
        is_bridge=bridges,
        is_drawn_in=np.zeros(4, bool),
        sections=(),
        ridge_height_mm=0.7,
        ridge_length_mm=1.0,
        bridge_height_mm=4.0,
        drawn_in_height_mm=0.0,
        drawn_in_tension_n_per_mm=0.0,
        drawn_in_hold_n_per_mm=0.0,
        rms_mm=2.4,
        excess_length_mm=0.0,
    )
    laid = SimpleNamespace(net=SimpleNamespace(inside=np.array([True, True, True, False])), recipe=recipe)
    rest = LaidPocket.without_bridge(laid, one)
    assert (rest.bridge_height_mm, rest.ridge_height_mm) == (0.0, 0.7)
    assert rest.rms_mm == pytest.approx(np.sqrt((0.25**2 + 1.0**2) / 2))
    laid.net.inside = bridges
    assert LaidPocket.without_bridge(laid, one).rms_mm == pytest.approx(0.25)


def test_its_report_cannot_be_made_to_pass(near_the_edge, tmp_path):
    near_the_edge.save(tmp_path / "report.json")
    text = (tmp_path / "report.json").read_text()
    assert Report.load(tmp_path / "report.json").pockets[0].bridge_section == near_the_edge.pockets[0].bridge_section
    (tmp_path / "better.json").write_text(text.replace('"verdict":"undecided"', '"verdict":"cease"'))
    with pytest.raises(InputError, match="does not fit its figures: bridge 0"):
        Report.load(tmp_path / "better.json")
    near_the_edge.save(tmp_path / "report.html")
    assert "bridge by sections of its fibres" in (tmp_path / "report.html").read_text()


def test_the_paper_s_criterion_is_left_as_it_is():
    (one,) = inspect(150.0, 45.0, 2.5, half_ply_mm=433.0, criterion="paper").pockets
    assert one.verdict is Verdict.CREASE and one.bridge_section is None


def test_a_deadline_in_the_sections_decides_nothing(monkeypatch):
    def stopped(*_):
        raise _core.Stopped("not in time for the sections")

    monkeypatch.setattr(bridges, "_measured", stopped)
    report = inspect(150.0, 45.0, 2.5)
    (one,) = report.pockets
    assert one.verdict is Verdict.UNDECIDED and one.bridge_section is None
    assert one.reason.startswith("the deadline passed")


def test_a_ply_over_a_wide_hollow_is_drawn_in(wide):
    (one,) = wide.pockets
    assert one.bridge_height_mm == 0.0
    assert one.drawn_in_mm > 2.0
    assert 100 < one.drawn_in_tension_n_per_mm < 600
    # mu P d, d from the pocket's foot along the fibre to the ply's edge.
    assert one.drawn_in_hold_n_per_mm == pytest.approx(0.4 * 0.1 * (600 - 150), rel=0.1)
    assert one.verdict is Verdict.CEASE and one.bridge_section.range_mm[1] == 0.0
    # Its nodes are kept out of the RMS, and lie on the mold.
    assert one.rms_mm == pytest.approx(THICKNESS_MM / 1.2, abs=1e-9)


def test_the_report_keeps_what_is_drawn_in(wide, tmp_path):
    wide.save(tmp_path / "report.json")
    (one,) = Report.load(tmp_path / "report.json").pockets
    assert one.drawn_in_mm == wide.pockets[0].drawn_in_mm
    wide.save(tmp_path / "report.html")
    assert "bridge that is drawn in" in (tmp_path / "report.html").read_text()


def test_without_an_outline_friction_holds_as_far_as_the_reference_reaches(tight):
    (one,) = inspect(150.0, 45.0, 2.5, known_outline=False).pockets
    assert one.drawn_in_mm is None
    assert one.verdict is Verdict.CREASE
    held = tight.pockets[0].bridge_section.hold_n_per_mm
    assert one.bridge_section.hold_n_per_mm == pytest.approx(held + 0.04 * 40, abs=0.1)
    report = inspect(2000.0, 150.0, 2.5, known_outline=False)
    assert report.pockets[0].verdict is Verdict.CEASE and report.pockets[0].bridge_section.range_mm[1] == 0.0
    (entry,) = [entry for entry in report.left_out if entry.what == "free edges and friction"]
    assert "reference's edge" in entry.bound


# --- below the tolerances: over a narrow hollow a ply stands lower than any pocket, and has nothing to spare ---


@pytest.mark.parametrize(("radius_mm", "half_width_mm", "flatter"), [(100, 35, 1.3), (60, 25, 2.0), (150, 45, 1.5)])
def test_a_bridge_lower_than_the_tolerances_is_judged(radius_mm, half_width_mm, flatter):
    report = inspect(radius_mm, half_width_mm, flatter)
    (one,) = report.pockets
    height_mm = half_width_mm**2 / (2 * radius_mm) * (1 - 1 / flatter) + THICKNESS_MM / 1.2
    assert "too short for the hollow below" in one.promoted
    assert one.verdict is report.verdict is Verdict.CREASE
    assert one.bridge_section.height_mm == pytest.approx(height_mm, rel=0.2)  # the reference rounds the rim


@pytest.mark.parametrize("flatter", [1.15, 1.5])
def test_a_bump_over_a_hollow_so_round_that_its_ply_is_drawn_in_stays_one(flatter):
    report = inspect(250.0, 60.0, flatter)
    assert (report.verdict, report.pockets) == (Verdict.CEASE, ())


def test_a_bump_s_bridge_counts_without_an_outline_too():
    (one,) = inspect(100.0, 35.0, 1.5, known_outline=False).pockets
    assert "too short for the hollow below" in one.promoted
    assert one.verdict is Verdict.CREASE and one.bridge_section.lacks_mm > 0


def test_a_deadline_in_the_sections_of_a_bump_decides_nothing(monkeypatch):
    def stopped(*_):
        raise _core.Stopped("not in time for the sections")

    monkeypatch.setattr(bridges, "_measured", stopped)
    report = inspect(100.0, 35.0, 1.5)
    assert report.verdict is Verdict.UNDECIDED and "deadline" in report.reason
