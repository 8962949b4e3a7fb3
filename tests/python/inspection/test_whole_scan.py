"""What the search of a whole scan finds stays as it was found, and what a mask hides was not seen."""

from __future__ import annotations

import numpy as np
import pytest

import debulk
import laid_ply


def arrays(found):
    segmentation, feet = found.part
    maps = segmentation.labels, segmentation.heights, feet.labels, feet.heights, found.overview
    return [grid.values for grid in maps]


def test_results_that_are_held_do_not_change():
    inspector = laid_ply.inspector()
    scans = [laid_ply.scan(laid_ply.bell(x, 0, 60, 6)) for x in (-40, 60)]
    first = inspector.find(scans[0])
    copies = [values.copy() for values in arrays(first)]
    second = inspector.find(scans[1])
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays(first), copies, strict=True))
    assert not np.array_equal(arrays(first)[0], arrays(second)[0])
    place = second.part[0].heights.values.ctypes.data
    del second
    assert inspector.find(scans[1]).part[0].heights.values.ctypes.data == place  # nobody held it
    report = inspector.inspect(scans[0])
    heights, outlines = report.height_map.values.copy(), [p.outline_mm.copy() for p in report.pockets]
    inspector.inspect(scans[1])
    assert np.array_equal(report.height_map.values, heights, equal_nan=True)
    assert all(np.array_equal(p.outline_mm, o) for p, o in zip(report.pockets, outlines, strict=True))


def test_a_report_keeps_heights_two_millimetres_apart():
    fine = debulk.Recipe(clean={"grid_spacing_mm": 0.5})
    one = laid_ply.layup()
    inspector = debulk.Inspector(fine, one.reference, one.ply_outline, mold_from_scanner=one.mold_from_scanner)
    found = inspector.find(one.scan)
    heights, overview = found.part[0].heights, found.overview
    assert (heights.spacing_mm, overview.spacing_mm) == (0.5, 2.0)
    assert np.array_equal(heights.origin_mm, overview.origin_mm)
    of_ply = heights.values[::4, ::4]
    known = np.isfinite(of_ply) & np.isfinite(overview.values)
    assert known.sum() > 0.95 * np.isfinite(of_ply).sum()  # the segmentation bridges drop-outs
    assert np.array_equal(overview.values[known], of_ply[known])


def test_what_a_mask_hides_was_not_seen():
    one, scan = laid_ply.layup(), laid_ply.scan(laid_ply.bell(0, 0, 60, 6))
    mask = np.zeros(scan.shape[:2], dtype=bool)
    mask[300:400, 400:500] = True

    def inspector(reference, mask):
        pose = one.mold_from_scanner
        return debulk.Inspector(None, reference, one.ply_outline, mold_from_scanner=pose, camera=one.camera, mask=mask)

    before = scan.copy()
    found = inspector(one.reference, mask).find(scan)
    assert np.array_equal(scan, before, equal_nan=True)
    hidden = np.where(mask[..., None], np.float32(np.nan), [one.reference, scan]).astype(np.float32)
    same = inspector(hidden[0], None).find(hidden[1])
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays(found), arrays(same), strict=True))
    assert found.unseen.coverage == same.unseen.coverage
    with pytest.raises(debulk.InputError, match=r"mask: expected the shape of the scan's image, \(960, 1280\)"):
        inspector(inspector(one.reference, None).prepared, mask[:, :-1]).find(scan)


def test_a_scan_that_shows_too_little_is_doubted_whatever_comes_of_its_pockets(monkeypatch):
    """They are looked for while what was not seen is measured."""

    def refused(*_):
        raise debulk.InputError("the noise of so few heights")

    inspector, scan = laid_ply.inspector(), laid_ply.scan(laid_ply.bell(0, 0, 60, 6))
    monkeypatch.setattr(inspector._finder._front, "pockets", refused)
    few = scan.copy()
    few[: int(0.7 * len(few))] = np.nan
    assert "no pocket was looked for" in inspector.find(few).doubt
    with pytest.raises(debulk.InputError, match="few heights"):
        inspector.find(scan)
