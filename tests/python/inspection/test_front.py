from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from debulk import InputError, _core, cloud, pocket, scenes, surface
from debulk.inspection.clouds import camera
from debulk.inspection.clouds.camera import PinholeImage
from debulk.inspection.find import front

SPACING_MM = 1.0


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=3, pixels=(1200, 900))


@pytest.fixture(scope="module")
def reference(layup):
    points = cloud.transform(layup.reference, layup.mold_from_scanner)
    keep = cloud.remove_outliers(layup.reference)
    points[~keep] = np.nan
    return surface.fit_reference(surface.grid_heights(points, spacing_mm=SPACING_MM))


def make(layup, reference, image="its own", median_cells=3, **more):
    options = _core.surface.FrontEndOptions()
    options.spacing_mm = SPACING_MM
    options.median_cells = median_cells
    return front.FrontEnd(
        reference,
        PinholeImage(*layup.scan.shape[:2], *layup.camera) if image == "its own" else image,
        layup.mold_from_scanner,
        options=options,
        **more,
    )


def heights_of(end, scan):
    """Return the height map of a scan, which outlasts the next one."""
    found = end.inspect(scan)
    return replace(found, values=found.values.copy(), measured=found.measured.copy())


def kept(end, scan):
    """Return which points of the last scan were no outliers."""
    rows, columns = scan.shape[:2] if scan.ndim == 3 else (len(scan), 1)
    return end._core.keep((rows, columns)).view(np.bool_).reshape(scan.shape[:-1])


@pytest.fixture(scope="module")
def fast(layup, reference):
    end = make(layup, reference)
    return end, heights_of(end, layup.scan)


@pytest.fixture(scope="module")
def general(layup, reference):
    end = make(layup, reference, None)
    return end, heights_of(end, layup.scan)


def test_it_takes_the_fast_way(fast):
    end, heights = fast
    assert end._core.fast
    assert set(end.times_ms) == {"clean", "grid", "fill", "spikes", "median"}
    assert heights.spacing_mm == SPACING_MM
    assert heights.values.dtype == np.float32
    assert heights.measured.dtype == np.bool_


def test_outliers_are_those_of_the_exact_search(layup, fast, general):
    keep = cloud.remove_outliers(layup.scan)
    assert np.array_equal(kept(fast[0], layup.scan), keep)
    assert np.array_equal(kept(general[0], layup.scan), keep)
    assert np.count_nonzero(~keep[np.isfinite(layup.scan[..., 2])]) > 1000


def test_heights_agree_with_the_general_way_on_the_ply(layup, fast, general):
    a, b = fast[1], general[1]
    assert not general[0]._core.fast
    assert a.values.shape == b.values.shape
    assert np.array_equal(a.origin_mm, b.origin_mm)
    y, x = np.indices(a.values.shape) * SPACING_MM
    x, y = x + a.origin_mm[0], y + a.origin_mm[1]
    on_ply = pocket.inside(layup.ply_outline * 0.97, np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    assert np.mean(np.isfinite(a.values[on_ply])) > 0.999
    off = (a.values - b.values)[on_ply]
    off = off[np.isfinite(off)]
    assert abs(off.mean()) < 1e-3
    assert np.sqrt(np.mean(off**2)) < 0.05  # sigma of the scan: 0.05 and, on the left, 0.15 mm
    truth = layup.truth.ply_height_above_mold(np.stack([x, y], axis=-1))
    wrong = (a.values - truth)[on_ply]
    assert abs(np.nanmedian(wrong)) < 0.01
    assert np.nanquantile(abs(wrong), 0.99) < 0.2


def test_pockets_are_those_of_the_truth(layup, fast):
    found = pocket.segment(fast[1], ply_outline=layup.ply_outline).pockets
    truth = layup.truth.pockets
    assert len(found) == len(truth)
    areas = np.array([f.area_mm2 / t.area_mm2 - 1 for f, t in zip(found, truth, strict=True)])
    volumes = np.array([f.volume_mm3 / t.volume_mm3 - 1 for f, t in zip(found, truth, strict=True)])
    assert np.median(abs(areas)) < 3e-3  # at 1 Mpx; 1e-3 at 20
    assert abs(areas).max() < 0.03
    assert np.median(abs(volumes)) < 5e-3
    assert max(abs(f.peak_mm - t.peak_mm) for f, t in zip(found, truth, strict=True)) < 0.2


def test_the_same_bits_again_and_on_any_number_of_threads(layup, reference, fast):
    end, heights = fast
    for other in (end, make(layup, reference, threads=1), make(layup, reference, threads=3)):
        again = other.inspect(layup.scan)
        assert again.values.tobytes() == heights.values.tobytes()
        assert np.array_equal(again.measured, heights.measured)


def test_a_map_is_a_view_that_nobody_writes_into(layup, reference):
    view = make(layup, reference).inspect(layup.reference)
    assert not view.values.flags.writeable
    assert abs(np.nanmedian(view.values)) < 0.02
    assert view.values.base is not None


def test_other_clouds_take_the_general_way(layup, reference, fast):
    end, heights = fast
    flat = layup.scan.reshape(-1, 3)[::7]
    assert np.isfinite(end.inspect(flat).values).any()
    assert not end._core.fast
    assert np.array_equal(kept(end, flat), cloud.remove_outliers(flat))
    moved = layup.scan.copy()
    moved[450, 600, 0] += 2.0  # one point off its ray
    with_one_off = end.inspect(moved)
    assert not end._core.fast
    assert np.nanmedian(abs(with_one_off.values - heights.values)) < 0.05
    end.inspect(layup.scan[:-1])
    assert not end._core.fast
    end.inspect(layup.scan)
    assert end._core.fast


def test_a_camera_is_fitted(layup):
    assert camera.fit_camera(layup.reference) == pytest.approx(layup.camera, abs=2e-3)
    assert camera.fit_camera(layup.reference.reshape(-1, 3)) is None
    assert camera.fit_camera(cloud.transform(layup.reference, layup.mold_from_scanner)) is None


def test_a_search_is_stopped(layup, reference):
    stop = _core.Stop()
    stop.cancel()
    with pytest.raises(RuntimeError, match="stopped"):
        make(layup, reference).inspect(layup.scan, stop)


def test_bad_input_is_named(layup, reference):
    with pytest.raises(InputError, match="camera: expected a positive focal length"):
        make(layup, reference, PinholeImage(9, 9, -1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="median_cells: expected 1, 3 or 5"):
        make(layup, reference, median_cells=4)
    with pytest.raises(InputError, match="mirror"):
        front.FrontEnd(reference, None, np.diag([1.0, 1.0, -1.0, 1.0]), options=_core.surface.FrontEndOptions())
