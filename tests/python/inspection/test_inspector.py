from __future__ import annotations

import threading

import numpy as np
import pytest

from debulk import Cancelled, Grid, InputError, Inspector, Recipe, Report, Verdict, inspect, pocket, scenes
from debulk.inspection import left_out
from debulk.inspection.evaluate.evaluation import evaluate
from debulk.inspection.running.cycle import Cycle
from debulk.results.advice import advice


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=3, pixels=(640, 480))


@pytest.fixture(scope="module")
def inspector(layup):
    return Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


@pytest.fixture(scope="module")
def report(layup, inspector):
    return inspector.inspect(layup.scan)


def test_finds_judges_and_explains(report):
    assert isinstance(report, Report)
    assert sum(not p.promoted for p in report.pockets) == 14
    assert report.verdict is Verdict.CREASE
    assert not report.passed
    for p in report.pockets:
        assert p.reason
        low, high = p.rms_range_mm
        assert p.ridge_range_mm[0] <= p.ridge_height_mm <= p.ridge_range_mm[1]
        assert (p.ridge_nodes is None) == (p.ridge_height_mm == 0)
        if p.ridge_nodes is not None:
            assert p.post_processed_gap_mm[p.ridge_nodes].max() == pytest.approx(p.ridge_height_mm)
        assert low <= p.rms_mm <= high
        wanted = Recipe().solve
        fewest, most = (1, 2) if p.excess else (wanted.starts, wanted.most_starts)
        assert fewest <= p.solve.starts <= most
        assert p.debulked_mm.shape == p.net.nodes_mm.shape
        assert p.post_processed_gap_mm.shape == (p.node_count,)
        terms = p.energy_terms_mj
        total = terms["bending"] + terms["shear"] + terms["friction"] - terms["gravity"] - terms["vacuum"]
        assert p.energy_mj == pytest.approx(total, rel=1e-9)
        assert (terms["friction"] > 0) == (p.net.kinds == 2).any()
    assert {"clean", "height map", "pockets", "debulk"} <= set(report.timings_ms)


def test_same_bits_on_any_number_of_threads(layup, report):
    for threads in (1, 2, 4):
        again = inspect(
            layup.scan,
            layup.reference,
            Recipe(run={"threads": threads}),
            layup.ply_outline,
            mold_from_scanner=layup.mold_from_scanner,
        )
        assert again.height_map.values.tobytes() == report.height_map.values.tobytes()
        for one, other in zip(again.pockets, report.pockets, strict=True):
            assert one.outline_mm.tobytes() == other.outline_mm.tobytes()
            assert one.net.nodes_mm.tobytes() == other.net.nodes_mm.tobytes()
            assert one.debulked_mm.tobytes() == other.debulked_mm.tobytes()
            assert (one.rms_mm, one.ridge_height_mm, one.reason) == (other.rms_mm, other.ridge_height_mm, other.reason)


def test_float64_and_strides_make_no_difference(layup, inspector, report):
    wide = np.zeros((*layup.scan.shape[:2], 5))
    wide[..., 1:4] = layup.scan
    again = inspector.inspect(wide[..., 1:4])
    assert again.height_map.values.tobytes() == report.height_map.values.tobytes()


@pytest.mark.parametrize("seed", [1, 2, 7])
def test_a_ply_without_pockets_passes_without_a_solve(seed):
    layup = scenes.layup(seed=seed, pixels=(640, 480))  # pixels 2 mm apart, some rows of which fly over the ply
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    # The reference, seen once more, with a ply of 0.3 mm on it.
    points = layup.reference.astype(np.float64) @ layup.mold_from_scanner[:3, :3].T + layup.mold_from_scanner[:3, 3]
    on_ply = pocket.inside(layup.ply_outline, points[..., :2].reshape(-1, 2)).reshape(points.shape[:2])
    fall = layup.reference.astype(np.float64) @ layup.mold_from_scanner[2, :3]
    laid = layup.reference * (1 + np.where(on_ply, 0.3, 1e-3) / fall)[..., None]
    report = inspector.inspect(laid.astype(np.float32))
    assert report.verdict is Verdict.CEASE, report.reason
    assert report.passed
    assert report.pockets == ()


def test_too_little_seen_is_invalid(layup, inspector):
    half = layup.scan.copy()
    half[:, : half.shape[1] // 2] = np.nan
    report = inspector.inspect(half)
    assert report.verdict is Verdict.INVALID
    assert "seen" in report.reason


def test_a_masked_clamp_counts_as_not_seen(layup):
    mask = np.zeros(layup.scan.shape[:2], dtype=bool)
    mask[200:300, 250:400] = True
    inspector = Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, mask=mask
    )
    assert inspector.inspect(layup.scan).coverage < 0.97


def test_without_an_outline_no_edge_is_free_and_the_report_says_so(layup):
    report = inspect(layup.scan, layup.reference, mold_from_scanner=layup.mold_from_scanner)
    assert any("outline is not known" in entry.why for entry in report.left_out)
    assert all((p.net.kinds != 2).all() for p in report.pockets if p.net is not None)


