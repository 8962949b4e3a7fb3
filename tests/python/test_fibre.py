"""The public stage that measures the excess of fibre lines; its closed forms are tests of the core."""

from __future__ import annotations

import numpy as np
import pytest

from debulk import Grid, InputError, fibre
from debulk.surface import Reference

FLAT = Reference(np.zeros((5, 5)), (-120.0, -120.0), 60.0)
SQUARE = [(-90, -90), (90, -90), (90, 90), (-90, 90)]


def bells(*places: tuple[float, float], wide: float = 50.0, high: float = 4.0) -> Grid:
    x, y = np.meshgrid(np.arange(-90.0, 91.0), np.arange(-90.0, 91.0))
    heights = np.full(x.shape, 0.3)
    for at in places:
        heights += high * np.cos(np.pi * np.minimum(np.hypot(x - at[0], y - at[1]) / wide, 0.5)) ** 2
    return Grid(heights, np.array([-90.0, -90.0]), 1.0)


def test_runs_name_where_they_lie_and_in_which_direction() -> None:
    excess = fibre.measure(bells((10.0, -20.0)), FLAT, (0, 90), SQUARE)
    runs = excess.runs
    best = runs[np.argmax(runs.excess_mm)[None]]
    assert len(best) == 1 and best.held.all() and best.spans[0] == 1
    assert np.abs(best.top_mm[0] - (10, -20)).max() < 2
    assert best.low_mm[0] <= best.excess_mm[0] <= best.high_mm[0]
    at = np.rint((np.array([10, -20]) - excess.largest.origin_mm) / excess.largest.spacing_mm).astype(int)
    assert excess.largest.values[at[1], at[0]] == pytest.approx(best.excess_mm[0], rel=0.02)
    assert excess.largest.values[0, 0] == 0


@pytest.mark.parametrize(("wide", "high"), [(24.0, 3.0), (60.0, 5.0)])
def test_the_uncertainty_is_two_deviations_of_what_noise_does_to_the_low_end(wide: float, high: float) -> None:
    flat, found = bells((0.5, 0.0), wide=wide, high=high), []
    for seed in range(24):
        noise_mm = 0.05 * np.random.default_rng(seed).standard_normal(flat.values.shape)
        runs = fibre.measure(Grid(flat.values + noise_mm, flat.origin_mm, 1.0), FLAT, (0, 90), SQUARE).runs
        over = runs[(runs.family == 0) & (runs.gap_mm > 0.5 * high)]
        middle = over[np.argmin(np.abs(over.top_mm[:, 1]))[None]]
        found.append((middle.low_mm[0], middle.uncertainty_mm[0]))
    low_mm, stated_mm = np.array(found).T
    assert 0.7 < stated_mm.mean() / (2 * low_mm.std()) < 1.6  # 24 draws know their deviation within 15 %


def test_a_line_over_two_pockets_is_one_run_only_where_a_fold_draws_both() -> None:
    for draw_mm, spans in ((21.0, 2), (4.0, 1)):
        excess = fibre.measure(bells((-32.0, 0.0), (32.0, 0.0)), FLAT, (0, 90), SQUARE, draw_mm=draw_mm)
        assert excess.runs.spans.max() == spans


def test_a_grid_of_equal_angles_finds_what_two_angles_find() -> None:
    heights = bells((10.0, -20.0))
    angles = Grid(np.full((4, 4, 2), (30.0, 120.0)), np.array([-100.0, -100.0]), 70.0)
    straight, along = (fibre.measure(heights, FLAT, given, SQUARE).runs for given in ((30.0, 120.0), angles))
    assert along.excess_mm.max() == pytest.approx(straight.excess_mm.max(), rel=0.01)


def test_without_an_outline_the_ends_of_lines_are_unknown() -> None:
    runs = fibre.measure(bells((70.0, 0.0), wide=30), FLAT).runs
    assert (runs.ends[runs.family == 0, 1] == fibre.UNKNOWN).all()
    assert (runs.ends[runs.family == 0, 0] == fibre.HELD).all()


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"height_map": Grid(np.zeros((3, 3, 2)), np.zeros(2), 1.0)}, "height_map"),
        ({"fibre_angles_deg": (0, np.nan)}, "fibre_angles_deg"),
        ({"apart_mm": 0.0}, "apart_mm"),
        ({"apart_mm": 1e-6}, "apart_mm: expected at least a tenth of the heights. spacing"),
        ({"apart_mm": float("nan")}, "apart_mm"),
        ({"thickness_mm": -1.0}, "thickness_mm"),
        ({"ply_outline": [(0, 0), (1, 1)]}, "ply_outline"),
    ],
)
def test_bad_input_is_named(changed: dict[str, object], named: str) -> None:
    given = {"height_map": bells((0.0, 0.0)), "reference": FLAT, **changed}
    with pytest.raises(InputError, match=named):
        fibre.measure(**given)


def test_nothing_seen_has_no_runs() -> None:
    nothing = Grid(np.full((50, 60), np.nan), np.array([-30.0, -30.0]), 1.0)
    assert len(fibre.measure(nothing, FLAT, (0, 90), SQUARE).runs) == 0
