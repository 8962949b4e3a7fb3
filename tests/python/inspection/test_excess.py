"""The excess length decides inside the ply, before anything is solved; the minima's figures stand beside it."""

import dataclasses
import pickle

import numpy as np
import pytest

from debulk import InputError, Inspector, Recipe, Report, Verdict, scenes

FEW = {"segmentation": {"area_tol_mm2": 1500.0}}


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=112, pixels=(640, 480))


def inspect(layup, **changes):
    recipe = Recipe(**FEW).model_copy(update=changes)
    return Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner).inspect(
        layup.scan
    )


@pytest.fixture(scope="module")
def report(layup):
    return inspect(layup)


def inside(report):
    """Pockets inside the ply; not the bumps below the tolerances that are judged too, for what is doubtful in them."""
    return [p for p in report.pockets if p.excess is not None and (p.net.kinds != 2).all() and not p.promoted]


def test_every_pocket_inside_the_ply_is_judged_by_its_excess(report):
    assert len(inside(report)) >= 3
    for p in inside(report):
        assert p.decided_by == ("" if "if one fold draws it all" in p.reason else "excess")
        assert p.verdict is p.excess.verdict or (p.verdict is Verdict.CREASE and p.bridge_height_mm > 0.6)
        assert f"{p.excess.range_mm[1]:.2f}" in p.reason
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


def test_the_paper_criterion_decides_as_its_figures_say(layup, report):
    paper = inspect(layup, verdict={"criterion": "paper"})
    assert all(p.decided_by in ("paper", "") and p.verdict is p.paper_verdict for p in paper.pockets)
    both = ([p for p in r.pockets if not p.promoted] for r in (paper, report))  # the RMS promotes other bumps, too
    for p, q in zip(*both, strict=True):
        assert p.excess == q.excess  # shown all the same
        if p.excess is None:
            slipping = q.edge_friction.slipping if q.edge_friction else q  # the ply's edge
            assert (p.verdict, p.reason) == (slipping.verdict, slipping.reason)


@pytest.fixture(scope="module")
def needed(layup):
    return inspect(layup, solve={"when": "needed"})


def test_nets_and_solves_that_are_not_needed_are_left_out_and_turn_no_verdict(report, needed):
    assert [(p.verdict, p.reason) for p in needed.pockets] == [(p.verdict, p.reason) for p in report.pockets]
    unsolved = [p for p in needed.pockets if p.solve is None]
    assert unsolved
    for p in unsolved:
        assert p.decided_by == "excess"
        assert p.debulked_mm is None
        assert p.paper_verdict is None
        assert any(f"pocket {p.id}," in entry.what and p.reason in entry.bound for entry in needed.left_out)
    unlaid = [(p, q) for p, q in zip(report.pockets, needed.pockets, strict=True) if q.net is None and p.net]
    assert any(q.verdict is Verdict.CEASE for _, q in unlaid)
    assert any(q.verdict is Verdict.CREASE for _, q in unlaid)
    for p, q in unlaid:
        # No string over the mold below a pocket stands higher than this, whatever net is laid there.
        assert q.excess.bridge_bound_mm >= p.excess.bridge_bound_mm
        assert dataclasses.replace(q.excess, bridge_bound_mm=p.excess.bridge_bound_mm) == p.excess


def content(report):
    """All but the times and the recipe."""
    tree = report.to_dict()
    pockets = [{k: v for k, v in p.items() if not k.startswith("runtime")} for p in tree["pockets"]]
    return pockets, {k: v for k, v in tree.items() if k not in ("timings_ms", "recipe", "trace", "pockets")}


def test_a_settled_report_has_the_bits_of_one_that_was_solved_at_once(report, needed, tmp_path):
    assert content(needed) != content(report)
    assert content(needed.settle()) == content(report)
    assert content(needed.changed(source={"part": "A-17"}).settle())[0] == content(report)[0]
    assert report.settle() is report
    needed.save(tmp_path / "r.json")
    again = Report.load(tmp_path / "r.json")
    assert again.settle() is again
    assert again.to_dict() == pickle.loads(pickle.dumps(needed)).to_dict() == needed.to_dict()
    needed.save(tmp_path / "settled.html")
    again.save(tmp_path / "loaded.html")
    assert "RMS" in (tmp_path / "settled.html").read_text()


def test_reports_keep_and_show_both(report, tmp_path):
    for kind in ("json", "csv", "html"):
        report.save(tmp_path / f"r.{kind}")
    again = Report.load(tmp_path / "r.json")
    assert [(p.decided_by, p.paper_verdict, p.excess) for p in again.pockets] == [
        (p.decided_by, p.paper_verdict, p.excess) for p in report.pockets
    ]
    first = inside(report)[0]
    assert f"{first.excess.height_mm:.2f} ± {first.excess.uncertainty_mm:.3f}" in (tmp_path / "r.html").read_text()
    assert repr(first.excess.height_mm) in (tmp_path / "r.csv").read_text()
    assert f"{first.excess.height_mm:.2f}" in report.table()


def test_another_scan_of_the_ply_moves_the_ridge_within_its_uncertainty(layup, report):
    noise = np.random.default_rng(3).normal(0.0, 0.05, layup.scan.shape[:2]).astype(np.float32)
    scan = layup.scan.copy()
    scan[..., 2] += noise
    other = Inspector(
        Recipe(**FEW), layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
    ).inspect(scan)
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


def test_an_unknown_criterion_is_named():
    with pytest.raises(InputError, match="criterion"):
        Recipe(verdict={"criterion": "rms"})