def test_fibre_angles_turn_the_net(layup):
    turned = inspect(
        layup.scan, layup.reference, None, layup.ply_outline, (30.0, 120.0), layup.mold_from_scanner
    ).pockets[1]
    i, j = turned.net.edges[0]
    step = turned.net.nodes_mm[j] - turned.net.nodes_mm[i]
    angle = np.degrees(np.arctan2(step[1], step[0])) % 90
    assert abs(angle - 30) < 5
    grid = Grid(np.full((4, 4, 2), (30.0, 120.0)), np.array([-800.0, -600.0]), 500.0)
    same = inspect(layup.scan, layup.reference, None, layup.ply_outline, grid, layup.mold_from_scanner).pockets[1]
    assert same.net.nodes_mm.tobytes() == turned.net.nodes_mm.tobytes()


def test_an_unorganised_cloud_finds_the_large_pockets(layup):
    scan = layup.scan.reshape(-1, 3)
    reference = layup.reference.reshape(-1, 3)
    report = inspect(
        scan[np.isfinite(scan).all(axis=1)],
        reference[np.isfinite(reference).all(axis=1)],
        None,
        layup.ply_outline,
        mold_from_scanner=layup.mold_from_scanner,
    )
    for found, true in zip(report.pockets[:6], layup.truth.pockets, strict=False):
        assert found.area_mm2 == pytest.approx(true.area_mm2, rel=0.03)


def test_a_passed_deadline_is_undecided_never_cease(layup, inspector):
    report = inspector.inspect(layup.scan, deadline_s=1e-6)
    assert report.verdict in (Verdict.UNDECIDED, Verdict.INVALID)
    for p in report.pockets:
        assert p.verdict in (Verdict.UNDECIDED, Verdict.INVALID)
        assert "deadline" in p.reason or p.verdict is Verdict.INVALID
    assert "the deadline passed" in [entry.why for entry in report.left_out]
    assert any(deed.do.startswith("give the inspection more time") for deed in advice(report))


def test_what_the_deadline_left_out_is_named_for_each_pocket(layup, inspector):
    cycle = Cycle()
    cycle.stop.set_deadline(1e-9)
    for one in inspector.find(layup.scan).pockets[:3]:
        assert evaluate(one, inspector.ply, cycle.stop).late == "net and minimum"
    named = left_out.of_late([(1, "net"), (2, "minimum"), (5, "net")])
    assert [entry.what for entry in named] == ["net of pockets 1, 5", "minimum of pocket 2"]
    assert {entry.why for entry in named} == {"the deadline passed"}


def test_cancel_ends_the_inspection_and_leaves_no_thread(layup, inspector):
    before = threading.active_count()

    def at(stage: str, done: float) -> None:
        if stage == "debulk":
            inspector.cancel()

    with pytest.raises(Cancelled):
        inspector.inspect(layup.scan, progress=at)
    assert threading.active_count() == before
    assert inspector.inspect(layup.scan).verdict is Verdict.CREASE  # usable again


def test_progress_goes_from_nothing_to_all(layup, inspector):
    seen: list[tuple[str, float]] = []
    inspector.inspect(layup.scan, progress=lambda stage, done: seen.append((stage, done)))
    shares = [done for _, done in seen]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reference": np.zeros((4, 4))}, ["reference", "(H, W, 3)"]),
        ({"reference": np.full((20, 20, 3), np.nan)}, ["reference", "finite"]),
        ({"reference": "meters"}, ["reference", "unit m"]),
        ({"ply_outline": [[0, 0], [1, 1]]}, ["ply_outline", "3 corners"]),
        ({"ply_outline": [[0, 0, 0]] * 4}, ["ply_outline", "(M, 2)"]),
        ({"ply_outline": [[0, 0], [1, np.nan], [2, 2]]}, ["ply_outline", "finite"]),
        ({"fibre_angles_deg": (0, 90, 45)}, ["fibre_angles_deg", "two angles"]),
        ({"fibre_angles_deg": "0,90"}, ["fibre_angles_deg"]),
        ({"mold_from_scanner": np.eye(3)}, ["mold_from_scanner", "(4, 4)"]),
        ({"mold_from_scanner": 2 * np.eye(4)}, ["rigid"]),
        ({"camera": (0, 1, 1)}, ["camera", "positive"]),
        ({"mask": np.zeros((5, 5))}, ["mask", "bool"]),
        ({"mask": np.zeros((5, 5), dtype=bool)}, ["mask", "(480, 640)"]),
    ],
)
def test_bad_input_is_named(layup, change, words):
    given = {
        "reference": layup.reference,
        "ply_outline": layup.ply_outline,
        "mold_from_scanner": layup.mold_from_scanner,
        **change,
    }
    if isinstance(given["reference"], str):
        given["reference"] = layup.reference / 1000
    with pytest.raises(InputError) as caught:
        Inspector(None, **given)
    for word in words:
        assert word.lower() in str(caught.value).lower()


@pytest.mark.parametrize(
    "scan", [np.zeros((3, 3)), np.full((8, 8, 3), np.nan), np.zeros((0, 3)), np.ones((5, 5, 3), dtype=int)]
)
def test_a_bad_scan_is_named(inspector, scan):
    with pytest.raises(InputError, match="scan"):
        inspector.inspect(scan)


def test_a_bad_deadline_is_named(layup, inspector):
    with pytest.raises(InputError, match="deadline_s"):
        inspector.inspect(layup.scan, deadline_s=0)
