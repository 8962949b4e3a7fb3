"""The rework of made-up runs: lines along x, 2 mm apart, on a ply of 400 by 200 mm."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from debulk import InputError
from debulk.fibre import FREE, HELD, FibreRuns
from debulk.recipe import Recipe
from debulk.results.report import ReportData
from debulk.results.rework import rework
from debulk.rework import Handling, plan
from debulk.verdict import Verdict

OUTLINE = np.array([[-200.0, -100], [200, -100], [200, 100], [-200, 100]])
TARGET_MM = 2 * 0.55 - (4 - np.pi) * 0.3
ONE_HAND = Handling(hold_n=200.0)


def runs(*rows, count=9):
    """Runs on lines y = 0, 2, ...; each row is (from x, to x, excess in the middle line, pocket), single stretches.

    The excess falls to nothing at the outermost lines. Two rows less than 21 mm apart are joined, too.
    """
    columns, pockets = {}, []
    for k in range(count):
        share = 1 - abs(2 * k / (count - 1) - 1)
        singles = [(a, b, share * mm, 1, number) for a, b, mm, number in rows]
        joined = [(p[0], q[1], p[2] + q[2], 2, 0) for p, q in itertools.pairwise(singles) if q[0] - p[1] < 21]
        for a, b, mm, spans, number in (*singles, *joined):
            flat = sum(q[0] - p[1] for p, q in itertools.pairwise(singles)) if spans == 2 else 0.0
            one = {
                "family": 0, "line": k, "spans": spans, "from_mm": (a, 2.0 * k), "to_mm": (b, 2.0 * k),
                "top_mm": ((a + b) / 2, 2.0 * k), "gap_mm": 3.0, "length_mm": b - a, "flat_mm": flat, "low_mm": mm,
                "excess_mm": mm, "high_mm": mm, "uncertainty_mm": 0.04, "turn_mm": 0.0, "ends": (HELD, HELD),
                "beyond_mm": (a + 200, 200 - b),
            }  # fmt: skip
            for name, value in one.items():
                columns.setdefault(name, []).append(value)
            pockets.append(number)
    return FibreRuns(**{name: np.array(values) for name, values in columns.items()}), np.array(pockets)


def planned(made, failing=(1,), outline=OUTLINE, handling=ONE_HAND):
    return plan(*made, failing, Recipe(), outline, handling=handling)


def test_what_exceeds_the_target_leaves_towards_the_nearer_edge():
    (move,) = planned(runs((40, 80, 1.5, 1))).moves
    assert (move.pockets, move.fibre, move.by, move.into) == ((1,), 0, "pull", False)
    assert move.towards_deg == 0.0
    assert move.length_mm == pytest.approx(1.5 + 0.04 - TARGET_MM)  # with its uncertainty
    assert move.flat_mm == pytest.approx(120.0)
    assert move.to_mm[:, 0] == pytest.approx(200.0)
    assert move.lengths_mm.max() == move.lengths_mm[len(move.lengths_mm) // 2]
    left = 1.5 * (1 - np.abs(2 * np.arange(9) / 8 - 1)) + 0.04
    assert move.band_mm == 2.0 * (left > TARGET_MM).sum()


def test_the_other_way_where_the_pocket_lies_on_the_other_side():
    (move,) = planned(runs((-80, -40, 1.5, 1))).moves
    assert move.towards_deg == 180.0 and move.to_mm[:, 0] == pytest.approx(-200.0)


def test_nothing_has_to_leave_what_passes():
    none = planned(runs((40, 80, 0.7, 1)))
    assert none.moves == () and none.without == (1,)
    assert planned(runs((40, 80, 1.5, 2)), failing=(1,)).moves == ()
    assert str(planned(runs((40, 80, 0.7, 1)), failing=())) == "no length has to leave"


def test_a_pocket_farther_in_passes_its_length_through_its_neighbour_and_comes_first():
    first, second = planned(runs((10, 40, 1.5, 1), (80, 110, 1.2, 2)), failing=(1, 2)).moves
    assert (first.pockets, first.into, second.pockets, second.into) == ((1,), True, (2,), False)
    assert first.to_mm[:, 0] == pytest.approx(80.0) and first.flat_mm == pytest.approx(40.0)
    assert second.length_mm == pytest.approx(1.5 + 1.2 + 0.08 - 2 * TARGET_MM)
    assert second.flat_mm == pytest.approx(90.0)


def test_neighbours_that_only_exceed_it_together_give_the_least_at_the_one_nearer_the_edge():
    (move,) = planned(runs((60, 90, 0.8, 1), (100, 130, 0.8, 2)), failing=(1, 2)).moves
    assert move.pockets == () or move.pockets == (2,)
    made = runs((60, 90, 0.8, 1), (100, 130, 0.8, 2))
    together = (made[0], np.where(made[0].spans == 2, 1, made[1]))
    (move,) = planned(together, failing=(1, 2)).moves
    assert move.pockets == (2,) and move.length_mm == pytest.approx(1.6 + 0.04 - TARGET_MM)


def test_more_than_the_fibre_surely_has_does_not_leave():
    made, pockets = runs((40, 80, 1.5, 1))
    unsure = replace(made, high_mm=made.high_mm + 2.0, low_mm=np.minimum(made.low_mm, 1.0))
    (move,) = planned((unsure, pockets)).moves
    assert move.length_mm == pytest.approx(1.0)


def test_what_cannot_be_held_is_laid_again_from_there():
    (move,) = planned(runs((40, 80, 1.5, 1)), handling=Handling(hold_n=1.0)).moves
    assert move.by == "lift" and move.force_n > 1.0 and move.towards_deg == 0.0
    assert "lift the ply from the edge at (200, 8) mm back to there and lay it again" in move.line(1.0)


def test_a_band_that_would_shear_much_is_laid_again_and_a_gentler_one_pulled():
    steep, gentle = (planned(runs((40, 80, 4.0, 1), count=count)).moves[0] for count in (9, 41))
    assert max(steep.force_n, gentle.force_n) < ONE_HAND.hold_n and (steep.by, gentle.by) == ("lift", "pull")
    steps = np.diff([0.0, *steep.lengths_mm, 0.0])
    assert steep.across_mm == pytest.approx((np.hypot(steps, 2.0) - 2.0).sum())
    assert gentle.across_mm < 0.37 and steep.across_mm > 0.38
    assert f"a pull would draw the ply beside the band in by {steep.across_mm:.2f} mm" in steep.line(200.0)


@pytest.mark.parametrize("outline", [None, OUTLINE * 2])
def test_no_way_is_known_without_an_outline_or_past_what_was_not_seen(outline):
    (move,) = planned(runs((40, 80, 1.5, 1)), outline=outline).moves
    assert (move.by, move.towards_deg, move.force_n) == ("lift", None, 0.0)
    assert "no way out to an edge is known" in move.line(42.0)


def test_the_force_grows_with_the_way_and_with_the_sticking():
    near, far = (planned(runs((x, x + 40, 1.5, 1))).moves[0] for x in (120, 40))
    assert far.force_n == pytest.approx(3 * near.force_n)
    firm = planned(runs((40, 80, 1.5, 1)), handling=Handling(200.0, 0.004)).moves[0]
    assert 2 * far.force_n < firm.force_n < 4 * far.force_n  # it drags less beside it


def test_a_held_run_over_no_pocket_counts_and_a_free_one_does_not():
    made, pockets = runs((40, 80, 1.5, 0))
    assert len(planned((made, pockets), failing=()).moves) == 1
    free = replace(made, ends=np.full_like(made.ends, FREE))
    assert planned((free, pockets), failing=()).moves == ()


def test_the_plan_as_json_says_points_direction_and_length():
    tree = json.loads(planned(runs((40, 80, 1.5, 1))).to_json())
    assert (tree["format"], tree["hold_n"], len(tree["moves"])) == ("debulk rework", 200.0, 1)
    middle = max(tree["moves"][0]["lines"], key=lambda line: line["length_mm"])
    assert middle["from_mm"] == [80.0, 8.0] and middle["to_mm"] == [200.0, 8.0]


@pytest.mark.parametrize("value", [0, -1.0, float("nan"), float("inf"), "x"])
def test_impossible_forces_are_refused(value):
    with pytest.raises(InputError, match="hold_n: expected a positive number"):
        Handling(hold_n=value)


def test_a_report_without_fibre_lines_has_no_rework(report):
    assert rework(ReportData(verdict=Verdict.CREASE, reason="", pockets=())) is None
    with pytest.raises(InputError, match="it has no fibre lines"):
        replace(report, runs=None).rework()
    assert report.rework().moves
    numbers = {number for move in report.rework().moves for number in move.pockets}
    assert numbers <= {p.id for p in report.creasing} | {4}
