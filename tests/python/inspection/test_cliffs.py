"""A mold that ends at a cliff above a table: no pockets where the fitted reference would round the edge."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
from debulk import Inspector, Verdict
from lab.varied import faults, molds, varied_layup
from lab.varied.layup import _bumps
from lab.varied.ply import Ply
from lab.varied.polygons import random_ply
from lab.varied.rendering import Stage
from lab.varied.scanning import scanned
from lab.varied.seeing import Camera


@pytest.fixture(scope="module")
def layup():
    return varied_layup(
        11, (640, 480), mold="cliff", pockets=["lobes"], severity="one", noise=[], holes_mm=[], clamp=False, borders=0
    )


def inspected(layup, *outlines):
    """Return a report with each of these outlines, on a mold that is prepared once."""
    pose = layup.mold_from_scanner
    mold = Inspector(None, layup.reference, mold_from_scanner=pose).prepared
    return [Inspector(None, mold, of, layup.fibre_angles_deg, pose).inspect(layup.scan) for of in outlines]


def is_true(layup, pocket):
    tops = np.array([p.centre_mm for p in (*layup.truth.pockets, *layup.truth.decoys)])
    return np.linalg.norm(tops - pocket.outline_mm.mean(axis=0), axis=1).min() < 20


def test_what_stands_up_at_a_cliff_is_no_pocket(layup):
    (report,) = inspected(layup, layup.ply_outline)
    highest = max(p.peak_mm for p in layup.truth.pockets)
    assert report.pockets
    for one in report.pockets:
        assert one.peak_mm < highest + 1
        assert is_true(layup, one)


def oblique(seed, cliff_mm, tilt_deg, *, severity="benign", wide=False):
    """A part above a table, seen by a camera 2 m away and askew; without other faults than noise."""
    rng = [np.random.default_rng([seed, part]) for part in range(7)]
    outline = random_ply(rng[0])
    smooth = molds.make_mold(rng[1], "cliff", outline)
    part, angle = smooth.part_outline, np.linspace(0, 2 * np.pi, 90, endpoint=False)
    if wide:  # a round part, wider than the ply
        away = np.linalg.norm(outline - outline.mean(axis=0), axis=1).max() + 15
        part = outline.mean(axis=0) + away * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low, high = (float(f(smooth.smooth_height(*part.T))) for f in (np.min, np.max))
    mold = molds.Mold("cliff", smooth.terms, part, low - cliff_mm)
    bumps = _bumps(rng[2], ["lobes", "gaussians"], severity, outline, (0.0, 90.0), 3.2)
    tilt, towards = np.deg2rad(tilt_deg), rng[4].uniform(0, 2 * np.pi)
    view = np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), -np.cos(tilt)])
    right = np.cross(view, [np.sin(towards + 0.3), -np.cos(towards + 0.3), 0.0])
    right = np.cross(np.cross(view, right), view)
    right /= np.linalg.norm(right)
    pose = np.stack([right, np.cross(view, right), view], axis=1)
    centre = np.append(part.mean(axis=0), high) - 2000 * view
    around = np.column_stack([part.mean(axis=0) + 1.15 * (part - part.mean(axis=0)), np.full(len(part), high)])
    pixels = Camera((900, 700), 1.0, (0.0, 0.0), pose, centre).project(around)
    (left, top), (end, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    focal = 0.97 * min(899 / (end - left), 699 / (bottom - top))
    middle = (449.5 - focal * 0.5 * (left + end), 349.5 - focal * 0.5 * (top + bottom))
    camera = Camera((900, 700), float(focal), (float(middle[0]), float(middle[1])), pose, centre)
    stage = Stage(camera, centre + 500 * pose[:, 0], Ply(mold, outline, 0.3, tuple(bumps)), None)
    return scanned(rng[6], stage, (0.0, 90.0), faults.random_noise(rng[6], ()), [], 2.0)


SEEN_ASKEW = [(22, 15, 30, True), (23, 40, 10, False), (24, 200, 20, False), (25, 80, 0, True)]


@pytest.mark.parametrize(("seed", "cliff_mm", "tilt_deg", "wide"), SEEN_ASKEW)
def test_without_an_outline_the_molds_edge_is_found_in_the_reference(seed, cliff_mm, tilt_deg, wide):
    layup = oblique(seed, cliff_mm, tilt_deg, wide=wide)
    report, known = inspected(layup, None, layup.ply_outline)
    assert report.verdict is known.verdict is Verdict.CEASE, (report.reason, known.reason)
    assert len(report.pockets) == len(known.pockets) == len(layup.truth.pockets)
    below = next(entry for entry in report.left_out if "below the mold's edge" in entry.what)
    assert below.bound.endswith("judged up to 8 mm from the edge only")


@pytest.mark.parametrize(("seed", "cliff_mm", "tilt_deg"), [(31, 30, 15), (33, 120, 15)])
def test_without_an_outline_a_creasing_pocket_on_such_a_mold_is_found(seed, cliff_mm, tilt_deg):
    layup = oblique(seed, cliff_mm, tilt_deg, severity="one")
    assert max(p.ridge_mm for p in layup.truth.pockets) > 0.7
    (report,) = inspected(layup, None)
    assert report.verdict is Verdict.CREASE


def test_a_cliff_too_low_to_be_found_is_not_judged_and_the_outline_asked_for():
    """In the shadow of 8 mm no step is seen that a slope could not explain."""
    layup = oblique(43, 8, 30)
    report, known = inspected(layup, None, layup.ply_outline)
    assert report.verdict is Verdict.INVALID
    assert "or at the mold's edge" in report.reason
    assert known.verdict is Verdict.CEASE


def test_a_ply_that_reaches_below_the_molds_edge_is_refused_and_the_outline_asked_for(layup):
    pose, table = layup.mold_from_scanner, layup.truth.ply.mold.table_mm
    rise = layup.scan.astype(np.float64) @ pose[2, :3]
    on_table = np.abs(rise + pose[2, 3] - table) < 1
    x = (layup.scan.astype(np.float64) @ pose[0, :3] + pose[0, 3])[on_table]
    lifted = layup.scan.copy()
    lifted[on_table] *= (1 + np.where(x > np.quantile(x, 0.8), 0.3, 0.0) / rise[on_table])[:, None]
    report = debulk.inspect(lifted, layup.reference, None, None, layup.fibre_angles_deg, pose)
    assert report.verdict is Verdict.INVALID
    assert "the mold's edge" in report.reason and "give the ply's outline" in report.reason


def test_a_wide_foot_along_an_edge_where_the_mold_ends_is_reached_by_its_net():
    """A loose border and a ring stand on one foot; on the cliff beside it no node can be laid, and the rim was open."""
    layup = varied_layup(230069, (1280, 960))
    (report,) = inspected(layup, layup.ply_outline)
    (one,) = (p for p in report.pockets if np.linalg.norm(p.outline_mm.mean(axis=0) - (24, -169)) < 20)
    assert one.verdict is Verdict.CEASE  # a true ridge of 0.19 mm; the longest fibre keeps the limit even if held
    assert 0 < one.excess.range_mm[1] < 0.55
    nodes = one.net.nodes_mm[:, :2]
    arm = one.foot_outline_mm[np.argmin(one.foot_outline_mm[:, 0])]
    assert np.linalg.norm(nodes - arm, axis=1).min() < 1.5 * one.spacing_mm


def stepped(high_mm: float, ply_from_mm: float, bump_at_mm: float, seed: int) -> np.ndarray:
    """A scan (H, W, 3) of a mold that falls by a step at x = 0, with a ply right of a place and a bump on it."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[-100.0:101.0, -120.0:121.0]
    away = np.minimum(np.hypot(x - bump_at_mm, y - 10) / 9, 1)
    lift = np.where(x > ply_from_mm, 0.3 + 3.6 * np.cos(np.pi / 2 * away) ** 2, 0.0)
    return np.dstack([x, y, np.where(x > 0, high_mm, 0.0) + lift + rng.normal(0, 0.01, x.shape)])


@pytest.mark.parametrize("high_mm", [5.0, 6.0, 9.0, 15.0])
def test_a_bump_below_a_step_does_not_pass_without_an_outline(high_mm, tmp_path):
    """Beside the step no surface follows the mold, and the bump lies there wholly; one beside it would crease."""
    mold, bare = Inspector(None, stepped(high_mm, 1e3, 0.0, 1)), stepped(high_mm, 2.0, 1e3, 2)
    scan = stepped(high_mm, -1e3, -20.0, 3)
    report = mold.inspect(scan)
    assert report.verdict is Verdict.INVALID
    assert "below it the scan stands above the reference" in report.reason
    mold.save(tmp_path / "mold.npz")
    assert Inspector.load(tmp_path / "mold.npz").inspect(scan).reason == report.reason
    assert mold.inspect(bare).verdict is Verdict.CEASE  # the ply ends at the step
    with np.load(tmp_path / "mold.npz") as file:
        np.savez(tmp_path / "cut.npz", **{**file, "hidden": file["hidden"][1:]})
    with pytest.raises(debulk.InputError, match="hidden has the shape"):
        Inspector.load(tmp_path / "cut.npz")
