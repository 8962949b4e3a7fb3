"""The excess length decides inside the ply, before anything is solved; the minima's figures stand beside it."""

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
    return [p for p in report.pockets if p.excess is not None and not p.promoted]


def test_every_pocket_inside_the_ply_is_judged_by_its_excess(report):
    assert len(inside(report)) >= 3
    for p in inside(report):
        assert (p.net.kinds != 2).all()
        assert p.decided_by == "excess"
        assert p.verdict is p.excess.verdict or (p.verdict is Verdict.CREASE and p.bridge_height_mm > 0.6)
        assert f"{p.excess.range_mm[0]:.2f}" in p.reason
        assert p.solve.starts == 1
        assert p.paper_verdict is not None


def test_the_ridge_is_the_formulas_of_the_extrapolated_excess(report):
    for p in inside(report):
        e = p.excess
        assert e.length_mm == pytest.approx(e.at_half_mm + (e.at_half_mm - e.at_spacing_mm) / 3 - e.noise_bias_mm)
        offs = -e.uncertainty_mm, 0, e.uncertainty_mm + e.missed_mm
        clamped = [h if h > 0.3 / 1.2 else 0.0 for h in (e.length_mm / 2 + (2 - np.pi / 2) * 0.3 + off for off in offs)]
        assert (e.range_mm[0], e.height_mm, e.range_mm[1]) == pytest.approx(tuple(clamped))
        # Every minimum keeps the excess: the net's, at its own spacing.
        assert p.excess_length_mm == pytest.approx(e.at_spacing_mm, abs=0.02)


def test_the_paper_criterion_decides_as_its_figures_say(layup, report):
    paper = inspect(layup, verdict={"criterion": "paper"})
    assert all(p.decided_by in ("paper", "") and p.verdict is p.paper_verdict for p in paper.pockets)
    both = ([p for p in r.pockets if not p.promoted] for r in (paper, report))  # the RMS promotes other bumps, too
    for p, q in zip(*both, strict=True):
        assert p.excess == q.excess  # shown all the same
        if p.excess is None:
            slipping = q.edge_friction.slipping if q.edge_friction else q  # the ply's edge
            assert (p.verdict, p.reason) == (slipping.verdict, slipping.reason)


def test_a_solve_that_is_not_needed_is_left_out_and_turns_no_verdict(layup, report):
    needed = inspect(layup, solve={"when": "needed"})
    assert [(p.verdict, p.reason) for p in needed.pockets] == [(p.verdict, p.reason) for p in report.pockets]
    unsolved = [p for p in needed.pockets if p.solve is None]
    assert unsolved
    for p in unsolved:
        assert p.decided_by == "excess"
        assert p.debulked_mm is None
        assert p.paper_verdict is None
        assert any(f"pocket {p.id}," in entry.what and p.reason in entry.bound for entry in needed.left_out)


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
            assert abs(p.excess.height_mm - q.excess.height_mm) <= p.excess.uncertainty_mm + q.excess.uncertainty_mm


def test_a_net_far_too_coarse_neither_folds_back_nor_passes():
    """The first fibre of its largest pocket, 99 mm a segment, ran round beyond the foot and back over the pocket."""
    coarse = scenes.layup(110, (1280, 960))
    report = Inspector(
        Recipe(net={"node_target": 25}),
        coarse.reference,
        coarse.ply_outline,
        mold_from_scanner=coarse.mold_from_scanner,
    ).inspect(coarse.scan)
    largest = report.pockets[0]
    assert largest.spacing_mm > 50
    xy = largest.net.nodes_mm[:, :2]
    apart = np.linalg.norm(xy[:, None] - xy, axis=-1) + np.diag(np.full(len(xy), np.inf))
    assert apart.min() > largest.spacing_mm / 2
    assert largest.verdict is not Verdict.CEASE
    assert largest.excess.at_spacing_mm == pytest.approx(largest.excess.at_half_mm, rel=0.2)


def test_an_unknown_criterion_is_named():
    with pytest.raises(InputError, match="criterion"):
        Recipe(verdict={"criterion": "rms"})
