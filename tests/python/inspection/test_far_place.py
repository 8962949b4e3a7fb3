"""Clouds far from the origin of the scanner's frame are shifted before they are rounded, and the report says so."""

from types import SimpleNamespace

import numpy as np
import pytest

import debulk
from debulk import InputError, Inspector, scenes
from debulk.inspection.repeating import repeat

AWAY_MM = np.array([691_000_123.25, -5_334_000_456.5, 520_000.0])  # as easting and northing of a map
NEAR_MM = AWAY_MM % 1000 + np.array([0, 0, -2000])
NEEDED = debulk.Recipe(solve={"when": "needed"})  # faster


@pytest.fixture(scope="module")
def far():
    """Return a layup in a frame whose origin is far away, and the same layup near it, as no camera sees it."""
    layup = scenes.layup(seed=0, pixels=(480, 360))

    def moved(away):
        pose = layup.mold_from_scanner.copy()
        pose[:3, 3] -= pose[:3, :3] @ away
        clouds = {"scan": layup.scan.astype(np.float64) + away, "reference": layup.reference.astype(np.float64) + away}
        return SimpleNamespace(**clouds, given={"ply_outline": layup.ply_outline, "mold_from_scanner": pose})

    far = moved(AWAY_MM)
    far.near = moved(NEAR_MM)
    return far


def test_nothing_is_lost(far, tmp_path):
    inspector = Inspector(NEEDED, far.reference, **far.given)
    report = inspector.inspect(far.scan)
    assert "were subtracted from all of them before they were rounded to float32" in report.warnings[0]
    assert "(691000000, -5334000000, 522000) mm" in report.warnings[0]
    near = debulk.inspect(far.near.scan, far.near.reference, NEEDED, **far.near.given)
    assert not near.warnings and report.verdict is near.verdict and len(report.pockets) == len(near.pockets)
    for one, other in zip(report.pockets, near.pockets, strict=True):
        assert abs(one.area_mm2 - other.area_mm2) < 2e-3 * other.area_mm2 + 1
        assert abs(one.peak_mm - other.peak_mm) < 2e-3
        np.testing.assert_allclose(one.outline_mm.mean(axis=0), other.outline_mm.mean(axis=0), atol=0.05)

    inspector.save(tmp_path / "a.npz")
    again = Inspector.load(tmp_path / "a.npz").inspect(far.scan)
    assert again.warnings == report.warnings
    assert [p.area_mm2 for p in again.pockets] == [p.area_mm2 for p in report.pockets]
    assert len(inspector.find(far.scan).pockets) == 14
    assert repeat(report, far.scan, far.reference).same
    with pytest.raises(InputError, match="scan: expected the inspection's"):
        repeat(report, far.scan + 1, far.reference)
    again = far.scan.copy()
    again[0, 0] = np.nan  # another scan of the same ply, on which nothing was debulked
    compared = inspector.compare(report, again)
    assert compared.pockets[0].measured_peak_mm == pytest.approx(report.pockets[0].peak_mm, abs=0.3)


def test_without_a_pose_a_far_cloud_is_refused(far):
    with pytest.raises(InputError, match=r"reference: .* about 5.334e\+09 mm away, where float32 resolves"):
        debulk.inspect(far.scan, far.reference)


def test_single_precision_far_away_is_named(far):
    away = np.array([0.0, 0, 300_000])
    pose = far.near.given["mold_from_scanner"].copy()
    pose[:3, 3] -= pose[:3, :3] @ away
    given = far.near.given | {"mold_from_scanner": pose}
    inspector = Inspector(NEEDED, (far.near.reference + away).astype(np.float32), **given)
    warnings = inspector.inspect((far.near.scan + away).astype(np.float32)).warnings
    assert len(warnings) == 3
    for name, warning in zip(("reference", "scan"), warnings[1:], strict=True):
        assert f"the {name} came as float32, which so far from the origin has steps of 0.031 mm" in warning


def test_scans_in_other_forms_are_the_same_scan(far):
    near = far.near
    records = np.zeros(near.scan.shape[:2], dtype=[("x", "f8"), ("i", "u1"), ("y", "f8"), ("z", "f8")])
    for k, name in enumerate("xyz"):
        records[name] = near.scan[..., k]
    inspector = Inspector(NEEDED, near.reference, **near.given)
    plain, other = inspector.inspect(near.scan), inspector.inspect(records)
    assert plain.trace.scan == other.trace.scan and plain.verdict is other.verdict
    assert [p.area_mm2 for p in plain.pockets] == [p.area_mm2 for p in other.pockets]
