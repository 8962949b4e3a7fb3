"""The 2-D section model against closed forms and exact values of the elastica; its parts: tests/cpp/ridge."""

import doctest
import math
import threading

import numpy as np
import pytest

import debulk.section
from debulk import InputError, Recipe
from debulk._core import Stop
from debulk.ridge import ridge_height
from debulk.section import elastic_fold, elastic_height, fold
from debulk.verdict import natural_length

# A natural length of 1 mm and a pressure of 1 MPa: figures are in units of l, P l.
UNIT = Recipe(material={"thickness_mm": 0.1, "young_mpa": 12000.0}, loads={"pressure_mpa": 1.0}, level={"tol_mm": 0.05})
LINES = {"recipe": UNIT, "contact_distance_mm": 0.0}  # flanks touch as lines, as in the exact values

# (dL/l, pressure): h/l, foot width/l, end force/(P l)
EXACT = {
    (0.5, "vertical"): (0.8622, 3.945, 4.118),
    (1.0, "vertical"): (1.2444, 3.962, 3.320),
    (2.0, "vertical"): (1.7466, 3.594, 2.624),
    (0.5, "following"): (0.8709, 4.042, 3.425),
    (1.0, "following"): (1.2693, 4.162, 2.327),
    (2.0, "following"): (1.8225, 4.025, 1.247),
}


def three_nodes(spacing, centre):
    """Excess and span of two segments whose middle node stands up."""
    half = math.sqrt(spacing**2 - centre**2)
    return 2 * (spacing - half), 2 * half


def certified(*args, **options):
    found = fold(*args, **options)
    assert found.certified, found.explanation
    assert found.length_error < 1e-7
    assert found.penetration_mm <= 1e-3
    assert found.kkt_error < 1e-4
    return found


@pytest.mark.parametrize(("excess", "pressure"), EXACT)
def test_exact_values(excess, pressure):
    found = certified(excess, 7.0, segments=300, steps=1, pressure=pressure, **LINES)
    height, foot, force = EXACT[excess, pressure]
    assert found.natural_length_mm == pytest.approx(1, rel=1e-12)
    assert found.height_mm == pytest.approx(height, abs=1.5e-4)
    assert found.foot_width_mm == pytest.approx(foot, abs=3e-3)
    assert found.end_force_n_per_mm == pytest.approx(force, abs=1e-3)
    assert found.guide_force_n_per_mm == pytest.approx(0, abs=1e-8)


@pytest.mark.parametrize("pressure", ["following", "vertical"])
def test_small_folds_follow_the_closed_form(pressure):
    far = []
    for excess in (1e-1, 1e-2, 1e-3):
        lifted = 4.844 * excess ** (1 / 7)
        found = certified(excess, 1.5 * lifted, segments=200, steps=1, pressure=pressure, **LINES)
        far.append(
            [
                found.height_mm / (1.3256 * excess ** (4 / 7)) - 1,
                (found.foot_width_mm + excess) / lifted - 1,
                found.end_force_n_per_mm / (3.441 * excess ** (-2 / 7)) - 1,
            ]
        )
    assert np.all(np.abs(far[0]) < 0.05)
    assert np.all(np.abs(far[2]) < 2e-3)
    assert abs(far[2][0]) < abs(far[0][0]) / 4


def test_the_error_falls_with_the_square_of_the_segments():
    # All of the ply is lifted: no foot that lies between nodes, now nearer to the one and now to the other.
    height, force = zip(
        *(
            (found.height_mm, found.end_force_n_per_mm)
            for found in (certified(1.0, 2.0, segments=n, steps=1, **LINES) for n in (32, 64, 128, 256))
        ),
        strict=True,
    )
    for values in (height, force):
        coarse, middle, fine = np.abs(np.diff(values))
        assert 1.9 < math.log2(coarse / middle) < 2.1
        assert 1.9 < math.log2(middle / fine) < 2.1
    # With a floor the error is within one parabola.
    for n in (60, 90, 120, 180, 250):
        found = certified(1.0, 7.0, segments=n, steps=1, **LINES)
        assert abs(found.height_mm - 1.26927) < 9.0 / n**2
        assert abs(found.end_force_n_per_mm - 2.3267) < 40.0 / n**2


@pytest.mark.parametrize(("pressure", "threshold"), [("vertical", 5.11), ("following", 5.87)])
def test_flanks_meet_at_the_known_excess(pressure, threshold):
    def nearest(excess):
        found = certified(excess, 7.5, segments=500, steps=1, pressure=pressure, recipe=UNIT, self_contact=False)
        return float(found.points_mm[260:, 0].min())

    assert nearest(threshold - 0.03) > 0 > nearest(threshold + 0.03)


