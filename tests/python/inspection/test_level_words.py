"""Every mistake that the level can show is named with its figures, and each limit is where the recipe has it."""

from dataclasses import replace

import numpy as np
import pytest

from debulk import Recipe
from debulk.inspection.evidence.ply_zones import Blocks, PlyZones
from debulk.inspection.evidence.sample import Sample
from debulk.inspection.place import level
from debulk.inspection.place.level_reason import few_squares_reason, level_reason, same_reason, stale_reason

pytestmark = pytest.mark.unit

X, Y = (v.ravel() for v in np.meshgrid(np.arange(-290.0, 300, 20), np.arange(-230.0, 240, 20)))
XY = np.column_stack([X, Y])
U, V = X / 300, Y / 240
THICKNESS_MM = 0.3


def squares(height_mm, noise_mm=0.005, xy=XY):
    """Squares of 20 mm whose ply stands so high above the reference, with a little noise."""
    noise = np.random.default_rng(3).normal(0, noise_mm, len(xy))
    count = len(xy)
    return Blocks(xy, height_mm + noise + np.zeros(count), np.full(count, noise_mm), 20.0, 0.9)


def judged(height_mm, noise_mm=0.005, recipe=None, **shares):
    recipe = recipe or Recipe()
    blocks = squares(height_mm, noise_mm)
    found = level.deviation(blocks, THICKNESS_MM, THICKNESS_MM)
    figures = level.level_of(found, THICKNESS_MM, recipe.level.tol_mm)
    said = level_reason(figures, found, recipe, **shares)
    if said is None:
        return "", figures, found
    assert said.remedy in said.text or said.text.startswith("no ply is seen")
    return said.text, figures, found


def test_a_ply_that_lies_right_has_no_reason():
    said, figures, _ = judged(THICKNESS_MM)
    assert said == ""
    assert figures.laid_mm == pytest.approx(0.3, abs=0.001)
    assert figures.uncertainty_mm == pytest.approx(1.2533 * 0.005 / np.sqrt(len(XY)), rel=0.1)
    assert (figures.low_share, figures.high_share) == (0.0, 0.0)
    assert (figures.blocks, figures.block_mm, figures.judged_share) == (len(XY), 20.0, 0.9)
    assert (figures.thickness_mm, figures.loose_share) == (0.3, 0.0)


