"""The excess length decides inside the ply, before anything is solved; the minima's figures stand beside it."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from debulk import InputError, Inspector, Recipe, Report, Verdict, scenes
from debulk.inspection.evaluate import evaluation
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.report import PocketReport
from debulk.verdict import criteria_of

FEW = {"segmentation": {"area_tol_mm2": 1500.0}}


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=112, pixels=(640, 480))


@pytest.fixture(scope="module")
def prepared(layup):
    return Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner).prepared


def inspector_of(layup, prepared, **changes):
    recipe = Recipe(**FEW).model_copy(update=changes)
    return Inspector(recipe, prepared, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


@pytest.fixture(scope="module")
def inspect(layup, prepared):
    return lambda **changes: inspector_of(layup, prepared, **changes).inspect(layup.scan)


@pytest.fixture(scope="module")
def report(inspect):
    """All nets and minima made within the inspection."""
    return inspect(solve={"when": "always"})


def inside(report):
    """Pockets inside the ply; not the bumps below the tolerances that are judged too, for what is doubtful in them."""
    return [p for p in report.pockets if p.excess is not None and (p.net.kinds != 2).all() and not p.promoted]


def test_every_pocket_inside_the_ply_is_judged_by_its_excess(report):
    assert len(inside(report)) >= 3
    for p in inside(report):
        assert p.decided_by == ("" if "if one fold draws it all" in p.reason else "excess")
        assert p.verdict is p.excess.verdict or (p.bridge_section and p.bridge_section.range_mm[1] > 0.55)
        assert (f"{p.excess.range_mm[1]:.2f}" if p.excess.range_mm[1] else "no ridge") in p.reason
        assert p.solve.starts == 1
        assert p.paper_verdict is not None


def formula_mm(excess_mm):
    """The ridge by the paper's formula, 0 within the consolidated ply of 0.25 mm."""
    ridge_mm = excess_mm / 2 + (2 - np.pi / 2) * 0.3
    return ridge_mm if ridge_mm > 0.3 / 1.2 else 0.0


def test_the_ridge_is_the_formulas_of_the_longest_run(report):
    for p in inside(report):
        e = p.excess
        assert e.height_mm == pytest.approx(formula_mm(e.length_mm), abs=1e-6)
        assert e.range_mm[0] <= e.height_mm <= e.alone_mm <= e.range_mm[1]
        assert e.range_mm[1] == pytest.approx(formula_mm(e.length_mm + 2 * (e.uncertainty_mm + e.missed_mm)), abs=1e-6)
        # Every minimum keeps the excess of the coarse net, whose chords miss a share of it.
        assert p.excess_length_mm == pytest.approx(e.length_mm, rel=0.3, abs=0.05)
        away = [np.linalg.norm(p.foot_outline_mm - end, axis=1).min() for end in (e.from_mm, e.to_mm)]
        assert max(away) < 25.0  # the line leaves the mold near the foot's outline
        assert min(abs(e.direction_deg - angle) for angle in (0.0, 90.0, 180.0)) < 1e-6


def test_the_paper_criterion_decides_as_its_figures_say(inspect, report):
    paper = inspect(verdict={"criterion": "paper"})
    assert all(p.decided_by in ("paper", "") and p.verdict is p.paper_verdict for p in paper.pockets)
    both = ([p for p in r.pockets if not p.promoted] for r in (paper, report))  # the RMS promotes other bumps, too
    for p, q in zip(*both, strict=True):
        assert p.excess == q.excess  # shown all the same
        if p.excess is None:
            slipping = q.edge_friction.slipping if q.edge_friction else q  # the ply's edge
            assert (p.verdict, p.reason) == (slipping.verdict, slipping.reason)


@pytest.fixture(scope="module")
def needed(inspect):
    """No net and no minimum made that the verdict does not need: the default."""
    return inspect()


def test_nets_and_solves_that_are_not_needed_are_left_out_and_turn_no_verdict(report, needed):
    decided = needed.as_decided()
    assert [(p.verdict, p.reason) for p in needed.pockets] == [(p.verdict, p.reason) for p in report.pockets]
    unsolved = [p for p in decided.pockets if p.solve is None]
    assert [p.id for p in unsolved] == [p.id for p in needed.pockets if p.unsolved] != []
    (entry,) = [entry for entry in needed.left_out if entry.why.startswith("solve.when")]
    assert entry.what.endswith(f"of pockets {', '.join(str(p.id) for p in unsolved)}")
    for p in unsolved:
        assert p.excess is not None
        assert p.debulked_mm is None
        assert p.paper_verdict is None
    unlaid = [(p, q) for p, q in zip(report.pockets, decided.pockets, strict=True) if q.net is None and p.net]
    assert any(q.verdict is Verdict.CEASE for _, q in unlaid)
    assert any(q.verdict is Verdict.CREASE for _, q in unlaid)
    for p, q in unlaid:
        assert (q.excess, q.bridge_section) == (p.excess, p.bridge_section)


