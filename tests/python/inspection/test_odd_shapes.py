"""Pockets that are no bells: their nets are laid from a point inside, and their excess is that of their section."""

from __future__ import annotations

import numpy as np
import pytest

import laid_ply
from debulk import pocket
from debulk.verdict import Verdict

# Of a section of 40 mm, 8 mm high, a square of a cosine: its length over its chord, by quadrature.
_S = np.linspace(-20.0, 20.0, 4001)
_EXCESS_MM = np.hypot(np.diff(_S), np.diff(8 * np.cos(np.pi * _S / 40) ** 2)).sum() - 40


def _along_an_arc(half_angle):
    def height(x, y):
        around, away = np.arctan2(y - 30, x - 50), np.hypot(x - 50, y - 30) - 60
        section = 8 * np.cos(np.pi * np.clip(away / 40, -0.5, 0.5)) ** 2
        ends = np.clip((half_angle - np.abs(around)) * 60 / 40, 0, 0.5)
        return section * np.sin(np.pi * ends) ** 2

    return height


@pytest.mark.parametrize("half_angle", [1.8, 10.0], ids=["crescent", "ring"])
def test_a_pocket_round_its_centroid_is_judged(half_angle):
    report = laid_ply.inspector().inspect(laid_ply.scan(_along_an_arc(half_angle)))
    (one,) = report.pockets
    assert one.verdict is Verdict.CREASE, one.reason
    # A fibre that runs straight across has this much; one that crosses a ring twice, or askew, has more.
    assert 0.85 * _EXCESS_MM < one.excess_length_mm < 2.4 * _EXCESS_MM
    if half_angle < np.pi:
        assert not pocket.inside(one.outline_mm, np.array([[50.0, 30.0]]))[0]
