"""Predicted against measured: figures against the truth of a debulked layup, the interval against beta quantiles."""

import dataclasses
import hashlib
import json
import re

import numpy as np
import pytest
from scipy.stats import beta

import debulk
from debulk.comparison import Comparison, PocketComparison
from debulk.inspection.calls import compare
from debulk.inspection.clouds import fingerprint
from debulk.inspection.comparing import compared
from debulk.page.comparison import page
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results.comparison import Agreement, agreement
from debulk.results.report import PocketReport
from debulk.surface import HeightMap
from debulk.verdict import Verdict

# --- the layup after debulking ---


@pytest.fixture(scope="module")
def layup():
    return debulk.scenes.layup(seed=3, pixels=(1024, 768))


@pytest.fixture(scope="module")
def debulked(layup):
    return layup.debulked()


def to_mold(layup, points):
    t = layup.mold_from_scanner
    return points.astype(float) @ t[:3, :3].T + t[:3, 3]


def test_clean_debulked_scan_lies_on_the_true_ply():
    clean = debulk.scenes.layup(3, (1024, 768), noise_mm=0.0, flying_share=0.0, dropout_share=0.0)
    after = clean.debulked()
    points = to_mold(clean, after.scan).reshape(-1, 3)
    above = points[:, 2] - clean.truth.mold_height(points[:, :2])
    ply = after.ply_height_above_mold(points[:, :2])
    on_ply = ply > 0
    assert np.count_nonzero(ply > after.thickness_mm + 0.5) > 1000  # ridges were hit
    assert np.abs(above - ply)[on_ply].max() < 2e-3  # float32 at 2.4 m


def test_ridges_follow_from_the_excess_length_alone(layup, debulked):
    heights = []
    for bump, ridge in zip(layup.truth.pockets, debulked.ridges, strict=True):
        left = bump.straight_excess_mm - 0.2 - (0.5 if bump.touches_ply_edge else 0.0)
        assert (ridge is None) == (left <= 0)
        if ridge is None:
            continue
        heights.append((left, ridge.height_mm))
        # Excess of the ridge's middle section, by the length of a fine polyline along the short axis.
        across = np.linspace(-ridge.radii_mm[1], ridge.radii_mm[1], 20001)
        turn = np.deg2rad(ridge.angle_deg)
        x, y = ridge.centre_mm[0] - across * np.sin(turn), ridge.centre_mm[1] + across * np.cos(turn)
        length = np.hypot(np.diff(across), np.diff(ridge.rise(x, y))).sum()
        assert length - 2 * ridge.radii_mm[1] == pytest.approx(left, abs=1e-5)
        assert ridge.radii_mm[0] == bump.radii_mm[0]
        assert ridge.angle_deg == bump.angle_deg
    assert len(heights) >= 5
    assert sorted(heights) == sorted(heights, key=lambda pair: pair[1])
    assert any(ridge is None for ridge in debulked.ridges)


def test_debulked_is_the_same_again_and_has_faults_of_its_own(layup, debulked):
    assert layup.debulked().scan.tobytes() == debulked.scan.tobytes()
    assert not np.array_equal(debulked.dropout, layup.truth.dropout)
    assert np.isnan(debulked.scan[..., 2]).mean() == pytest.approx(0.02, abs=0.005)
    assert layup.debulked(bulk_factor=1.0).thickness_mm == 0.3
    with pytest.raises(debulk.InputError, match="bulk_factor"):
        layup.debulked(bulk_factor=0.5)


# --- the comparison of whole scans ---


@pytest.fixture(scope="module")
def inspector(layup):
    return debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


@pytest.fixture(scope="module")
def before(inspector, layup):
    return inspector.inspect(layup.scan)


@pytest.fixture(scope="module")
def comparison(inspector, before, debulked):
    return inspector.compare(before, debulked.scan)


def test_ridges_of_bumps_that_were_no_pockets_are_told_and_no_others(comparison, debulked):
    """Of bumps below the tolerances ridges remain, too, in this virtual world."""
    outlines = [p.outline_mm for p in comparison.pockets]
    true = [
        ridge
        for ridge in debulked.decoy_ridges
        if ridge is not None
        and ridge.height_mm + debulked.thickness_mm > comparison.max_peak_mm
        and not any(debulk.pocket.inside(outline, np.array([ridge.centre_mm]))[0] for outline in outlines)
    ]
    surely = sum(ridge.height_mm + debulked.thickness_mm > 1.5 * comparison.max_peak_mm for ridge in true)
    assert 1 <= surely <= len(comparison.standing) <= len(true)  # the median lowers narrow ones
    for one in comparison.standing:
        off, ridge = min((float(np.hypot(*np.subtract(one.place_mm, r.centre_mm))), k) for k, r in enumerate(true))
        assert off < true[ridge].radii_mm[0] and one.length_mm < 2 * true[ridge].radii_mm[0]
        assert comparison.max_peak_mm < one.height_mm < true[ridge].height_mm + debulked.thickness_mm + 0.1


