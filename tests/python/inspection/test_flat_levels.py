"""Plies on a flat plate: a step is told from a tilt, too few squares are named, and no figure rounds to nothing."""

from __future__ import annotations

import re

import numpy as np
import pytest

from debulk import Inspector, Recipe, Verdict

PITCH_MM = 1.0


def inspected(ply_mm, wide_mm, rise=lambda x, y: 0 * x, **recipe):
    """Inspect a ply, x, y, width and height, on a plate of (width, height), that stands up by so much."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(0, wide_mm[0], PITCH_MM), np.arange(0, wide_mm[1], PITCH_MM))
    left, low, width, height = ply_mm
    on = (x > left) & (x < left + width) & (y > low) & (y < low + height)
    reference, scan = (
        np.stack([x, y, z + rng.normal(0, 0.02, x.shape)], axis=-1) for z in (0 * x, np.where(on, 0.3 + rise(x, y), 0))
    )
    corners = [[left, low], [left + width, low], [left + width, low + height], [left, low + height]]
    return Inspector(Recipe(**recipe), reference, np.array(corners, dtype=float)).inspect(scan)


WIDE = ((40, 40, 600, 400), (680, 480))
STEPS = {
    "half of it": (lambda x, y: 0.15 * (x > 340), 50, 0.15, 90),
    "a third": (lambda x, y: 0.15 * (x < 240), 33, 0.15, 90),
    "askew, 0.2 mm": (lambda x, y: 0.2 * ((x - 340) + 0.5 * (y - 240) > 0), 50, 0.2, 117),
    "two plies of paper": (lambda x, y: 0.4 * (y > 240), 50, 0.4, 0),
}


@pytest.mark.parametrize("name", list(STEPS))
def test_backing_paper_left_on_is_a_step(name):
    rise, share, height_mm, line_deg = STEPS[name]
    report = inspected(*WIDE, rise)
    assert report.verdict is Verdict.INVALID
    found = re.match(
        r"(\d+) % of the ply lies (\S+) mm higher than the rest, by a step .* at (\d+) degrees", report.reason
    )
    assert found, report.reason
    assert float(found[1]) == pytest.approx(share, abs=8)
    assert float(found[2]) == pytest.approx(height_mm, abs=0.03)
    assert abs((float(found[3]) - line_deg + 90) % 180 - 90) < 10
    assert "backing paper" in report.reason


@pytest.mark.parametrize(
    ("rise", "name"),
    [
        (lambda x, y: 0.3 * (x - 340) / 600, "tilted by"),
        (lambda x, y: 0.4 * ((x - 340) / 300) ** 2 - 0.1, "bent by"),
        (lambda x, y: 0.3 * (x - 340) / 300 * (y - 240) / 200, "bent by"),
    ],
    ids=["tilt", "bow", "warp"],
)
def test_what_rises_evenly_is_no_step(rise, name):
    report = inspected(*WIDE, rise)
    assert report.verdict is Verdict.INVALID
    assert name in report.reason
    assert "step" not in report.reason


def test_no_figure_of_a_reason_rounds_to_nothing():
    """Four patches that stand up leave a parabola level: it is not bent."""
    rise = lambda x, y: 0.15 * ((abs(abs(x - 340) - 160) < 60) & (abs(abs(y - 240) - 100) < 50))  # noqa: E731
    report = inspected(*WIDE, rise)
    assert report.verdict is Verdict.INVALID
    assert not re.search(r"\b0\.0+ mm", report.reason), report.reason
    assert "bent" not in report.reason


FEW = {
    "small in the scan": ((240, 240, 60, 50), (1000, 900), r"only \d+ of the \d+ points .* crop scan and reference"),
    "small": ((80, 80, 40, 40), (200, 200), r"only 4 squares of 10 mm lie 10 mm inside its outline, and 6 are needed"),
}


@pytest.mark.parametrize("name", list(FEW))
def test_a_ply_with_too_few_squares_is_told_why(name):
    ply_mm, wide_mm, reason = FEW[name]
    report = inspected(ply_mm, wide_mm)
    assert report.verdict is Verdict.INVALID
    assert re.search(reason, report.reason), report.reason


def _ring(x, y):
    """A fold 40 mm wide that runs all round the ply, 35 mm inside its edge: within it the ply lies flat."""
    to_edge = np.minimum.reduce([x - 40, 640 - x, y - 40, 440 - y])
    return 5 * np.cos(np.pi * np.clip((to_edge - 35) / 40, -0.5, 0.5)) ** 2


def test_a_pocket_that_closes_in_the_whole_ply_leaves_no_level_to_read():
    report = inspected(*WIDE, _ring)
    assert report.verdict is Verdict.INVALID
    assert re.search(r"pockets with their feet leave only 0.0 % of the ply between them; lay it down", report.reason)


def test_an_uncertainty_does_not_round_to_nothing():
    report = inspected(*WIDE, level={"tol_mm": 1e-4})
    assert report.verdict is Verdict.INVALID
    assert re.search(r"uncertain by 0\.0*[1-9]\d* mm, and its tolerance is 0.0001 mm", report.reason), report.reason


def test_a_small_ply_passes_once_the_scan_is_cropped():
    assert inspected((50, 50, 60, 50), (160, 150)).verdict is Verdict.CEASE