@pytest.mark.parametrize(
    ("height_mm", "words"),
    [
        (0.30 + 0.5, ("the scan lies 0.50 mm too high everywhere (between", "stands 0.80 mm above", "check the pose")),
        (0.30 - 0.60, ("the scan lies 0.60 mm too low everywhere", "thickness is 0.3 mm")),
        (-0.13, ("no ply is seen: the scan stands 0.13 mm below the reference", "lies 0.43 mm too low")),
        (
            0.30 + 0.9 * U**2,
            ("is bent by 0.84 mm over the ply", "or the ply stands off the mold widely, by 0.", "lay the ply down",
             "if it does lie on the mold, check the scanner's calibration"),
        ),
        (0.01, ("no ply is seen: the scan stands 0.01 mm above", "by its thickness of 0.3 mm", "lies 0.29 mm too low")),
        (
            0.30 + 0.6 * U,
            ("the scan is tilted by 0.11 degrees about an axis at 90 degrees from x, 1.16 mm from end to end (",
             "check whether scanner or mold moved since"),
        ),
        (0.30 + 0.3 * U + 0.24 * V + 0.4, ("about an axis at 135 degrees", "end to end and lies 0.40 mm too high (")),
        (0.30 - 0.6 * V - 0.5, ("and lies 0.50 mm too low (",)),
        (0.30 + 0.9 * (U**2 - 1 / 3), ("the scan is bent by 0.84 mm over the ply (", "the scanner's calibration")),
        (0.30 + 0.9 * U**2 + 0.2, ("is bent by 0.84 mm over the ply and lies", "too high (")),
        (0.9 * U**2 - 1500.0, ("the scan lies 1500 mm too low: it is in another frame (", "in the mold's frame")),
        (
            0.30 + 0.5 * np.sin(9 * U) * np.sin(9 * V),
            ("% of the ply between the pockets lies more than 0.1 mm too low and", "% too high, worst by",
             "check whether the reference is of this mold and of the plies below"),
        ),
        (
            0.30 + 0.8 * (np.sin(9 * U) * np.sin(9 * V) > 0.4),
            ("0 % of the ply between the pockets lies more than 0.1 mm too low", "worst by +0.8",
             "so widely cannot be judged; lay it down and scan again"),
        ),
        (0.30 + 0.5 * (U > 0), ("50 % of the ply lies 0.50 mm higher than the rest, by a step", "backing paper")),
        (
            0.30 * (U > -0.5),
            ("the mold is bare on 27 % of where the ply should be, beyond a line through", "the outline is this ply's"),
        ),
        (0.30 + 0.5 * (U > -0.5), ("73 % of the ply lies 0.50 mm higher",)),
        (0.30 + 0.6 * U + 0.15 * V**2, ("tilted by 0.11 degrees", "1.16 mm from end to end")),  # of the plane alone
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_figures(height_mm, words):
    said, _, _ = judged(height_mm)
    for part in words:
        assert part in said
    assert "between the pockets the ply stands" in said or "no ply is seen" in said


def test_noise_that_hides_the_level_is_named():
    said, figures, _ = judged(THICKNESS_MM, noise_mm=8.0)
    assert figures.uncertainty_mm > 0.1
    assert said.startswith("the level of the ply cannot be determined: its median height between the pockets is ")
    assert said.endswith(
        "its tolerance is 0.1 mm; scan again, with less noise, and check whether the reference is of this mold"
    )
    said, figures, _ = judged(THICKNESS_MM, noise_mm=1.5)
    assert 0.05 < figures.uncertainty_mm < 0.1 and said.startswith("the level of the ply cannot be determined")


def test_a_ply_that_stands_off_so_widely_that_its_level_is_unknown_is_named():
    lifted_mm = np.random.default_rng(1).uniform(0, 8, len(XY)) * (np.arange(len(XY)) % 4 > 0)
    said, figures, _ = judged(THICKNESS_MM + lifted_mm)
    assert figures.uncertainty_mm > 0.05 and figures.low_share == 0.0
    assert said.startswith(
        "the ply stands off the mold so widely that its level is not known: 0 % of the ply between the pockets lies "
        "more than 0.1 mm too low and 100 % too high, worst by "
    )
    asked = "check whether the reference is of this mold and of the plies below, and whether scanner or mold moved"
    assert said.endswith(f") mm: {asked}")


def test_pockets_and_loose_borders_may_stand_up_by_their_share():
    tenth = 0.8 * (np.arange(len(XY)) % 4 == 0)  # a quarter of the squares, evenly spread
    height = THICKNESS_MM + tenth
    said, figures, _ = judged(height)
    assert said and figures.high_share == pytest.approx(0.25, abs=0.01)
    assert judged(height, loose_share=0.26)[0] == ""
    height = THICKNESS_MM + 0.5 + 0.8 * (np.arange(len(XY)) % 5 < 2)  # two fifths of them
    lifted = [judged(height, pockets_share=share)[0] for share in (0.0, 0.4)]
    assert "too high everywhere" not in lifted[0] and "too high everywhere" in lifted[1]


QUARTER = 0.8 * (np.arange(len(XY)) % 4 == 0)  # of the squares stand up, evenly spread


@pytest.mark.parametrize(
    ("height_mm", "words"),
    [
        (0.30 + 0.12, "lies 0.12 mm too high everywhere"),
        (0.30 + 0.045 + 0.09 * U, "is tilted by"),  # less than half the tolerance too high
        (0.30 + 0.015 + 0.12 * U**2, "is bent by"),
        (0.80 + QUARTER, "too high everywhere"),  # as many as a quarter of the wrong squares may be left
        (0.80 + 0.5 * (np.arange(len(XY)) % 3 - 1), "worst by"),  # too low and too high do not make up for each other
        (0.01 + 0.115 * U, "too low everywhere"),  # a bare mold, too, but for a tilt
    ],
)
def test_a_fit_explains_what_is_larger_than_its_share_of_the_tolerance(height_mm, words):
    assert words in judged(height_mm, 1e-6)[0]


def test_a_bend_that_is_lost_in_the_noise_of_single_squares_is_no_tilt():
    blocks = replace(squares(0.30 + 0.6 * (U**2 - 0.25)), error_mm=np.full(len(XY), 0.5))
    found = level.deviation(blocks, THICKNESS_MM, THICKNESS_MM)
    assert "is bent by" in level_reason(level.level_of(found, 0.3, 0.1), found, Recipe()).text


def test_the_limits_within_which_no_ply_is_seen():
    recipe = Recipe(level={"largest_share": 0.25})
    said, figures, found = judged(0.0 + QUARTER, 1e-6, recipe)  # just as many squares may stand up
    assert said.startswith("no ply is seen")
    reason = level_reason(replace(figures, laid_mm=0.1), found, recipe)  # the tolerance
    assert reason.text.startswith("no ply is seen")
    assert reason.remedy == "look whether the ply is on the mold, and give the reference from before it was draped"
    half = level_reason(replace(figures, laid_mm=-0.15), found, recipe)
    assert not half.text.startswith("no ply is seen")


def test_the_tolerance_and_the_share_are_the_recipes():
    height = THICKNESS_MM + 0.08
    assert judged(height)[0] == "" and judged(height, recipe=Recipe(level={"tol_mm": 0.05}))[0] != ""
    spots = THICKNESS_MM + 0.8 * (np.arange(len(XY)) % 10 == 0)
    share = Recipe().level.largest_share
    assert (judged(spots)[0] == "") == (share >= 0.1)
    assert judged(spots, recipe=Recipe(level={"largest_share": 0.05}))[0] != ""
    assert judged(spots, recipe=Recipe(level={"largest_share": 0.2}))[0] == ""


def test_what_lies_at_a_limit_is_still_allowed():
    recipe = Recipe(
        material={"thickness_mm": 1.0}, level={"tol_mm": 0.25, "largest_share": 0.25}, verdict={"max_ridge_mm": 1.0}
    )
    _, figures, found = judged(THICKNESS_MM)
    limits = {"laid_mm": 1.25, "uncertainty_mm": 0.125, "low_share": 0.125, "high_share": 0.125}
    at_limits = replace(figures, thickness_mm=1.0, **limits)
    assert level_reason(at_limits, found, recipe) is None
    for name, value in limits.items():
        assert level_reason(replace(at_limits, **{name: value + 1e-9}), found, recipe) is not None


def test_squares_are_off_beyond_tolerance_and_noise():
    residual = np.array([0.0, 0.21, -0.21, 0.25, -0.25, 0.1])
    six = Blocks(np.zeros((6, 2)), residual, np.full(6, 0.01), 20.0, 1.0)  # twice the error is 0.02 mm
    still = level.Deviation(six, residual, np.zeros((3, 6)), np.zeros(3), 0.0)
    assert still.off(0.2).tolist() == [0, 0, 0, 1, -1, 0]
    assert still.left(0.2, 0) == (1 / 6, 1 / 6)
    fits = np.array([[0] * 6, [0] * 6, [0.3, -0.3, 0.3, 0.2, 0, 0]])
    bent = level.Deviation(six, residual, fits, np.zeros(3), 0.0)
    assert bent.off(0.2).tolist() == [1, -1, 1, 1, -1, 0]  # by the paraboloid where the square itself is not off


def test_a_loose_border_leaves_a_level_rest_and_a_bent_scan_does_not():
    border = np.flatnonzero(U > 0.85)
    loose = level.deviation(squares(THICKNESS_MM + 1.5 * np.maximum(0, U - 0.85)), THICKNESS_MM, THICKNESS_MM)
    assert loose.level_without(border, 0.1)
    bent = level.deviation(squares(THICKNESS_MM + 0.6 * U**2), THICKNESS_MM, THICKNESS_MM)
    assert not bent.level_without(border, 0.1)
    assert bent.level_without(border, 2.0)
    count = len(XY)
    assert not loose.level_without(np.arange(count - 12), 10.0)  # 12 squares are too few for 6 terms
    assert loose.level_without(np.arange(count - 13), 10.0)


def test_a_ply_may_be_thinner_as_far_as_it_is_allowed():
    blocks = Blocks(XY[:3], np.array([0.25, 0.30, 0.40]), np.ones(3), 20.0, 1.0)
    assert level.departure(blocks, 0.3, 0.3) == pytest.approx([-0.05, 0.0, 0.10])
    assert level.departure(blocks, 0.3, 0.26) == pytest.approx([-0.01, 0.0, 0.10])


def test_the_fit_says_where_the_plane_lies_how_it_slopes_and_how_far_it_bows():
    found = level.deviation(squares(0.3 + 0.1 + 0.2 * U - 0.1 * V, 1e-6), THICKNESS_MM, THICKNESS_MM)
    assert found.plane[0] == pytest.approx(0.1, abs=1e-4)
    assert found.slope == pytest.approx([0.2 / 300, -0.1 / 240], rel=1e-3)
    assert found.bow_mm == pytest.approx(0, abs=1e-3)
    figures = level.level_of(found, 0.3, 0.2)
    assert figures.tilt_deg == pytest.approx(np.degrees(np.hypot(0.2 / 300, 0.1 / 240)), rel=1e-3)
    assert figures.tilt_axis_deg == pytest.approx((np.degrees(np.arctan2(-0.1 / 240, 0.2 / 300)) + 90) % 180, abs=0.1)
    assert figures.offset_mm == found.plane[0]
    falling = level.deviation(squares(0.3 - 0.2 * U + 0.1 * V, 1e-6), THICKNESS_MM, THICKNESS_MM)
    assert level.level_of(falling, 0.3, 0.2).tilt_axis_deg == pytest.approx(figures.tilt_axis_deg, abs=0.1)
    bowed = level.deviation(squares(0.3 + 0.5 * U**2 + 0.5 * V**2, 1e-6), THICKNESS_MM, THICKNESS_MM)
    assert bowed.bow_mm == pytest.approx(0.5 * (U**2 + V**2).max() - 0.5 * (U**2 + V**2).min(), rel=1e-3)


def test_a_few_far_squares_do_not_move_the_fit():
    height = 0.3 + 0.2 * U
    height = np.where(np.arange(len(XY)) % 12 == 0, height + 7.0, height)
    found = level.deviation(squares(height), THICKNESS_MM, THICKNESS_MM)
    assert found.fits_mm[1] == pytest.approx(0.2 * U, abs=0.005)
    assert found.fits_mm[2] == pytest.approx(0.2 * U, abs=0.01)


def test_squares_in_one_line_leave_no_slope_across_it():
    line = XY[Y.min() == Y]
    found = level.deviation(squares(0.3 + 0.001 * line[:, 0], 1e-6, line), THICKNESS_MM, THICKNESS_MM)
    assert found.slope == pytest.approx([0.001, 0.0], abs=1e-6)


def test_the_sentences_to_the_letter():
    """Golden texts: figures stand out where they are multiples of 100, so that a wrong factor is seen."""
    between = " (between the pockets the ply stands {} mm above the reference, its thickness is 0.3 mm): "
    motion = "check whether scanner or mold moved since the reference was taken"
    texts = {
        judged(0.30 + 0.6 * (U > 0), noise_mm=1e-9)[0]: (
            "50 % of the ply lies 0.60 mm higher than the rest, by a step along a line through (0, 0) mm at 90 degrees "
            "from x" + between.format("0.60") + "look whether backing paper was left on there, or whether another ply "
            "lies below; if neither, check whether scanner or mold moved"
        ),
        judged(0.80, noise_mm=1e-9)[0]: (
            "the scan lies 0.50 mm too high everywhere" + between.format("0.80") + "check the pose, the thickness in "
            "the recipe, and whether the reference is of this layup"
        ),
        judged(0.30 + 0.29 * U, noise_mm=1e-9)[0]: (
            "the scan is tilted by 0.055 degrees about an axis at 90 degrees from x, 0.56 mm from end to end"
            + between.format("0.30") + motion
        ),
        judged(0.30 + 0.9 * (U**2 - 1 / 3), noise_mm=1e-9)[0]: (
            "the scan is bent by 0.84 mm over the ply" + between.format("0.23")
            + "check the scanner's calibration and temperature, how the mold is held, and whether the reference is of "
            "it"
        ),
        judged(0.0, noise_mm=1e-9)[0]: (
            "no ply is seen: the scan stands 0.00 mm above the reference everywhere, a ply by its thickness of 0.3 mm; "
            "the mold is empty, the reference was taken with the ply on it, or the scan lies 0.30 mm too low"
        ),
        judged(-0.30, noise_mm=1e-9)[0]: (
            "the scan lies 0.60 mm too low everywhere, or scan and reference are swapped (between the pockets the ply "
            "stands 0.30 mm below the reference, its thickness is 0.3 mm): swap them, or check the pose, the thickness "
            "in the recipe, and whether the reference is of this layup"
        ),
        judged(0.30 + 0.8 * (np.arange(len(XY)) % 2 == 0) * (np.arange(len(XY)) % 5 < 3), noise_mm=1e-9)[0]: (
            "0 % of the ply between the pockets lies more than 0.1 mm too low and 30 % too high, worst by +0.80 mm at "
            "(150, -150) mm" + between.format("0.30") + "a ply that stands off the mold so widely cannot be judged; "
            "lay it down and scan again"
        ),
        judged(0.30 + 0.5 * (np.arange(len(XY)) % 3 - 1), noise_mm=1e-9)[0]: (
            "33 % of the ply between the pockets lies more than 0.1 mm too low and 33 % too high, worst by +0.50 mm at "
            "(290, -30) mm" + between.format("0.30") + "check whether the reference is of this mold and of the plies "
            "below, and whether scanner or mold moved"
        ),
    }  # fmt: skip
    for said, text in texts.items():
        assert said == text
    assert same_reason(1.0) == (
        "scan and reference are the same: 100 % of their points agree bit for bit; give the scan of the draped ply and "
        "the reference from before it was draped, with all the digits that the scanner gave"
    )


@pytest.mark.parametrize(("error_mm", "surely"), [(0.3, False), (0.15, True)])  # of a square of few points
def test_the_worst_square_is_the_one_that_is_surely_off(error_mm, surely):
    """By its deviation less two standard errors; the others are off by 0.5 mm."""
    blocks = squares(0.30 + 0.5 * np.sin(9 * U) * np.sin(9 * V))
    error = blocks.error_mm.copy()
    error[7] = error_mm
    height = blocks.height_mm.copy()
    height[7] = 0.3 + 0.9
    found = level.deviation(replace(blocks, height_mm=height, error_mm=error), THICKNESS_MM, THICKNESS_MM)
    said = level_reason(level.level_of(found, 0.3, 0.1), found, Recipe()).text
    assert "worst by" in said and ("worst by +0.90" in said) == surely


def test_the_same_scan_is_named_with_its_share():
    assert "are the same: 53 % of their points" in same_reason(0.53)
    assert stale_reason(0.33, (290.4, -30.0)) == (
        "33 % of the points on the ply round (290, -30) mm are the reference's, bit for bit: they show the mold from "
        "before the ply was laid; have the scanner's software clear its buffer, and fill nothing in from an earlier "
        "scan"
    )


def test_what_stands_off_widely_is_shown_where_it_is_surely_highest():
    """By its deviation less two standard errors: the left half is known to 0.3 mm, the highest square to 0.1 mm."""
    blocks = squares(0.30 + 0.9 * U**2, 1e-6)
    error, height, highest = blocks.error_mm.copy(), blocks.height_mm.copy(), (X == 290) & (Y == 90)
    error[U < 0], error[highest] = 0.3, 0.1
    height[highest] += 0.25
    found = level.deviation(replace(blocks, height_mm=height, error_mm=error), THICKNESS_MM, THICKNESS_MM)
    said = level_reason(level.level_of(found, 0.3, 0.1), found, Recipe()).text
    assert "or the ply stands off the mold widely, by 1.09 mm at (290, 90) mm" in said


def asked(side_mm, pitch_mm=2.0, seen=1.0, outlined=True):
    """The reason of a square ply, alone in a scan of 600 mm whose first rows alone were seen, without its squares."""
    half = 0.5 * side_mm
    outline = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    zones = PlyZones(outline if outlined else None, np.array([-300.0, -300.0]), np.array([300.0, 300.0]))
    x, y = (v.ravel() for v in np.meshgrid(*2 * [np.arange(-300.0, 300.0, pitch_mm)]))
    height = np.where(y <= -half + seen * side_mm, 0.3, np.nan)
    sample = Sample(np.column_stack([x, y, height]), height, 1, np.zeros(len(x), bool))
    sample = replace(sample, on_ply=zones.inside(sample))
    return few_squares_reason(zones, sample, share=0.034, outlined=outlined)


@pytest.mark.parametrize(
    ("scene", "what", "do"),
    [
        ({"side_mm": 400}, "pockets with their feet leave only 3.4 % of the ply between them", "lay it down and"),
        ({"side_mm": 400, "seen": 0.7}, "between the pockets only 3.4 % of it was seen by scan and", "check that the"),
        ({"side_mm": 400, "outlined": False}, "between the pockets only 3.4 % of it was seen by", "check that the out"),
        ({"side_mm": 15}, "between the pockets only 3.4 % of it was seen by scan", "check that the outline, the scan"),
        (
            {"side_mm": 40},
            "the ply is too small, only 4 squares of 10 mm lie 10 mm inside its outline, and 6 are needed",
            "check that the outline is in mm",
        ),
        (
            {"side_mm": 100, "pitch_mm": 6.0},
            "the ply is a small part of the scan, only 169 of the 10000 points that are looked at for it lie well",
            "crop scan and reference to the ply and 50 mm round it",
        ),
    ],
)
def test_a_ply_without_squares_is_told_why(scene, what, do):
    said = asked(**scene)
    assert said.text.startswith(f"the level of the ply cannot be determined: {what}")
    assert said.remedy.startswith(do) and said.text.endswith(said.remedy)