def test_measured_figures_agree_with_the_truth(comparison, debulked):
    assert len(comparison.pockets) >= 14  # and bumps below the tolerances that could crease: no ridges are made of them
    assert comparison.laid_height_mm == pytest.approx(0.25, abs=0.01)
    assert comparison.warnings == tuple(
        f"a ridge of {one.height_mm:.2f} mm, {one.length_mm:.0f} mm long, stands at ({one.place_mm[0]:.0f}, "
        f"{one.place_mm[1]:.0f}) mm, where no pocket was"
        for one in comparison.standing
    )
    for p in comparison.pockets[:14]:
        low, high = p.outline_mm.min(axis=0), p.outline_mm.max(axis=0)
        xy = np.stack(np.meshgrid(*(np.arange(a, b, 0.5) for a, b in zip(low, high, strict=True))), -1).reshape(-1, 2)
        true = debulked.ply_height_above_mold(xy[debulk.pocket.inside(p.outline_mm, xy)])
        rms = np.sqrt(np.mean(true**2))
        assert p.measured_rms_mm == pytest.approx(rms, abs=0.1 * rms + 0.005)  # a drop-out may hide part of a ridge
        if true.max() > 1.0:
            assert 0.6 * true.max() < p.measured_peak_mm < true.max() + 0.3
            assert p.measured is Verdict.CREASE
        else:
            assert p.measured is Verdict.CEASE


def test_predicted_ridges_are_the_reports_with_their_band(comparison, before):
    assert any(len(p.predicted_ridges_mm) == 2 for p in comparison.pockets)  # a ridge and its mirror image
    for p, known in zip(comparison.pockets, before.pockets, strict=True):
        lines = [line[:, :2].tolist() for ridge in known.ridges for line in ridge.lines_mm]
        assert [line.tolist() for line in p.predicted_ridges_mm] == lines
        ridge = known.deciding_ridge
        assert p.predicted_ridge_mm == (ridge and ridge.height_mm)
        assert p.predicted_ridge_range_mm == (ridge and ridge.range_mm)
        assert p.predicted_place_mm == (known.ridges[0].place_spread_mm if lines else None)


def test_the_function_does_what_the_method_does(comparison, before, layup, debulked):
    other = compare(before, debulked.scan, layup.reference, mold_from_scanner=layup.mold_from_scanner)
    assert other.table() == comparison.table()


def test_the_undebulked_ply_creases_everywhere(inspector, before, layup):
    moved = layup.scan + np.float32(1e-3)  # the very scan of the report is refused
    same = inspector.compare(before, moved).pockets
    assert {p.measured for p in same} == {Verdict.CREASE}
    assert min(p.measured_peak_mm for p in same[:14]) > 3.0


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda scan: scan + np.array([0.0, 0.0, -0.6], dtype=np.float32), "too high everywhere"),  # nearer to it
        (lambda scan: scan + np.array([0.0, 0.0, 20.0], dtype=np.float32), "mm too low"),
        (lambda scan: scan + np.array([25.0, 0.0, 0.0], dtype=np.float32), "outline|between the pockets|swapped"),
        (lambda scan: scan * np.float32(1.01), "lies|bent|between the pockets"),
    ],
    ids=["0.6 mm", "20 mm", "sideways", "1 %"],
)
def test_a_mold_that_moved_or_another_part_is_refused(inspector, before, debulked, spoil, reason):
    with pytest.raises(debulk.InputError, match=rf"^debulked_scan: expected the ply of the report.*({reason})"):
        inspector.compare(before, spoil(debulked.scan))


def test_the_scan_that_the_report_was_made_from_is_refused(inspector, before, layup):
    known = before.trace.scan.xxh3[:16]
    with pytest.raises(debulk.InputError, match=rf"this is the scan that the report was made from \(XXH3 {known}"):
        inspector.compare(before, layup.scan)
    forged = dataclasses.replace(before.trace, scan=fingerprint.of_cloud(layup.scan))
    with pytest.raises(debulk.InputError, match=r"this is the scan that the report was made from \(SHA-256"):
        inspector.compare(dataclasses.replace(before, trace=forged), layup.scan)


