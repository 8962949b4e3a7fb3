"""How an inspection ends when it should: scans that show too little, deadlines that cut, errors of a single pocket."""

import re
import threading
import time

import numpy as np
import pytest

from debulk import Inspector, Recipe, Verdict, _core, scenes
from debulk.inspection.evaluate import evaluation
from debulk.inspection.minima import starts
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.inspection.running.cycle import Cycle, in_parallel
from debulk.solve import minimise_with

HANG_S = 60  # of this process's own time; each of these scans took minutes once


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=0, pixels=(640, 480))


def make(layup, **recipe):
    recipe = Recipe(**{"segmentation": {"area_tol_mm2": 3000.0}, **recipe})
    return Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


@pytest.fixture(scope="module")
def inspector(layup):
    return make(layup, solve={"when": "always"})


# --- scans that show too little ---


def cut(scan):
    short = scan.copy()
    short[200:] = np.nan
    return short


def shuffled(scan):
    return np.random.default_rng(5).permutation(scan.reshape(-1, 3)).reshape(scan.shape)


SPOILED = {
    "cut": (cut, "of the ply was seen, .* cut off"),
    "shuffled": (shuffled, "too coarse: .* apart, .* with its rows and columns in order"),
    "centimetres": (lambda scan: 0.1 * scan, "unit|centimetres"),
    "centimetres, no image": (lambda scan: 0.1 * scan.reshape(-1, 3), "unit|centimetres"),
}


@pytest.mark.parametrize("name", SPOILED)
def test_a_scan_that_shows_far_too_little_is_invalid_at_once(layup, inspector, name):
    spoil, word = SPOILED[name]
    scan = spoil(layup.scan)
    began = time.process_time()
    report = inspector.inspect(scan)
    assert time.process_time() - began < HANG_S
    assert report.verdict is Verdict.INVALID
    assert report.coverage is None or report.coverage < 0.5
    assert not report.pockets
    assert re.search(word, report.reason)


def test_points_in_any_order_are_no_mistake_where_they_are_passed_as_points(layup, inspector):
    points = np.random.default_rng(6).permutation(layup.scan.reshape(-1, 3))
    report = inspector.inspect(points)
    assert report.coverage > 0.98
    # The general way grids the scan otherwise: at the ply's edge the minima, which decide there, may be others.
    pairs = list(zip(own(report), own(inspector.inspect(layup.scan)), strict=True))
    assert all({a.verdict, b.verdict} != {Verdict.CEASE, Verdict.CREASE} for a, b in pairs)
    # Of points in no order flying ones may pass for a bump, here on a fibre that goes over a pocket, too.
    assert sum(a.verdict is not b.verdict for a, b in pairs if a.excess and b.excess) <= 1


def own(report):
    return [p for p in report.pockets if not p.promoted]


def test_half_of_the_ply_is_invalid_too_with_what_was_found_in_it(layup, inspector):
    scan = layup.scan.copy()
    scan[340:] = np.nan
    report = inspector.inspect(scan)
    assert report.verdict is Verdict.INVALID
    assert 0.5 < report.coverage < 0.98
    assert report.pockets


# --- deadlines ---

# By the paper's criterion every pocket needs its minima.
CLOSE = {
    "solve": {"starts": 2, "most_starts": 5, "close_ridge_mm": 2.0, "close_rms_mm": 0.3},
    "verdict": {"criterion": "paper"},
}


@pytest.fixture(scope="module")
def close(layup):
    """Further starts for nearly every pocket, so that there is something to cut."""
    return make(layup, **CLOSE, run={"threads": 1})


