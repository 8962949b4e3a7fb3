"""Clouds that cannot show the smallest pocket, settings that can hide one; and nets with enough nodes to decide."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from debulk import InputError, Inspector, Recipe, Verdict, scenes
from debulk.inspection.clouds.thinning import pitch_of, thinned
from lab.varied import given_right, varied_layup

PIXELS = (1280, 960)


@functools.cache
def given(family):
    if family == "first":
        return given_right(scenes.layup(931, PIXELS))
    return given_right(varied_layup(935, PIXELS, borders=0, clamp=False, holes_mm=0))


@functools.cache
def prepared(family):
    g = given(family)
    return Inspector(None, g.reference, mold_from_scanner=g.mold_from_scanner).prepared


@functools.cache
def inspector(family):
    g = given(family)
    return Inspector(None, prepared(family), g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner)


BOTH = pytest.mark.parametrize("family", ["first", "varied"])


def points(cloud, step):
    listed = cloud.reshape(-1, 3)
    return listed[np.isfinite(listed).all(axis=1)][::step]


def pixels(cloud, pitch_mm):
    """So many pixels that are at least this far apart."""
    step = np.linalg.norm(np.diff(cloud[::7].astype(np.float64), axis=1), axis=-1)
    return int(np.ceil(pitch_mm / np.nanmedian(step)))


def with_gaps(cloud, step):
    thin = np.full_like(cloud, np.nan)
    thin[::step, ::step] = cloud[::step, ::step]
    return thin


@BOTH
@pytest.mark.parametrize("pitch_mm", [5, 8, 16])
def test_a_coarse_reference_is_refused_with_figures(family, pitch_mm):
    g = given(family)
    step = pixels(g.reference, pitch_mm)
    for coarse in (points(g.reference, step * step), with_gaps(g.reference, step)):
        with pytest.raises(InputError, match=r"^reference: expected points at most 3.5 mm apart.*but got some"):
            Inspector(None, coarse, mold_from_scanner=g.mold_from_scanner)


@BOTH
@pytest.mark.parametrize("thin", ["a list", "gaps in the image"])
def test_a_thinned_scan_is_invalid_with_figures(family, thin):
    g = given(family)
    step = pixels(g.scan, 5)
    scan = points(g.scan, step * step) if thin == "a list" else with_gaps(g.scan, step)
    report = inspector(family).inspect(scan)
    assert report.verdict is Verdict.INVALID
    assert "the scan is too coarse: expected points at most 3.5 mm apart" in report.reason


@pytest.mark.parametrize("spacing", [0.3, 1.0, 2.7, 9.0])
@pytest.mark.parametrize("shape", ["image", "list", "shuffled"])
def test_the_pitch_of_a_cloud(spacing, shape):
    y, x = np.mgrid[0:900.0, 0:700.0] * spacing
    cloud = np.dstack([x, y, np.zeros_like(x)]).astype(np.float32)
    if shape != "image":
        cloud = cloud.reshape(-1, 3)
    if shape == "shuffled":
        cloud = np.random.default_rng(1).permutation(cloud)
    few, each = thinned(cloud)
    assert 20_000 < len(few) < 60_000
    assert pitch_of(few[:, :2], each) == pytest.approx(spacing, rel=0.1)


@pytest.mark.parametrize("step", [2, 3, 5, 8])
def test_gaps_in_the_image_count(step):
    y, x = np.mgrid[0:960.0, 0:1280.0]
    cloud = with_gaps(np.dstack([x, y, np.zeros_like(x)]).astype(np.float32), step)
    few, each = thinned(cloud)
    seen = few[np.isfinite(few).all(axis=1), :2]
    assert pitch_of(seen, each) == pytest.approx(step, rel=0.15)


@pytest.mark.parametrize(
    ("section", "name", "hides", "shows"),
    [
        ("clean", "grid_spacing_mm", 4.0, 3.0),
        ("patch", "smooth_mm", 20.0, 12.0),
        ("clean", "max_hole_mm", 60.0, 25.0),
    ],
)
def test_a_setting_that_can_hide_a_pocket_is_refused(section, name, hides, shows):
    Recipe(**{section: {name: shows}})
    with pytest.raises(InputError, match=rf"{section}\.{name}: expected at most .*segmentation\.area_tol_mm2"):
        Recipe(**{section: {name: hides}})
    Recipe(**{section: {name: hides}}, segmentation={"area_tol_mm2": 4000.0})


def bordered(height, width):
    """A scan with a loose border along the ply's lower edge and, in it, a bump with 1.4 mm of excess or more."""
    g = given("first")
    outline = g.ply_outline
    middle = outline.mean(axis=0)
    low = outline[:, 1].min()
    xyz = g.in_mold(g.reference)
    x, y = xyz[..., 0], xyz[..., 1]
    from debulk import pocket

    seen = np.isfinite(x)
    on = np.zeros(x.shape, dtype=bool)
    on[seen] = pocket.inside(outline, np.stack([x[seen], y[seen]], axis=1))
    loose = np.clip(1 - (y - low) / width, 0, 1) * np.clip(2 - np.abs(x - middle[0]) / 150, 0, 1)
    off = np.hypot(x - middle[0], y - (low + 0.6 * width)) / 38
    bump = 8.0 * np.cos(0.5 * np.pi * np.clip(off, 0, 1)) ** 2
    rise = np.where(on, 0.3 + height * loose + bump, 0.0)
    noise = np.random.default_rng(3).normal(0, 0.03, x.shape)
    fall = g.reference.astype(np.float64) @ g.mold_from_scanner[2, :3]
    return (g.reference * (1 + (rise + noise) / fall)[..., None]).astype(np.float32)


