"""A frame beside the ply that is higher than the mold, and a step of the mold below the ply."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
import stranger_scenes as stranger
from debulk import Verdict

SIZE_MM = (340.0, 300.0)
PLY = stranger.outline(220.0, 220.0)
FRAME_MM, BESIDE_MM, STEP_MM = 20.0, 14.0, 9.0  # height of the frame, from the ply to it; of a step of the mold
CEASES, CREASES = stranger.bump(30.0, 2.6), stranger.bump(30.0, 6.0)
SIDES = {"right": lambda x, y: x, "left": lambda x, y: -x, "top": lambda x, y: y}


def framed(*sides):
    """The mold with walls along some of its sides, which stand up to its last point."""

    def height(x, y):
        out = stranger.flat(x, y)
        for side in sides:
            out = np.where(SIDES[side](x, y) > 110 + BESIDE_MM, FRAME_MM, out)
        return out

    return height


def stepped(at_mm):
    """A mold with a step below the ply: the lower part is on the right."""
    return lambda x, y: np.where(x < at_mm, STEP_MM, stranger.flat(x, y))


def inspected(mold, standing, outline=PLY):
    top = stranger.laid(mold, standing, (220.0, 220.0))
    scan, reference = (stranger.cloud(of, SIZE_MM, 0.8, seed) for seed, of in enumerate((top, mold)))
    return debulk.inspect(scan, reference, None, outline, mold_from_scanner=np.eye(4))


def test_the_bumps_are_what_they_are_called():
    assert stranger.ridge_mm(CEASES, 40) < 0.45
    assert stranger.ridge_mm(CREASES, 40) > 0.8


@pytest.mark.parametrize("sides", [("right",), ("right", "left"), ("right", "left", "top")])
@pytest.mark.parametrize(("standing", "verdict"), [(CEASES, Verdict.CEASE), (CREASES, Verdict.CREASE)])
def test_a_ply_beside_a_higher_frame_is_judged_as_without_the_frame(sides, standing, verdict):
    report = inspected(framed(*sides), standing)
    assert report.verdict is verdict, report.reason


@pytest.mark.parametrize("standing", [CEASES, CREASES])
@pytest.mark.parametrize("step_at_mm", [-40.0, 40.0])  # most of the ply on the lower part, or on the upper
def test_a_step_below_the_ply_is_not_judged_whichever_side_the_reference_follows(step_at_mm, standing):
    report = inspected(stepped(step_at_mm), standing)
    assert report.verdict is Verdict.INVALID
    assert "the reference is known on 8" in report.reason  # 84.8 or 87.0 % of the ply


@pytest.mark.parametrize("sides", [(), ("right",), ("right", "left")])
def test_without_an_outline_a_creasing_ply_beside_a_frame_is_not_passed(sides):
    assert inspected(framed(*sides), CREASES, None).verdict is not Verdict.CEASE
