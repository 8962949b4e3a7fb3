"""What software made of a bump's surroundings carries no noise of its own, and passes no pocket."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, median_filter

import debulk
from debulk.inspection.evidence.cloud_image import CloudImage, in_lines
from debulk.inspection.rawscan.vouched import asked_in, not_vouched
from debulk.verdict import Verdict
from stranger_scenes import bump, cloud, flat, laid, outline

SIZE, PLY, PITCH = (200.0, 180.0), (160.0, 140.0), 0.9
TOLD = "unlike the rest of the scan"


def _image(surface, noise_mm=0.02, seed=1, pitch=1.0):
    """A cloud of pixels a millimetre apart."""
    y, x = np.mgrid[-80.0:80.0:pitch, -90.0:90.0:pitch]
    z = surface(x, y) + np.random.default_rng(seed).normal(0, noise_mm, x.shape)
    return np.dstack([x, y, z]).astype(np.float32)


def _parts(points, step_mm=0.0, pitch=1.0, mask=None):
    points = points if mask is None else np.where(mask[..., None], np.float32(np.nan), points)
    asked = asked_in(CloudImage(points, points, pitch))
    return not_vouched(asked, asked.points[..., :2], np.isfinite(asked.points[..., 2]), step_mm)[0]


def _wide(points, **given):
    return [part for part in _parts(points, **given) if part.wide_mm > 8]  # narrower ones hide half of what creases


def _bell(high, radius, slope=0.0):
    return lambda x, y: slope * x + high * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / radius, 1)) ** 2


def _median(z, marks):
    return median_filter(z, 33)


def _opened(z, marks):
    return cv2.morphologyEx(z, cv2.MORPH_OPEN, np.ones((33, 33), np.uint8))


def _nearest(z, marks):
    return z[tuple(distance_transform_edt(marks, return_distances=False, return_indices=True))]


def _inpainted(z, marks, how=cv2.INPAINT_NS):
    scale = 255 / np.ptp(z)
    return cv2.inpaint(np.round((z - z.min()) * scale).astype(np.uint8), marks, 5, how) / scale + z.min()


def _telea(z, marks):
    return _inpainted(z, marks, cv2.INPAINT_TELEA)


def _soap_film(z, marks):
    out = np.where(marks > 0, np.median(z), z).astype(np.float64)
    for _ in range(2000):
        out[marks > 0] = cv2.blur(out, (3, 3))[marks > 0]
    return out


def _along_rows(z, marks):
    out = z.copy()
    for row in np.flatnonzero(marks.any(axis=1)):
        inside = marks[row] > 0
        if not inside.all():
            out[row, inside] = np.interp(np.flatnonzero(inside), np.flatnonzero(~inside), z[row, ~inside])
    return out


def _along_columns(z, marks):
    return _along_rows(z.T, marks.T).T


def _garbage(z, marks):
    return z + np.random.default_rng(5).normal(0, 2, z.shape)


FILLS = [_median, _opened, _nearest, _inpainted, _telea, _soap_film, _along_rows, _along_columns, _garbage]


def _replaced(points, fill, least_mm=0.4):
    z = points[..., 2]
    marks = (z - median_filter(z, 33) > least_mm).astype(np.uint8)
    return np.dstack([points[..., :2], np.where(marks > 0, fill(z, marks), z)]).astype(np.float32), marks


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_a_bump_that_was_replaced_is_found_with_its_place_and_width(fill, slope):
    points, marks = _replaced(_image(_bell(3.5, 12.0, slope)), fill)
    inner = np.s_[35:-35, 35:-35]
    (one,) = _wide(points[inner])
    made = np.count_nonzero(marks[inner])
    assert np.hypot(*one.centre_mm) < 2.5
    assert 0.75 < one.wide_mm / np.sqrt(4 / np.pi * made) < 1.35
    assert (one.box_mm[0] < -4.0).all()
    assert (one.box_mm[1] > 4.0).all()
    assert not _wide(_image(_bell(3.5, 12.0, slope))[inner])


@pytest.mark.parametrize("sigma", [0.005, 0.02, 0.05])
def test_what_a_ply_does_is_measured(sigma):
    """Bells, caps with a kink at their foot, steps, a corner of a ply, and level ply."""
    cap = lambda x, y: 3.0 * np.maximum(1 - (x**2 + y**2) / 100, 0)  # noqa: E731
    step = lambda x, y: 0.5 * (x > 3.2)  # noqa: E731
    corner = lambda x, y: 0.5 * ((x > 3.2) & (y > -10))  # noqa: E731
    for surface in (_bell(3.5, 10.0), _bell(2.0, 6.0), cap, step, corner, _bell(0.0, 1.0)):
        assert not _wide(_image(surface, sigma))


def test_flying_pixels_and_uneven_noise_are_measured():
    rng = np.random.default_rng(2)
    for share in (0.005, 0.02, 0.05, 0.1):
        points = _image(_bell(2.0, 12.0))
        flies = rng.random(points.shape[:2]) < share
        points[flies, 2] += rng.normal(0, 5, flies.sum())
        assert not _wide(points), share
        for row in range(20, 140, 20):  # side by side, as at an edge in the scanner's view
            points[row, 30:150:15] = points[row, 31:151:15] = points[row, 32:152:15] = points[row, 33:153:15]
            points[row, 30:150:15, 2] = points[row, 31:151:15, 2] = points[row, 32:152:15, 2] = 5.0
        assert not _wide(points), share
    for wide_mm, times in ((30, 5.0), (30, 10.0), (30, 0.5)):
        points = _image(_bell(2.0, 12.0), 0.0)
        uneven = np.where(np.hypot(*np.moveaxis(points[..., :2], 2, 0)) < wide_mm, times, 1.0)
        points[..., 2] += 0.02 * uneven * rng.normal(0, 1, uneven.shape)
        assert not _wide(points), times


def test_it_is_found_among_flying_pixels():
    points, _ = _replaced(_image(_bell(3.5, 12.0)), _nearest)
    flies = np.random.default_rng(3).random(points.shape[:2]) < 0.03
    points[flies, 2] += 4.0
    assert len(_wide(points)) == 1


@pytest.mark.parametrize("step_mm", [0.015625, 0.03125, 0.0625, 0.125])
def test_rounded_depths_repeat_everywhere(step_mm):
    points = _image(_bell(3.0, 30.0))
    points[..., 2] = np.round(points[..., 2] / step_mm) * step_mm
    assert not _parts(points, step_mm=step_mm)


def test_level_ply_between_two_steps_is_measured():
    points, rng = _image(_bell(0.0, 1.0), 0.0), np.random.default_rng(7)
    quieter = np.hypot(*np.moveaxis(points[..., :2], 2, 0)) < 15
    points[..., 2] = 0.0625 * np.round(rng.normal(0, np.where(quieter, 0.005, 0.03)) / 0.0625)
    assert not _parts(points, step_mm=0.0625)


def test_what_the_mask_hides_is_not_asked():
    points, marks = _replaced(_image(_bell(3.5, 12.0)), _nearest)
    assert not _parts(points, mask=cv2.dilate(marks, np.ones((9, 9))) > 0)


def test_an_unseen_part_is_not_made():
    points = _image(_bell(3.5, 10.0))
    points[np.hypot(*np.moveaxis(points[..., :2], 2, 0)) < 8] = np.nan
    assert not _parts(points)
    assert not _parts(np.full_like(points, np.nan))


def test_a_list_that_came_line_by_line_is_an_image_again():
    points = _image(_bell(3.5, 10.0))
    points[np.hypot(*np.moveaxis(points[..., :2], 2, 0)) < 8] = np.nan
    seen = np.isfinite(points[..., 2])
    turn = np.radians(20.0)
    aslant = points @ np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]], np.float32
    )
    for given in (points, aslant):
        image = in_lines(given[seen], 1.0)
        assert not image.laid
        assert np.array_equal(image.points, given, equal_nan=True)
    every = points.reshape(-1, 3)
    assert np.array_equal(in_lines(every, 1.0).points, points, equal_nan=True)
    columns = in_lines(np.swapaxes(points, 0, 1).reshape(-1, 3), 1.0)
    assert np.array_equal(columns.points, np.swapaxes(points, 0, 1), equal_nan=True)


def test_points_far_off_and_pixels_that_fly_leave_its_lines_whole():
    points = _image(_bell(3.5, 10.0))
    given, rng = points.copy(), np.random.default_rng(6)
    flies = rng.random(points.shape[:2]) < 0.02
    given[flies] += rng.uniform(-5, 5, (np.count_nonzero(flies), 3)).astype(np.float32)
    listed = given.reshape(-1, 3)
    for at, far in ((700, 1e4), (9000, -3e3), (15_000, 1e30), (15_500, np.inf)):
        listed[at, :2] = far
    image = in_lines(listed, 1.0)
    assert len(image.points) == len(points)
    off = image.points.shape[1] - points.shape[1]
    same = max(np.mean(image.points[:, k : k + points.shape[1], 2] == points[..., 2]) for k in range(off + 1))
    assert same > 0.93


def test_a_list_in_another_order_is_no_image():
    points = _image(_bell(3.5, 10.0))
    back_and_forth = points.copy()
    back_and_forth[1::2] = points[1::2, ::-1]
    shuffled = np.random.default_rng(4).permutation(points.reshape(-1, 3))
    for given in (back_and_forth.reshape(-1, 3), shuffled, np.full((500, 3), np.nan, np.float32), shuffled[:3]):
        assert in_lines(given.astype(np.float32), 1.0) is None


@pytest.mark.layup
@pytest.mark.parametrize("listed", [False, True])
@pytest.mark.parametrize("fill", [_median, _inpainted, _garbage])
def test_a_layup_whose_bump_was_replaced_does_not_pass(fill, listed):
    scan, reference = (cloud(one, SIZE, PITCH, n) for n, one in enumerate((laid(flat, bump(10.5, 3.9), PLY), flat)))
    whole = scan
    scan, _ = _replaced(scan, fill, least_mm=0.6)
    if listed:
        scan = scan.reshape(-1, 3)
    before, after = (
        debulk.inspect(points, reference, None, outline(*PLY), mold_from_scanner=np.eye(4)) for points in (whole, scan)
    )
    assert before.verdict is Verdict.CREASE
    assert after.verdict is not Verdict.CEASE
    assert fill is _garbage or any(one.check == "filled" and TOLD in one.reason for one in after.findings)


@pytest.mark.layup
def test_a_list_with_points_at_infinity_is_inspected_as_without_them():
    scan, reference = (cloud(one, SIZE, PITCH, n) for n, one in enumerate((laid(flat, bump(10.5, 3.9), PLY), flat)))
    listed = scan.reshape(-1, 3).astype(np.float32)
    inside = np.flatnonzero(np.hypot(listed[:, 0], listed[:, 1]) < 60)[::500]
    for axis, far in ((1, 3e38), (0, -3e38), (2, np.inf), (0, np.nan)):
        listed[inside[axis], axis] = far
    report = debulk.inspect(listed, reference, None, outline(*PLY), mold_from_scanner=np.eye(4))
    assert report.verdict is Verdict.CREASE