def content(report):
    """All but the times and the recipe."""
    tree = report.to_dict()
    pockets = [{k: v for k, v in p.items() if not k.startswith("runtime")} for p in tree["pockets"]]
    return pockets, {k: v for k, v in tree.items() if k not in ("timings_ms", "recipe", "trace", "pockets")}


def test_a_settled_report_has_the_bits_of_one_that_was_solved_at_once(report, needed, tmp_path):
    decided = needed.as_decided()
    assert decided.settle() is decided
    assert content(decided) != content(report)
    assert content(needed.settle()) == content(needed) == content(report)
    assert content(needed.changed(source={"part": "A-17"}).settle())[0] == content(report)[0]
    assert report.settle() is report
    needed.save(tmp_path / "r.json")
    again = Report.load(tmp_path / "r.json")
    assert again.settle() is again
    assert again.to_dict() == needed.to_dict()
    decided.save(tmp_path / "decided.json")
    copy = pickle.loads(pickle.dumps(needed))
    assert Report.load(tmp_path / "decided.json").to_dict() == copy.to_dict() == decided.to_dict()
    assert type(copy.pockets[0]) is PocketReport
    needed.save(tmp_path / "settled.html")
    decided.save(tmp_path / "decided.html")
    assert "RMS" in (tmp_path / "settled.html").read_text()


def test_reading_a_figure_makes_that_pocket_and_nothing_else(layup, prepared, report, monkeypatch):
    made = []

    evaluate = evaluation.evaluate

    def counted(found, *given, **more):
        made.append(found.number)
        return evaluate(found, *given, **more)

    inspector = inspector_of(layup, prepared)
    first = inspector.inspect(layup.scan)
    inspector.inspect(layup.scan[::-1].copy()[::-1] + np.float32(0.01))  # the inspector's buffers hold another scan
    monkeypatch.setattr(evaluation, "evaluate", counted)
    worst = next(p for p in first.pockets if p.unsolved)
    before = repr(worst), worst.deciding_ridge, worst.excess, worst.runtime_ms
    with ThreadPoolExecutor(8) as pool:
        nets = list(pool.map(lambda _: worst.net, range(8)))
    assert made == [worst.id]
    assert all(net is nets[0] for net in nets)
    whole = report.pocket(worst.id)
    assert nets[0].nodes_mm.tobytes() == whole.net.nodes_mm.tobytes()
    assert worst.debulked_mm.tobytes() == whole.debulked_mm.tobytes()
    assert (worst.rms_mm, worst.ridge_range_mm, worst.solve) == (whole.rms_mm, whole.ridge_range_mm, whole.solve)
    assert (repr(worst), worst.deciding_ridge, worst.excess, worst.runtime_ms) == before
    assert made == [worst.id]
    first.settle()
    assert sorted(made) == [p.id for p in first.pockets if p.unsolved]  # none a second time


def test_an_audited_pocket_is_evaluated_both_ways(inspect, report, needed):
    audited = inspect(run={"audit": 1.0})
    assert not any(p.unsolved for p in audited.pockets)
    assert audited.later is None
    assert content(audited) == content(report)
    half, again = ({p.id for p in inspect(run={"audit": 0.5}).pockets if not p.unsolved} for _ in range(2))
    assert {p.id for p in needed.pockets if not p.unsolved} < half < {p.id for p in report.pockets}
    assert half == again


def test_a_net_that_contradicts_the_lines_lets_nothing_pass(inspect, needed, monkeypatch):
    """No scene is known in which one does: here every minimum is said to bridge."""
    real = LaidPocket.post_process
    monkeypatch.setattr(
        LaidPocket, "post_process", lambda laid, minimum: replace(real(laid, minimum), bridge_height_mm=9.0)
    )
    report = inspect(run={"audit": 1.0})
    passing = [p.id for p in needed.pockets if p.verdict is Verdict.CEASE and p.decided_by == "excess"]
    found = {one.pocket: one for one in report.findings if one.check == "audit"}
    assert sorted(found) == passing != []
    assert all(one.at_best is Verdict.UNDECIDED and "bridges 9.00 mm" in one.reason for one in found.values())
    assert [p.verdict for p in report.pockets] == [p.verdict for p in needed.pockets]
    assert not [one for one in inspect().settle().findings if one.check == "audit"]


