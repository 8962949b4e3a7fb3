"""Pockets beside holes, judged with the hole filled in and on the mold; truths by quadrature of the shapes laid."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import debulk
import laid_ply
from debulk import InputError, Verdict
from debulk.results.half_seen import MOST_OF_RIM
from lab.varied import varied_layup

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
LIMIT_MM = debulk.Recipe().verdict.max_ridge_mm
WIDE_MM = 120.0  # of the bell, from foot to foot


def true_ridge_mm(high_mm: float) -> float:
    """Of the fibre over the bell's middle: half of what its arc is longer than the mold, and the paper's 0.43 t."""
    x = np.linspace(-WIDE_MM / 2, WIDE_MM / 2, 4001)
    arc = np.hypot(np.diff(x), np.diff(high_mm * np.cos(np.pi * x / WIDE_MM) ** 2)).sum()
    return float(0.5 * (arc - WIDE_MM) + 0.43 * laid_ply.THICKNESS_MM)


CREASES, CEASES, AT_LIMIT = 9.5, 4.0, 6.65  # heights of the bell, mm


def disc(x: Floats, y: Floats) -> Flags:
    return np.hypot(x - 45, y) < 18


def stripe(x: Floats, y: Floats) -> Flags:
    return (abs(y - 29) < 11) & (abs(x) < 75)


def notch(x: Floats, y: Floats) -> Flags:
    return (x > 15) & (x < 80) & (abs(y) < 0.35 * (x - 15))


def crown(x: Floats, y: Floats) -> Flags:
    return np.hypot(x, y) < 15


def half_of_it(x: Floats, y: Floats) -> Flags:
    return (x > 0) & (np.hypot(x, y) < 75)


def without(shape: Callable[[Floats, Floats], Flags], scan: NDArray[np.float32]) -> NDArray[np.float32]:
    pose = laid_ply.layup().mold_from_scanner
    points = scan.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    out = scan.copy()
    with np.errstate(invalid="ignore"):
        out[shape(points[..., 0], points[..., 1])] = np.nan
    return out


@cache
def laid(high_mm: float) -> NDArray[np.float32]:
    return laid_ply.scan(laid_ply.bell(0, 0, WIDE_MM, high_mm))


def inspected(high_mm: float, shape: Callable[[Floats, Floats], Flags]) -> debulk.Report:
    return laid_ply.inspector().inspect(without(shape, laid(high_mm)))


def beside(report: debulk.Report) -> Any:
    """The largest pocket beside the hole, which may part it; what is one pocket with it filled in gets one verdict."""
    cut = [p for p in report.pockets if p.half_seen is not None]
    assert len({p.verdict for p in cut}) == 1
    return cut[0]


def ridges(pocket: Any) -> dict[str, tuple[float, float]]:
    return {way.holes: way.ridge_range_mm for way in pocket.half_seen.ways}


def test_the_heights_chosen_crease_cease_and_lie_at_the_limit() -> None:
    assert true_ridge_mm(CREASES) > LIMIT_MM + 0.3
    assert true_ridge_mm(CEASES) < LIMIT_MM - 0.2
    assert abs(true_ridge_mm(AT_LIMIT) - LIMIT_MM) < 0.02


@pytest.mark.parametrize("shape", [disc, stripe, notch, crown])
def test_what_creases_however_the_ply_lies_in_the_hole_is_said_to_crease(
    shape: Callable[[Floats, Floats], Flags],
) -> None:
    report = inspected(CREASES, shape)
    one = beside(report)
    assert report.verdict is one.verdict is Verdict.CREASE, one.reason
    assert [way.verdict for way in one.half_seen.ways] == [Verdict.CREASE] * 3
    assert "a hole of" in one.reason and "rim is not closed" not in one.reason
    assert one.half_seen.rim_share <= MOST_OF_RIM
    (hole,) = one.half_seen.holes
    assert any(listed.centre_mm == hole.centre_mm for listed in report.unseen)


@pytest.mark.parametrize("shape", [disc, stripe, notch, crown])
def test_what_ceases_filled_in_does_not_pass_beside_a_large_hole(shape: Callable[[Floats, Floats], Flags]) -> None:
    report = inspected(CEASES, shape)
    one = beside(report)
    assert report.verdict is one.verdict is Verdict.UNDECIDED, one.reason
    filled = one.half_seen.ways[0]
    assert filled.verdict is Verdict.CEASE
    low, high = filled.ridge_range_mm
    assert low - 0.1 < true_ridge_mm(CEASES) < high + 0.1
    assert "a hole of" in one.reason


@pytest.mark.parametrize("shape", [disc, stripe, notch])
def test_near_the_limit_a_hole_leaves_it_undecided_or_worse(shape: Callable[[Floats, Floats], Flags]) -> None:
    assert inspected(AT_LIMIT, shape).verdict > Verdict.CEASE


@pytest.mark.parametrize("high_mm", [CREASES, CEASES])
def test_half_of_the_rim_unseen_cannot_be_judged(high_mm: float) -> None:
    report = inspected(high_mm, half_of_it)
    assert report.verdict is Verdict.INVALID
    one = beside(report)
    assert one.half_seen.rim_share > MOST_OF_RIM or not one.half_seen.ways
    assert "a hole of" in one.reason


def test_a_gap_in_the_reference_beside_a_pocket_cannot_be_judged() -> None:
    layup = laid_ply.layup()
    inspector = debulk.Inspector(
        None,
        without(disc, layup.reference),
        layup.ply_outline,
        mold_from_scanner=layup.mold_from_scanner,
        camera=layup.camera,
    )
    report = inspector.inspect(laid(CREASES))
    one = beside(report)
    assert report.verdict is one.verdict is Verdict.INVALID
    assert "a gap in the reference" in one.reason and "complete the reference" in one.reason


@pytest.mark.parametrize("kind", ["gaussians", "wrinkle", "lobes", "crescent"])
@pytest.mark.parametrize("severity", ["one", "benign"])
def test_no_verdict_of_the_second_family_is_wrong(kind: str, severity: str) -> None:
    layup = varied_layup(
        3, (640, 480), mold="saddle", pockets=[kind], severity=severity, noise=(), holes_mm=(), clamp=False, borders=0
    )
    pose, true_mm = layup.mold_from_scanner, max(p.ridge_mm for p in layup.truth.pockets)
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, layup.fibre_angles_deg, mold_from_scanner=pose, camera=layup.camera
    )
    points = layup.scan.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    whole = inspector.inspect(layup.scan)
    outline, rng = whole.pockets[0].outline_mm, np.random.default_rng(5)
    said = []
    for _ in range(6):
        at, half = outline[rng.integers(len(outline))], rng.uniform(10, 25)
        scan = layup.scan.copy()
        with np.errstate(invalid="ignore"):
            scan[np.hypot(points[..., 0] - at[0], points[..., 1] - at[1]) < half] = np.nan
        report = inspector.inspect(scan)
        said.append(report.verdict)
        assert not (report.passed and true_mm > LIMIT_MM + 0.1)
        if report.verdict is Verdict.CREASE:
            assert true_mm > LIMIT_MM - 0.1, report.reason
    if severity == "one":
        assert Verdict.CREASE in said


def test_the_report_shows_the_hole_and_both_ridges_and_refuses_a_better_verdict(tmp_path: Path) -> None:
    report = inspected(CEASES, disc)
    one = beside(report)
    path = tmp_path / "layup.json"
    report.save(path)
    again = beside(debulk.Report.load(path))
    assert again.half_seen == one.half_seen
    (low, high), (mold_low, mold_high) = ridges(one)["filled in"], ridges(one)["on the mold"]
    report.save(tmp_path / "layup.html")
    for text in (str(report.table()), (tmp_path / "layup.html").read_text()):
        text = text.replace("\N{NO-BREAK SPACE}", " ")
        assert "borders on a hole of" in text
        assert f"{low:.2f} to {high:.2f} mm" in text and f"{mold_low:.2f} to {mold_high:.2f} mm" in text
    tree = json.loads(path.read_text())
    tree["verdict"] = tree["pockets"][one.id - 1]["verdict"] = "cease"
    for hole in tree["unseen"]:
        hole["at_best"] = None
    path.write_text(json.dumps(tree))
    with pytest.raises(InputError, match=r"pockets\[0\].verdict: CEASE does not fit.*borders on a hole"):
        debulk.Report.load(path)


@pytest.mark.parametrize("seed", [717140, 259546])
def test_a_net_from_a_bump_at_the_edge_closes_on_the_wide_foot_it_stands_on(seed: int) -> None:
    """On ribs and on waves: a net that begins at the edge missed a part of a loose border's foot."""
    layup = varied_layup(seed)
    inspector = debulk.Inspector(
        None,
        layup.reference,
        layup.ply_outline,
        layup.fibre_angles_deg,
        mold_from_scanner=layup.mold_from_scanner,
        camera=layup.camera,
        mask=layup.mask,
    )
    report = inspector.inspect(layup.scan)
    assert not [p.reason for p in report.pockets if "rim is not closed" in p.reason]
    assert report.verdict is not Verdict.INVALID
