"""A ply too short for a hollow bridges it in the model; what counts is whether friction could hold it there."""

from __future__ import annotations

import numpy as np
import pytest

from debulk import Inspector, Recipe, Report, Verdict

THICKNESS_MM = 0.3
HALF_PLY_MM = 600.0
OUTLINE = HALF_PLY_MM * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])


def clouds(radius_mm: float, half_width_mm: float, flatter: float):
    """Return the clouds of a mold with a dish of this radius, and of a ply over it on `flatter` times that radius."""
    x = np.arange(-HALF_PLY_MM - 40, HALF_PLY_MM + 41, 2.0)
    xx, yy = (v.ravel() for v in np.meshgrid(x, x))
    sag = np.maximum(0.0, half_width_mm**2 - xx**2 - yy**2) / (2 * radius_mm)
    on_ply = (np.abs(xx) < HALF_PLY_MM) & (np.abs(yy) < HALF_PLY_MM)
    top = np.where(on_ply, THICKNESS_MM - sag / flatter, -sag)
    return np.column_stack([xx, yy, -sag]), np.column_stack([xx, yy, top])


def inspect(radius_mm: float, half_width_mm: float, flatter: float, outline=OUTLINE) -> Report:
    reference, scan = clouds(radius_mm, half_width_mm, flatter)
    recipe = Recipe(level={"largest_pocket_share": 1.0})
    return Inspector(recipe, reference, outline).inspect(scan)


@pytest.fixture(scope="module")
def wide() -> Report:
    """A ply over a dish of 2 m radius: it would have to pull with some 250 N/mm."""
    return inspect(2000.0, 150.0, 2.5)


def test_a_bridge_over_a_tight_hollow_counts():
    (one,) = inspect(150.0, 45.0, 2.5).pockets
    assert one.verdict is Verdict.CREASE and "bridge" in one.reason
    assert one.bridge_height_mm > 2.0
    assert "not counted" not in one.reason


def test_a_ply_over_a_wide_hollow_is_drawn_in(wide):
    (one,) = wide.pockets
    assert one.bridge_height_mm == 0.0
    assert one.drawn_in_mm > 2.0
    assert 100 < one.drawn_in_tension_n_per_mm < 600
    # mu P d, d from the pocket's foot along the fibre to the ply's edge.
    assert one.drawn_in_hold_n_per_mm == pytest.approx(0.4 * 0.1 * (600 - 150), rel=0.1)
    assert one.verdict is Verdict.CEASE
    assert "is not counted" in one.reason and "drawn in" in one.reason
    # Its nodes are kept out of the RMS, and lie on the mold.
    assert one.rms_mm == pytest.approx(THICKNESS_MM / 1.2, abs=1e-9)


def test_the_report_keeps_what_is_drawn_in(wide, tmp_path):
    wide.save(tmp_path / "report.json")
    (one,) = Report.load(tmp_path / "report.json").pockets
    assert one.drawn_in_mm == wide.pockets[0].drawn_in_mm
    wide.save(tmp_path / "report.html")
    assert "bridge that is drawn in" in (tmp_path / "report.html").read_text()


def test_without_an_outline_every_bridge_counts():
    report = inspect(2000.0, 150.0, 2.5, outline=None)
    one = report.pockets[0]
    assert one.bridge_height_mm > 2.0 and one.drawn_in_mm is None
    (entry,) = [entry for entry in report.left_out if entry.what == "free edges and friction"]
    assert "a bridge counts whatever its pull" in entry.bound