def test_self_contact_keeps_the_flanks_apart():
    def closest(**options):
        x = certified(7.0, 8.0, recipe=UNIT, steps=1, **options).points_mm[:, 0]
        return float(np.min((x[::-1] - x)[:85]))

    assert closest(self_contact=False) < -0.05
    assert closest(contact_distance_mm=0.0) == pytest.approx(0, abs=1e-5)
    assert closest(contact_distance_mm=0.2) == pytest.approx(0.2, abs=1e-5)
    assert closest() == pytest.approx(0.1, abs=1e-5)  # the ply's thickness


def test_the_fold_of_the_paper_by_both_bendings():
    excess, span = three_nodes(9.3, 3.2)
    for pressure, wanted in (("following", 0.89), ("vertical", 0.85)):
        soft = certified(excess, span, bending="paper", pressure=pressure)
        stiff = certified(excess, span, pressure=pressure)
        assert soft.height_mm == pytest.approx(wanted, abs=0.015)
        assert 1.3 < stiff.height_mm < 1.9
        assert stiff.natural_length_mm == pytest.approx(2.008, abs=1e-3)
        assert soft.natural_length_mm == pytest.approx(stiff.natural_length_mm / 100 ** (1 / 3), rel=1e-12)


def test_a_tall_fold_closes_at_two_thicknesses():
    excess, span = three_nodes(8.40, 4.66)
    found = certified(excess, span, bending="paper")
    assert found.height_mm == pytest.approx(1.60, abs=0.02)
    assert found.height_mm == pytest.approx(ridge_height(span + excess, span, 0.3), abs=0.08)
    x = found.points_mm[:, 0]
    assert np.min((x[::-1] - x)[:90]) == pytest.approx(0.3, abs=1e-4)


def test_load_steps_end_where_one_step_does():
    excess, span = three_nodes(9.3, 3.2)
    found = certified(excess, span)
    assert [step.pressure_mpa for step in found.steps] == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1])
    heights = [step.height_mm for step in found.steps]
    assert heights == sorted(heights, reverse=True)
    assert (found.height_mm, found.end_force_n_per_mm) == (heights[-1], found.steps[-1].end_force_n_per_mm)
    assert all(step.iterations > 0 for step in found.steps)
    once = certified(excess, span, steps=1)
    assert once.height_mm == pytest.approx(found.height_mm, abs=1e-6)
    assert found.points_mm.shape == (201, 2)
    assert found.points_mm[[0, -1]] == pytest.approx(np.array([[-span / 2, 0], [span / 2, 0]]), abs=1e-12)
    assert found.points_mm[100, 1] == found.points_mm[:, 1].max() == pytest.approx(found.height_mm, abs=1e-12)


def test_a_path_that_leaves_the_single_fold_is_put_back():
    # Under two fifths of this dead load the warm start ends with the crown pressed in.
    found = certified(2.398, 6.013, segments=214, pressure="vertical", recipe=UNIT)
    assert found.height_mm == pytest.approx(
        certified(2.398, 6.013, segments=214, steps=1, pressure="vertical", recipe=UNIT).height_mm, abs=1e-5
    )


def test_sections_of_all_kinds_end_certified():
    rng = np.random.default_rng(5)
    for _ in range(40):
        excess = math.exp(rng.uniform(math.log(2e-3), math.log(6)))
        lifted = 4.844 * excess ** (1 / 7)
        span = max(1.3 * excess, lifted * math.exp(rng.uniform(math.log(0.5), math.log(6))))
        segments = 2 * math.ceil((span + excess) / lifted * rng.uniform(6, 12))
        options = {"steps": int(rng.choice([1, 3])), "pressure": str(rng.choice(["following", "vertical"]))}
        found = certified(excess, span, UNIT, max(16, segments), **options)
        assert found.height_mm < max(1.01 * 1.3256 * excess ** (4 / 7), excess / 2 + 1)
        assert abs(found.guide_force_n_per_mm) < 1e-6


def test_a_flat_profile_is_no_profile():
    with_points = certified(1.0, 16.0, profile=[[-8, 0.0], [1, 0], [8, 0]])
    assert with_points.height_mm == pytest.approx(certified(1.0, 16.0).height_mm, abs=1e-9)


def test_a_failure_is_a_status_and_has_no_figures():
    stop = Stop()
    stop.cancel()
    for found, status in ((fold(1.0, 16.0, stop=stop), "cancelled"), (fold(1.0, 16.0, deadline_s=0.0), "deadline")):
        assert (found.certified, found.status) == (False, status)
        assert math.isnan(found.height_mm + found.foot_width_mm + found.end_force_n_per_mm + found.kkt_error)
        assert len(found.steps) == 1
        assert found.explanation


