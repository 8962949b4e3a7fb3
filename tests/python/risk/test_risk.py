"""Probabilities of made-up pockets, whose ridges by the excess are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from debulk.recipe import Recipe
from debulk.results.bridge_section import BridgeSection
from debulk.results.report import ExcessReport, PocketReport
from debulk.results.runs import ExcessRuns
from debulk.risk import place_of, risk
from debulk.risk.place import _LEAST_SD_MM, FOOT, RESIDUALS, SHARES
from debulk.verdict import Verdict
from lab.sampled_risk import sampled

LIMIT_EXCESS_MM = 2 * (0.6 - FOOT * 0.3)


def pocket(number, excess_mm, *, noise_mm=0.005, joined_mm=0.0, **changes):
    height = excess_mm / 2 + FOOT * 0.3
    known = ExcessReport(
        length_mm=excess_mm, height_mm=height, range_mm=(height - 0.02, height + 0.02 + joined_mm),
        alone_mm=height + 0.02, elastic_mm=1.0, noise_mm=noise_mm, uncertainty_mm=0.02, bridge_bound_mm=0.0,
        missed_mm=joined_mm,
    )  # fmt: skip
    return replace(
        PocketReport(
            id=number, verdict=Verdict.CEASE, reason="", decided_by="excess", excess=known, outline_mm=np.zeros((0, 2)),
            area_mm2=1.0, peak_mm=1.0, volume_mm3=1.0,
        ),
        **changes,
    )  # fmt: skip


def shared_run(*numbers):
    """One line over all these pockets: a stretch over each, and the run of all."""
    at, half = np.array([[100.0 * k, 0.0] for k in range(len(numbers))]), np.array([10.0, 0.0])
    one = len(numbers)
    rows = {
        "family": np.zeros(one + 1), "line": np.zeros(one + 1), "spans": [1] * one + [one],
        "from_mm": [*(at - half), at[0] - half], "to_mm": [*(at + half), at[-1] + half], "top_mm": [*at, at[0]],
        "ends": np.zeros((one + 1, 2)), "beyond_mm": np.zeros((one + 1, 2)), "pocket": [*numbers, 0],
    }  # fmt: skip
    other = ("gap_mm", "length_mm", "flat_mm", "low_mm", "excess_mm", "high_mm", "uncertainty_mm", "turn_mm")
    return ExcessRuns(**rows, **{name: np.zeros(one + 1) for name in other}, apart_mm=2.0)


def of(excess_mm, **changes):
    return risk([pocket(1, excess_mm, **changes)], None, Recipe()).pockets[1]


def test_the_laws_are_those_that_were_measured():
    text = (Path(__file__).parents[3] / "bench" / "risk" / "risk.txt").read_text(encoding="utf-8")
    for law, what in ((SHARES, "by eighths, of all: "), (RESIDUALS, "by sixteenths, of all: ")):
        measured = text.split(what)[1].split("\n")[0]
        assert measured == ", ".join(f"{v:.3f}" for v in law)


def test_it_grows_with_the_excess_from_none_to_certain():
    found = [of(k * LIMIT_EXCESS_MM) for k in (0.5, 0.9, 1.0, 1.05, 1.2, 2.5)]
    assert found == sorted(found)
    assert found[0] < 1e-6 and found[-1] > 1 - 1e-6
    assert found[2] < 0.1 and found[3] > 0.3  # a fold gathers most of the excess, not all


def test_it_is_the_share_of_heights_above_the_limit_where_nothing_scatters():
    sharp = Recipe(uncertainty={"thickness_share": 0, "height_share": 0, "angle_deg": 0})
    one = pocket(1, 1.15 * LIMIT_EXCESS_MM, noise_mm=0.0)
    excess_mm = 1.15 * LIMIT_EXCESS_MM + 2 * _LEAST_SD_MM * RESIDUALS
    share = (np.outer(SHARES, excess_mm) > LIMIT_EXCESS_MM).mean()
    assert risk([one], None, sharp).pockets[1] == pytest.approx(share, abs=0.01)


def test_an_unsure_limit_moves_it_towards_a_half():
    unsure = Recipe(uncertainty={"limit_mm": 0.1})
    for excess_mm in (0.8, 1.3):
        sure, less = (risk([pocket(1, excess_mm)], None, recipe).pockets[1] for recipe in (Recipe(), unsure))
        assert abs(less - 0.5) < abs(sure - 0.5)
    spread = Recipe(uncertainty={"spread_mm": 0.1})
    assert risk([pocket(1, 0.8)], None, spread).pockets[1] == pytest.approx(
        risk([pocket(1, 0.8)], None, unsure).pockets[1], abs=0.02
    )


def test_what_pockets_share_makes_them_fail_together():
    pockets = [pocket(k, 0.9) for k in range(1, 11)]
    apart = risk(pockets, None, Recipe(uncertainty={"spread_mm": 0.1}))
    shared = risk(pockets, None, Recipe(uncertainty={"limit_mm": 0.1}))
    assert shared.layup < 0.8 * apart.layup
    assert shared.layup > max(shared.pockets.values())


def test_pockets_on_one_fibre_are_drawn_together_or_not():
    two = [pocket(k, 0.7, joined_mm=0.35) for k in (1, 2)]
    apart, together = (risk(two, runs, Recipe()) for runs in (None, shared_run(1, 2)))
    assert apart.pockets == together.pockets
    assert together.pockets[1] == pytest.approx(0.5, abs=0.05)  # all but certain if joined, all but excluded alone
    assert together.layup == pytest.approx(together.pockets[1], abs=0.03)
    assert of(0.7) < 0.01


def test_a_pocket_that_the_minima_decide_lies_anywhere_in_its_range():
    by_net = pocket(1, 0.9, decided_by="paper", excess=None, ridge_height_mm=0.5, ridge_range_mm=(0.4, 0.8))
    assert risk([by_net], None, Recipe()).pockets[1] == pytest.approx(0.5, abs=0.02)


def test_a_bridge_that_decides_lies_anywhere_in_its_range_whatever_the_excess_is():
    section = BridgeSection(
        height_mm=0.6, range_mm=(0.5, 0.7), lacks_mm=0.4, lacks_error_mm=0.04, pull_n_per_mm=3.0, hold_n_per_mm=9.0
    )
    assert of(0.0) < 1e-6
    assert of(0.0, bridge_section=section) == pytest.approx(0.5, abs=0.02)
    assert of(0.0, bridge_section=replace(section, height_mm=2.0, range_mm=(1.9, 2.1))) > 1 - 1e-6


def test_what_is_not_known_has_no_probability():
    found = risk([pocket(1, 0.3), pocket(2, 0.3, verdict=Verdict.INVALID)], None, Recipe())
    assert found.pockets[2] is None and found.layup is None and found.pockets[1] < 1e-9
    assert place_of(pocket(2, 0.3, verdict=Verdict.INVALID), None, Recipe()) is None
    assert sampled([pocket(2, 0.3, verdict=Verdict.INVALID)], None, Recipe(), 10).layup is None


def test_drawing_gives_the_same():
    pockets = [pocket(k, mm, joined_mm=j) for k, (mm, j) in enumerate([(0.8, 0.1), (0.95, 0.0), (1.05, 0.0)], 1)]
    recipe = Recipe(uncertainty={"limit_mm": 0.02, "spread_mm": 0.01})
    first, drawn = risk(pockets, None, recipe), sampled(pockets, None, recipe, 40_000)
    for number in first.pockets:
        assert drawn.pockets[number] == pytest.approx(first.pockets[number], abs=0.012)
    assert drawn.layup == pytest.approx(first.layup, abs=0.02)