def test_a_comparison_is_traced_like_an_inspection(comparison, before, debulked, tmp_path):
    assert comparison.trace.scan.xxh3 == fingerprint.of_cloud(debulked.scan, kind="xxh3").xxh3
    assert comparison.trace.reference == before.trace.reference
    assert comparison.trace.time_utc > before.trace.time_utc and comparison.trace.versions["debulk"]
    assert comparison.report_trace.time_utc == before.trace.time_utc and comparison.report_verdict is before.verdict
    before.save(tmp_path / "before.json")
    assert comparison.report_sha256 == hashlib.sha256((tmp_path / "before.json").read_bytes()).hexdigest()
    assert comparison.recipe == before.recipe
    html = page(comparison)
    for told in (comparison.report_sha256, comparison.trace.scan.xxh3, comparison.trace.time_utc):
        assert told in html


def test_the_empty_mold_is_no_debulked_ply(inspector, before, layup):
    with pytest.raises(debulk.InputError, match=r"scan and reference are the same"):
        inspector.compare(before, layup.reference)


def test_unseen_pockets_are_invalid(inspector, before, layup, debulked):
    hidden = before.pockets[3]
    at = to_mold(layup, debulked.scan)[..., :2]
    near = np.hypot(*np.moveaxis(at - hidden.outline_mm.mean(axis=0), -1, 0)) < 200
    scan = np.where(near[..., None], np.float32(np.nan), debulked.scan)
    p = inspector.compare(before, scan).pockets[3]
    assert p.measured is Verdict.INVALID
    assert p.hit is None
    assert p.measured_rms_mm is None
    assert "seen" in p.reason


def test_save_and_load(comparison, tmp_path):
    comparison.save(tmp_path / "c.json")
    loaded = Comparison.load(tmp_path / "c.json")
    assert loaded.table() == comparison.table()
    assert np.array_equal(loaded.height_map.values, comparison.height_map.values, equal_nan=True)
    for a, b in zip(loaded.pockets, comparison.pockets, strict=True):
        assert a.measured_rms_mm == b.measured_rms_mm
        assert np.array_equal(a.outline_mm, b.outline_mm)
        assert len(a.predicted_ridges_mm) == len(b.predicted_ridges_mm)
        assert all(map(np.array_equal, a.predicted_ridges_mm, b.predicted_ridges_mm))
        assert a.predicted_place_mm == b.predicted_place_mm
    assert json.loads((tmp_path / "c.json").read_text())["format"] == "debulk comparison"

    comparison.save(tmp_path / "c.csv")
    lines = (tmp_path / "c.csv").read_text().splitlines()
    assert len(lines) == 1 + len(comparison.pockets)
    assert lines[0].startswith("id,predicted,measured,hit")

    with pytest.raises(debulk.InputError, match=r"\.json, \.csv or \.html"):
        comparison.save(tmp_path / "c.txt")


def test_a_report_is_no_comparison(report, tmp_path):
    report.save(tmp_path / "r.json")
    with pytest.raises(debulk.InputError, match="not a comparison"):
        Comparison.load(tmp_path / "r.json")
    (tmp_path / "cut.json").write_text('{"format": "debulk comparison", "schema": 2,')
    with pytest.raises(debulk.InputError, match="cut off"):
        Comparison.load(tmp_path / "cut.json")


def test_bad_input(inspector, before):
    with pytest.raises(debulk.InputError, match=r"report: expected a debulk\.Report"):
        compare("layup.json", np.zeros((4, 4, 3)), np.zeros((4, 4, 3)))
    with pytest.raises(debulk.InputError, match="debulked_scan"):
        inspector.compare(before, np.zeros((4, 4)))


# --- outcomes, from heights made by hand ---