def test_reports_keep_and_show_both(report, tmp_path):
    for kind in ("json", "csv", "html"):
        report.save(tmp_path / f"r.{kind}")
    again = Report.load(tmp_path / "r.json")
    assert [(p.decided_by, p.paper_verdict, p.excess) for p in again.pockets] == [
        (p.decided_by, p.paper_verdict, p.excess) for p in report.pockets
    ]
    first = max(inside(report), key=lambda p: p.excess.height_mm)
    assert f"{first.excess.height_mm:.2f} ± {first.excess.uncertainty_mm:.3f}" in (tmp_path / "r.html").read_text()
    assert repr(first.excess.height_mm) in (tmp_path / "r.csv").read_text()
    assert f"{first.excess.height_mm:.2f}" in report.table()


def test_another_scan_of_the_ply_moves_the_ridge_within_its_uncertainty(layup, prepared, report):
    noise = np.random.default_rng(3).normal(0.0, 0.05, layup.scan.shape[:2]).astype(np.float32)
    scan = layup.scan.copy()
    scan[..., 2] += noise
    other = inspector_of(layup, prepared).inspect(scan)
    for p, q in zip(report.pockets, other.pockets, strict=True):
        if p.excess is not None and q.excess is not None:
            assert q.excess.range_mm[0] <= p.excess.height_mm <= q.excess.range_mm[1]
            if (
                p.excess.missed_mm < 0.1
            ):  # else it is so narrow for the heights that the estimate makes the noise up, too
                # A ridge is half as high as it is long.
                allowed_mm = 2 * (p.excess.uncertainty_mm + q.excess.uncertainty_mm)
                assert abs(p.excess.length_mm - q.excess.length_mm) <= allowed_mm


def test_a_net_far_too_coarse_does_not_fold_back_and_its_pocket_has_the_same_excess():
    """The first fibre of its largest pocket, 99 mm a segment, ran round beyond the foot and back over the pocket."""
    layup = scenes.layup(110, (1280, 960))

    def largest(**recipe):
        given = (layup.reference, layup.ply_outline)
        one = Inspector(Recipe(**recipe), *given, mold_from_scanner=layup.mold_from_scanner)
        return one.inspect(layup.scan).pockets[0]

    coarse, usual = largest(net={"node_target": 25}), largest()
    assert coarse.spacing_mm > 50
    xy = coarse.net.nodes_mm[:, :2]
    apart = np.linalg.norm(xy[:, None] - xy, axis=-1) + np.diag(np.full(len(xy), np.inf))
    assert apart.min() > coarse.spacing_mm / 2
    assert (coarse.excess.length_mm, coarse.excess.range_mm) == (usual.excess.length_mm, usual.excess.range_mm)


def test_clouds_with_their_columns_in_reverse_are_judged_alike(layup, needed):
    """No pinhole camera has such an image; the points are the same."""
    scan, reference = (np.ascontiguousarray(cloud[:, ::-1]) for cloud in (layup.scan, layup.reference))
    inspector = Inspector(Recipe(**FEW), reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert inspector.prepared.image is None
    report = inspector.inspect(scan)
    assert [p.verdict for p in report.pockets] == [p.verdict for p in needed.pockets]
    pairs = [(p.excess, q.excess) for p, q in zip(report.pockets, needed.pockets, strict=True) if p.excess]
    assert len(pairs) >= 3
    ridges, others = np.transpose([[one.height_mm for one in pair] for pair in pairs])
    assert ridges == pytest.approx(others, abs=0.1)


@pytest.mark.parametrize(("high_mm", "expected"), [(3.4, Verdict.UNDECIDED), (6.0, Verdict.CREASE)])
def test_without_an_outline_a_ply_lifted_at_its_edge_is_no_crease_by_the_cliff_that_it_ends_in(high_mm, expected):
    """The fibres that are held, along the edge, make ridges of 0.42 and 1.05 mm; across it the map falls off."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(0, 200.0), np.arange(0, 160.0))
    on = (x > 40) & (x < 160) & (y > 30) & (y < 130)
    bell = high_mm * np.maximum(0, 1 - ((x - 41) ** 2 + (y - 80) ** 2) / 24**2) ** 2
    reference, scan = (np.stack([x, y, z + rng.normal(0, 0.02, x.shape)], axis=-1) for z in (0 * x, on * (0.3 + bell)))
    report = Inspector(None, reference).inspect(scan)
    assert report.verdict is expected
    assert ("give the ply's outline" in report.reason) == (expected is Verdict.UNDECIDED)
    assert report.pockets[0].excess.range_mm[1] > 0.6


def test_an_unknown_criterion_is_named():
    with pytest.raises(InputError, match="criterion"):
        Recipe(verdict={"criterion": "rms"})


def test_the_limits_of_a_recipe_are_compiled_once():
    recipe = Recipe(verdict={"max_ridge_mm": 0.7})
    assert criteria_of(recipe) is criteria_of(recipe) is not criteria_of(recipe, "paper")
    assert criteria_of(Recipe()).max_ridge_height_mm == 0.6 != criteria_of(recipe).max_ridge_height_mm
