"""Many scanners write a number where they saw nothing: such a cloud is refused, and the remedy it names works."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import debulk
from debulk import InputError, Inspector, Recipe

MARKS = [(0.0, 0.0, 0.0), (-9999.0, -9999.0, -9999.0), (0.0, 0.0, 1e5), (3.4e38, 3.4e38, 3.4e38)]
LAYUP = debulk.scenes.layup(seed=0, pixels=(640, 480))


def inspector(reference):
    recipe = Recipe(run={"hash_scan": False})
    return Inspector(recipe, reference, LAYUP.ply_outline, mold_from_scanner=LAYUP.mold_from_scanner)


@functools.cache
def right():
    return inspector(LAYUP.reference)


def marked(cloud, mark, share=0.005):
    """Return the cloud with the mark where nothing was seen, and with more that was not seen."""
    unseen = np.isnan(cloud).any(axis=-1) | (np.random.default_rng(1).random(cloud.shape[:2]) < share)
    out = cloud.copy()
    out[unseen] = mark
    return out, unseen


def remedied(cloud, error):
    """Do what the error says."""
    points = cloud.copy()
    exec(str(error).split("write NaN there: ")[1], {"points": points, "np": np})
    return points


@pytest.mark.parametrize("mark", MARKS)
def test_a_mark_for_nothing_seen_is_refused_and_the_remedy_takes_it_out(mark):
    for given, name in ((LAYUP.scan, "scan"), (LAYUP.reference, "reference")):
        cloud, unseen = marked(given, mark)
        with pytest.raises(
            InputError, match=rf"^{name}: .* of them lie at \(.*as a mark for what was not seen"
        ) as caught:
            right().inspect(cloud) if name == "scan" else inspector(cloud)
        assert np.array_equal(np.isnan(remedied(cloud, caught.value)).all(axis=-1), unseen)


def test_a_patch_of_the_origin_is_refused_that_is_a_two_thousandth_of_the_scan():
    scan = LAYUP.scan.copy()
    scan[200:212, 300:312] = 0.0
    with pytest.raises(InputError, match=r"scan: .* of them lie at \(0, 0, 0\)"):
        right().inspect(scan)


def test_a_point_at_the_origin_and_rounded_points_are_none():
    scan = np.round(LAYUP.scan, 1)
    scan[0, 0] = 0.0
    assert right().inspect(scan).verdict is right().inspect(LAYUP.scan).verdict