def square(x0, x1, y0, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def flat(value=0.25):
    values = np.full((60, 100), value, dtype=np.float32)
    return HeightMap(values, np.zeros(2), 1.0, np.ones(values.shape, dtype=bool))


def one_pocket(outline, verdict=Verdict.CEASE, **more):
    pocket = PocketReport(
        id=1, verdict=verdict, reason="", outline_mm=outline, area_mm2=400.0, peak_mm=5.0, volume_mm3=1.0, **more
    )
    return Report(verdict=verdict, reason="", pockets=(pocket,))


OUTLINE = square(9.5, 29.5, 9.5, 29.5)  # 20 x 20 grid points


PLAIN = Recipe(clean={"median_cells": 1})


def test_rms_and_peak_in_closed_form():
    heights = flat()
    heights.values[18:23, 10:30] = 1.25  # five rows of twenty
    heights.values[40:50, 40:50] = 50.0  # outside
    p = compared(one_pocket(OUTLINE), heights, PLAIN).pockets[0]
    assert p.measured_rms_mm == pytest.approx(np.sqrt((15 * 0.25**2 + 5 * 1.25**2) / 20), rel=1e-6)
    assert p.measured_peak_mm == 1.25
    assert p.measured is Verdict.CREASE
    assert p.hit is False


def test_a_ridge_too_short_for_the_rms_creases_by_its_peak():
    heights = flat()
    heights.values[18:23, 12:15] = 0.7
    p = compared(one_pocket(OUTLINE), heights, Recipe()).pockets[0]
    assert p.measured_rms_mm < 0.3
    assert p.measured is Verdict.CREASE
    assert "peak 0.70 mm exceeds" in p.reason


def test_what_wide_cells_may_hide_is_undecided():
    """Of cells 6 mm wide, between which a ridge above the limit fits; of narrow ones with a strip that nobody saw."""
    wide = dataclasses.replace(flat(), spacing_mm=6.0)
    p = compared(one_pocket(square(59.5, 179.5, 59.5, 179.5)), wide, Recipe()).pockets[0]
    assert p.measured is Verdict.UNDECIDED and "scan finer" in p.reason and p.hit is None
    assert p.measured_peak_mm == 0.25 and p.measured_peak_range_mm[1] == p.may_stand_mm > 0.6
    assert p.reason.startswith("a ridge as high as the pocket was may stand where 0.25 mm was read")
    heights = flat()
    heights.values[18:21, 8:32] = np.nan
    p = compared(one_pocket(OUTLINE), heights, Recipe()).pockets[0]
    assert p.measured is Verdict.UNDECIDED and p.measured_share == 0.85
    assert p.reason.startswith(f"a ridge of up to {p.may_stand_mm:.2f} mm may stand")
    coarse = compared(one_pocket(OUTLINE), flat(), Recipe(), pitch_mm=6.0).pockets[0]
    assert coarse.measured is Verdict.UNDECIDED and "6 mm apart" in coarse.reason


def test_a_run_of_flying_pixels_is_no_ridge():
    heights = flat()
    heights.values[20:22, 12:17] = 3.0
    p = compared(one_pocket(OUTLINE), heights, Recipe()).pockets[0]
    assert p.measured_peak_mm == 0.25


def test_a_peak_within_the_noise_is_undecided():
    heights = flat()
    heights.values[:] += np.random.default_rng(0).normal(0, 0.1, heights.values.shape).astype(np.float32)
    heights.values[15:20, 15:20] = 0.65
    p = compared(one_pocket(square(9.5, 49.5, 9.5, 49.5)), heights, Recipe()).pockets[0]
    assert p.noise_mm == pytest.approx(0.1, rel=0.25)
    assert p.measured is Verdict.UNDECIDED
    assert p.hit is None


@pytest.mark.parametrize(
    ("predicted", "height", "hit"),
    [
        (Verdict.CEASE, 0.25, True),
        (Verdict.CEASE, 0.5, False),
        (Verdict.CREASE, 0.25, False),
        (Verdict.CREASE, 0.5, True),
        (Verdict.UNDECIDED, 0.25, None),
        (Verdict.INVALID, 0.5, None),
    ],
)
def test_hits(predicted, height, hit):
    comparison = compared(one_pocket(OUTLINE, predicted), flat(height), Recipe())
    assert comparison.pockets[0].hit is hit
    assert comparison.agreement.total == (hit is not None)
    assert comparison.agreement.hits == (hit is True)
    measured = Verdict.CEASE if height == 0.25 else Verdict.CREASE
    assert comparison.outcomes() == {(predicted, measured): 1}


def test_a_missed_crease_leads():
    sides = [(Verdict.CREASE, Verdict.CREASE), (Verdict.CEASE, Verdict.CREASE), (Verdict.CREASE, Verdict.CEASE)]
    pockets = tuple(
        PocketComparison(id=k, outline_mm=np.zeros((3, 2)), predicted=a, measured=b, reason="")
        for k, (a, b) in enumerate(sides, start=7)
    )
    held = Comparison(pockets=pockets, max_rms_mm=0.3, max_peak_mm=0.6)
    assert held.headline == "1 FALSE CEASE: pocket 8; 1 FALSE CREASE: pocket 9"
    assert held.table().splitlines()[0] == held.headline
    assert re.search(r'<header class="banner crease">.*?<h1>1 FALSE CEASE: pocket 8', page(held), flags=re.S)
    assert "FALSE CEASE" in held._repr_html_()
    right = dataclasses.replace(held, pockets=pockets[:1])
    assert right.headline == "no outcome was wrong" and '<header class="banner plain">' in page(right)


def test_rms_alone_counts_what_the_verdict_leaves_open():
    report = one_pocket(OUTLINE, Verdict.UNDECIDED, rms_mm=0.31)
    comparison = compared(report, flat(0.5), Recipe())
    assert comparison.agreement.total == 0
    assert comparison.rms_agreement.hits == 1
    assert "no pocket was decided" in comparison.table()


def test_an_outline_off_the_map_was_not_seen():
    p = compared(one_pocket(square(500, 520, 500, 520)), flat(), Recipe()).pockets[0]
    assert p.measured is Verdict.INVALID


def test_a_pocket_that_the_map_ends_in_was_seen_in_part():
    """A scan of half the ply: its map ends at x = 0, and of an outline beyond it only what is on the map is known."""
    p = compared(one_pocket(square(-10.5, 9.5, 9.5, 29.5)), flat(), Recipe()).pockets[0]
    assert p.measured is Verdict.INVALID and p.measured_share == 0.5
    p = compared(one_pocket(square(-3.5, 29.5, 9.5, 29.5)), flat(), Recipe()).pockets[0]
    assert p.measured is Verdict.UNDECIDED and p.measured_share == pytest.approx(30 / 33)  # a strip that hides a ridge


def test_a_ply_that_stands_as_thick_as_before_is_told():
    outline = square(-1.0, 99.0, -1.0, 59.0)
    for height, told in ((0.25, 0), (0.27, 0), (0.28, 1), (0.30, 1)):
        report = dataclasses.replace(one_pocket(OUTLINE), ply_outline_mm=outline)
        warnings = compared(report, flat(height), Recipe()).warnings
        assert len(warnings) == told and all("was it debulked?" in warning for warning in warnings)
    thin = Recipe(material={"bulk_factor": 1.05})  # which loses too little to be told
    assert compared(report, flat(0.3), thin).warnings == ()


def test_no_pockets():
    comparison = compared(Report(verdict=Verdict.CEASE, reason="", pockets=()), flat(), Recipe())
    assert np.isnan(comparison.agreement.rate)
    assert "no pocket to compare" in comparison.table()


# --- the interval ---


@pytest.mark.parametrize(("hits", "total"), [(13, 14), (0, 14), (14, 14), (1, 2), (500, 1000), (1, 1)])
@pytest.mark.parametrize("confidence", [0.95, 0.9])
def test_interval_against_quantiles_of_the_beta_distribution(hits, total, confidence):
    found = agreement(hits, total, confidence)
    tail = 0.5 * (1 - confidence)
    low = 0.0 if hits == 0 else beta.ppf(tail, hits, total - hits + 1)
    high = 1.0 if hits == total else beta.ppf(1 - tail, hits + 1, total - hits)
    assert found.low == pytest.approx(low, abs=1e-9)
    assert found.high == pytest.approx(high, abs=1e-9)


def test_thirteen_of_fourteen():
    assert str(agreement(13, 14)) == "13 of 14 right, 93 % (95 % interval 66.1 to 99.8 %, Clopper-Pearson)"
    assert agreement(0, 0) == Agreement(hits=0, total=0, low=0.0, high=1.0)
    with pytest.raises(debulk.InputError, match="hits"):
        agreement(3, 2)
    with pytest.raises(debulk.InputError, match="confidence"):
        agreement(1, 2, 95)


def test_a_fold_over_the_edge_of_the_ply_is_no_wrong_outline():
    """The comparison was refused: "the outline leaves out a part of the ply"."""
    layup = debulk.scenes.layup(300, (1024, 768))
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    comparison = inspector.compare(inspector.inspect(layup.scan), layup.debulked().scan)
    assert sum(p.measured is Verdict.CREASE for p in comparison.pockets) > 5