def test_it_lets_other_threads_run_and_gives_them_the_same_bits():
    alone = fold(1.0, 16.0)
    found = []
    threads = [threading.Thread(target=lambda: found.append(fold(1.0, 16.0))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(other.points_mm, alone.points_mm) for other in found)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"excess_length_mm": -0.1}, "excess_length_mm: expected a positive length in mm, but got -0.1"),
        ({"excess_length_mm": 0.0}, "excess_length_mm: expected a positive length"),
        ({"excess_length_mm": math.nan}, "excess_length_mm: expected a positive length in mm, but got nan"),
        ({"excess_length_mm": 17.0}, "excess_length_mm: expected at most span_mm, but got 17"),
        ({"excess_length_mm": 1e-3}, "excess_length_mm: expected 0.00200"),
        ({"span_mm": 0.0}, "span_mm: expected a positive length in mm, but got 0"),
        ({"span_mm": math.inf}, "span_mm: expected a positive length"),
        ({"segments": 14}, "segments: expected an even number from 16"),
        ({"segments": 201}, "segments: expected an even number"),
        ({"segments": 16}, "segments: expected 20 to 1128 for a ply 17 mm long"),
        ({"segments": 2000}, "segments: expected 20 to 1128 for a ply 17 mm long"),
        ({"steps": 0}, "steps: expected 1 to 1000, but got 0"),
        ({"pressure": "normal"}, 'pressure: expected "following" or "vertical", but got "normal"'),
        ({"bending": "unscaled"}, 'bending: expected "consistent" or "paper", but got "unscaled"'),
        ({"contact_distance_mm": -0.1}, "contact_distance_mm: expected 0 mm or more"),
        ({"profile": [[-8, 0, 0], [8, 0, 0]]}, r"profile: expected an \(N, 2\) array, but got shape \(2, 3\)"),
        ({"profile": np.empty((0, 2))}, "profile: expected two or more points, but got 0"),
        ({"profile": [[-8, 0], [0, math.nan], [8, 0]]}, "profile: expected finite coordinates, .* point 1"),
        ({"profile": [[-8, 0], [2, 0], [1, 0], [8, 0]]}, "profile: expected x to grow .* step back to point 2"),
        ({"profile": [[-8, 0], [7, 0]]}, "profile: expected points from -span_mm / 2 .* from -8 to 7 for a span of 16"),
        ({"profile": [[-8, 0], [-1, 30], [0, -10], [8, 30]]}, "profile: expected a mold that does not overhang"),
    ],
)
def test_input_is_checked(changes, message):
    with pytest.raises(InputError, match=message):
        fold(**({"excess_length_mm": 1.0, "span_mm": 16.0} | changes))


def test_doctests():
    assert doctest.testmod(debulk.section).failed == 0


@pytest.mark.parametrize("excess_mm", [0.01, 0.05, 0.3, 0.94, 2.4, 5.3, 8.7, 13.0, 30.0])
@pytest.mark.parametrize(("thickness_mm", "young_mpa"), [(0.2, 360.0), (0.3, 360.0), (0.3, 90.0)])
def test_the_table_of_elastic_folds_is_the_folds(excess_mm, thickness_mm, young_mpa):
    recipe = Recipe(material={"thickness_mm": thickness_mm, "young_mpa": young_mpa})
    length_mm = natural_length(young_mpa, thickness_mm, 0.1)
    flanks_touch = excess_mm > 5 * length_mm
    found = fold(excess_mm, 12 * length_mm + excess_mm, recipe, segments=600)
    assert found.certified
    along, up = np.diff(found.points_mm, axis=0).T
    side = elastic_fold(excess_mm, recipe)
    assert elastic_height(excess_mm, recipe) == side.height_mm
    assert side.height_mm == pytest.approx(found.height_mm, rel=2e-2 if flanks_touch else 5e-3)
    assert side.foot_width_mm == pytest.approx(found.foot_width_mm, rel=6e-2 if flanks_touch else 1.5e-2)
    assert side.slope_deg == pytest.approx(np.degrees(np.arctan2(up, along).max()), rel=3e-2 if flanks_touch else 5e-3)


def test_without_excess_there_is_no_elastic_fold():
    assert elastic_height(0.0) == elastic_height(-0.2) == 0.0
    assert elastic_fold(-0.2).foot_width_mm == elastic_fold(-0.2).slope_deg == 0.0
    with pytest.raises(InputError, match="excess_length_mm"):
        elastic_height(float("nan"))
