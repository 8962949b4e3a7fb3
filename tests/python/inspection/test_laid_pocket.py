"""One evaluation for the inspector and the study: the same net, the same figures, the same verdict."""

from dataclasses import replace

import pytest

from debulk import Inspector, Recipe, Verdict, scenes, solve
from debulk.inspection.minima.laid_pocket import REFUSED, lay_pocket
from lab.study.cases import Case

FEW = {
    "segmentation": {"area_tol_mm2": 3000.0},
    "solve": {"starts": 1, "most_starts": 1},
    "verdict": {"criterion": "paper"},
}


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=4, pixels=(320, 240))


@pytest.fixture(scope="module")
def inspector(layup):
    return Inspector(Recipe(**FEW), layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


@pytest.fixture(scope="module")
def report(layup, inspector):
    return inspector.inspect(layup.scan)


@pytest.fixture(scope="module")
def laid(layup, inspector):
    return [lay_pocket(found, inspector.ply) for found in inspector.find(layup.scan).pockets]


def own(report):
    """Return the pockets without the bumps that are judged in spite of the tolerances."""
    return [p for p in report.pockets if not p.promoted]


def test_what_is_found_is_what_is_reported(layup, inspector, report):
    found = inspector.find(layup.scan)
    areas = [one.pocket.area_mm2 for one in found.pockets]
    assert areas == sorted(areas, reverse=True)
    assert [one.number for one in found.pockets] == [p.id for p in own(report)]
    for one, p in zip(found.pockets, own(report), strict=True):
        assert one.pocket.outline_mm.tobytes() == p.outline_mm.tobytes()
        assert one.foot.outline_mm.tobytes() == p.foot_outline_mm.tobytes()
        assert one.foot.id == one.pocket.id
    assert found.overview.values.tobytes() == report.height_map.values.tobytes()
    assert set(found.times_ms) <= set(report.timings_ms)


def test_the_energy_gain_is_the_fall_from_the_net_as_laid(laid, report):
    for one, p in zip(laid, own(report), strict=True):
        start = one.sheet.energy(p.net.nodes_mm)
        assert p.solve.energy_gain_mj == pytest.approx(start - p.energy_mj, rel=1e-12)
        assert p.solve.energy_gain_mj > 0
        # All but the vacuum's work is small: what falls is about the pressure times the volume that closes.
        assert p.solve.energy_gain_mj == pytest.approx(0.1 * p.volume_mm3, rel=0.5)


def test_a_certified_minimum_has_no_negative_curvature_to_report(report):
    certified = [p.solve for p in report.pockets if p.solve.certified]
    assert certified
    assert all(-1e-5 <= s.curvature <= 0 for s in certified)  # in units of the certificate, see SolveReport


def test_study_and_inspector_give_one_verdict(laid, report):
    for one, p in zip(laid, own(report), strict=True):
        solution = solve.minimise(one.sheet, seed=0)
        case = Case(4, p.id, 100, one, 0.0)
        figures = case.figures(solution)
        assert case.judge(solution, figures, [figures]) is p.verdict
        assert figures.rms_mm == p.rms_mm
        assert one.judge(solution, [figures]).reason == p.reason


@pytest.mark.parametrize("status", REFUSED)
def test_a_refused_solve_is_invalid_in_both(laid, status):
    solution = replace(solve.minimise(laid[0].sheet), status=status, certified=False, explanation="why not")
    figures = laid[0].post_process(solution)
    judged = laid[0].judge(solution, [figures])
    assert judged.verdict is Verdict.INVALID
    assert "why not" in judged.reason
    assert Case(4, 1, 100, laid[0], 0.0).judge(solution, figures, [figures]) is Verdict.INVALID


def test_other_limits_may_be_tried(laid, report):
    rough = max(range(len(laid)), key=lambda k: report.pockets[k].rms_mm)
    solution = solve.minimise(laid[rough].sheet)
    figures = laid[rough].post_process(solution)
    assert figures.rms_mm > 0.27
    for max_rms_mm, verdict in ((figures.rms_mm - 0.011, Verdict.CREASE), (figures.rms_mm + 0.011, Verdict.CEASE)):
        recipe = Recipe(verdict={"max_rms_mm": max_rms_mm, "max_ridge_mm": 9.0, "criterion": "paper"})
        assert replace(laid[rough], recipe=recipe).judge(solution, [figures]).verdict is verdict