@pytest.mark.parametrize("height", [0.3, 0.4, 0.5])
@pytest.mark.parametrize("width", [120.0, 190.0, 260.0])
def test_a_creasing_pocket_in_a_loose_border_does_not_cease(height, width):
    report = inspector("first").inspect(bordered(height, width))
    assert len(report.pockets) == 1
    assert report.verdict is not Verdict.CEASE, report.reason


@BOTH
def test_nets_have_enough_nodes_inside_the_outline(family):
    report = inspector(family).inspect(given(family).scan)
    for p in report.pockets:
        if p.net is not None and p.verdict is Verdict.CEASE:
            assert np.count_nonzero(p.net.inside) >= 20
        if p.node_count is not None:
            assert p.node_count <= 3.2 * Recipe().net.node_target


X, Y = np.meshgrid(np.arange(200.0), np.arange(160.0))
FLAT = np.stack([X, Y, 0 * X], axis=-1)


@pytest.mark.parametrize(
    ("cloud", "came"),
    [
        (FLAT[:3, :30], r"one of 30 by 3 mm with 90 heights; give the whole cloud"),
        (FLAT[:1].reshape(-1, 3), r"one of 199 by 0 mm; give the whole cloud"),
        (20 * FLAT[:2, :2], r"only 4 of them; give the full cloud"),
    ],
    ids=["strip", "line", "four points"],
)
def test_a_reference_too_small_for_a_surface_is_refused_by_its_name(cloud, came):
    with pytest.raises(InputError, match=rf"^reference: expected .*but got {came}"):
        Inspector(None, cloud)


def test_a_reference_of_one_row_is_said_to_be_narrow():
    x, y = np.meshgrid(np.arange(300.0), np.arange(200.0))
    plate = np.stack([x, y, np.zeros_like(x)], axis=-1)
    for narrow in (plate[100:101], plate[:, 100:101], plate[100:103]):
        with pytest.raises(InputError, match=r"^reference: expected a cloud wide enough .* by .* mm.*whole cloud"):
            Inspector(None, narrow)


@pytest.mark.parametrize("spoil", ["checkered", "every second line reversed"])
def test_an_image_without_neighbours_is_said_to_be_one(spoil):
    x, y = np.meshgrid(np.arange(300.0), np.arange(200.0))
    plate = np.stack([x, y, np.zeros_like(x)], axis=-1)
    if spoil == "checkered":
        plate[(np.indices(x.shape).sum(axis=0) % 2) == 1] = np.nan
    else:
        plate[1::2] = plate[1::2, ::-1]
    with pytest.raises(InputError, match=r"^reference: expected an image whose neighbouring .* out of order"):
        Inspector(None, plate)


@pytest.mark.parametrize(("rows", "left"), [(1, 0), (1, 3), (5, 5)])
def test_a_mask_that_hides_the_reference_is_named(rows, left):
    x, y = np.meshgrid(np.arange(300.0), np.arange(200.0))
    mask = np.ones(x.shape, dtype=bool)
    mask[100 : 100 + rows, :left] = False
    hidden = 60_000 - rows * left
    with pytest.raises(InputError, match=rf"^reference: expected .*; the mask hides {hidden} of 60000 pixels"):
        Inspector(None, np.stack([x, y, np.zeros_like(x)], axis=-1), mask=mask)