def test_what_a_deadline_cut_is_undecided_and_nothing_else_changes(layup, close, monkeypatch):
    found = close.find(layup.scan).pockets
    whole = [evaluation.evaluate(one, close.ply, Cycle().stop).report for one in found]
    assert {p.verdict for p in whole} > {Verdict.CREASE}
    undecided = 0
    for calls in (1, 2, 3, 4):
        for one, uncut in zip(found, whole, strict=True):
            cycle, seen = Cycle(), []

            def counted(*args, cycle=cycle, seen=seen, calls=calls, **kwargs):
                solution = minimise_with(*args, **kwargs)
                seen.append(solution)
                if len(seen) == calls:
                    cycle.stop.set_deadline(0.0)
                return solution

            monkeypatch.setattr(starts.solve, "minimise_with", counted)
            late = evaluation.evaluate(one, close.ply, cycle.stop)
            if late.report.verdict is not uncut.verdict or late.report.solve.starts < uncut.solve.starts:
                assert late.report.verdict is Verdict.UNDECIDED
                assert "deadline" in late.report.reason
                assert "some seeded starts" in [entry.what for entry in late.left_out]
                undecided += 1
            else:
                assert late.report.reason == uncut.reason
    assert undecided > 0


# --- errors of a single pocket ---


def planted(monkeypatch, where, error):
    """Let the second pocket of a scan fail at one step."""
    number = 2
    if where == "lay":
        whole = evaluation.lay_pocket

        def lay(found, *rest):
            if found.number == number:
                raise error
            return whole(found, *rest)

        monkeypatch.setattr(evaluation, "lay_pocket", lay)
    else:
        whole = evaluation.lay_pocket

        def lay(found, *rest):
            laid = whole(found, *rest)
            if found.number == number:

                def fail(*_args, **_kwargs):
                    raise error

                object.__setattr__(laid, where, fail)
            return laid

        monkeypatch.setattr(evaluation, "lay_pocket", lay)


@pytest.fixture(scope="module")
def before(layup, inspector):
    """What the inspection says without an error."""
    assert len(inspector.find(layup.scan).pockets) > 2
    return inspector.inspect(layup.scan)


@pytest.mark.parametrize("where", ["lay", "post_process", "judge"])
@pytest.mark.parametrize("error", [RuntimeError("planted\nhere"), MemoryError(), KeyError("a"), AssertionError()])
def test_an_error_costs_one_pockets_verdict_and_not_the_report(
    layup, inspector, before, monkeypatch, tmp_path, where, error
):
    assert hasattr(LaidPocket, where) or where == "lay"
    planted(monkeypatch, where, error)
    report = inspector.inspect(layup.scan)
    assert [p.id for p in report.pockets] == [p.id for p in before.pockets]
    broken = report.pockets[1]
    assert broken.verdict is Verdict.INVALID
    assert f"an unexpected error, {type(error).__name__}" in broken.reason
    assert "\n" not in broken.reason
    assert report.verdict is Verdict.INVALID
    for one, same in zip(report.pockets, before.pockets, strict=True):
        if one.id != 2:
            assert (one.verdict, one.reason, one.rms_mm) == (same.verdict, same.reason, same.rms_mm)
    report.save(tmp_path / "report.json")
    report.save(tmp_path / "report.html")


# --- what is searched beside the front end ---


@pytest.mark.parametrize("threads", [1, 2])
def test_work_beside_gives_its_result_and_ends_before_the_body_is_left(threads):
    stop, done = _core.Stop(), []
    with in_parallel(stop, lambda: done.append(threading.current_thread()) or "found", threads) as result:
        assert result() == "found"
    assert [thread is threading.main_thread() for thread in done] == [False]


def test_an_error_of_the_body_ends_the_work_beside_it():
    stop, began, ended = _core.Stop(), threading.Event(), []

    def work():
        began.set()
        while not stop.now():
            time.sleep(0.001)
        ended.append(True)

    with pytest.raises(KeyboardInterrupt), in_parallel(stop, work, 2):
        began.wait()
        raise KeyboardInterrupt
    assert ended
    assert stop.cancelled


def test_an_error_of_the_search_in_the_raw_scan_is_no_verdict(layup, inspector, monkeypatch):
    monkeypatch.setattr(inspector._narrow, "find", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        inspector.inspect(layup.scan)
