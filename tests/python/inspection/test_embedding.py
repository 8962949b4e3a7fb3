"""An inspector inside somebody's cell: threads, Ctrl-C, deadlines, logging, files, many cycles."""

import copy
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from debulk import Cancelled, Grid, InputError, Inspector, Recipe, Verdict, _core, cloud, scenes

FEW = {"segmentation": {"area_tol_mm2": 3000.0}, "solve": {"starts": 1}}  # the seven largest pockets, one start
ENDLESS = Recipe(segmentation={"area_tol_mm2": 3000.0}, solve={"starts": 1000})
LONG_S = 60.0  # what would hang is stopped here


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=4, pixels=(320, 240))


def make(layup, recipe, **more):
    return Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, **more)


@pytest.fixture(scope="module")
def inspector(layup):
    return make(layup, Recipe(**FEW))


@pytest.fixture(scope="module")
def report(inspector, layup):
    return inspector.inspect(layup.scan)


def bits(report):
    """Everything that the inspection computed."""
    pockets = [
        (
            (p.verdict, p.reason, p.outline_mm.tobytes(), p.energy_mj),
            None if p.net is None else (p.net.nodes_mm.tobytes(), p.debulked_mm.tobytes()),
        )
        for p in report.pockets
    ]
    assert sum(net is not None for _, net in pockets) >= 5
    return report.verdict, report.coverage, report.height_map.values.tobytes(), pockets


# --- several threads ---


def test_one_inspector_in_several_threads_gives_equal_bits(inspector, layup, report):
    assert len(report.pockets) >= 5
    with ThreadPoolExecutor(4) as pool:
        reports = list(pool.map(inspector.inspect, [layup.scan] * 8))
    for other in reports:
        assert bits(other) == bits(report)


def test_inspectors_side_by_side_do_not_mix(inspector, layup, report):
    other_layup = scenes.layup(seed=5, pixels=(320, 240))
    other = make(other_layup, Recipe(**FEW))
    alone = bits(other.inspect(other_layup.scan))
    with ThreadPoolExecutor(2) as pool:
        one, two = pool.submit(inspector.inspect, layup.scan), pool.submit(other.inspect, other_layup.scan)
        assert bits(one.result()) == bits(report)
        assert bits(two.result()) == alone


def test_the_scan_is_left_as_it_was(inspector, layup):
    before = layup.scan.copy()
    inspector.inspect(layup.scan)
    assert np.array_equal(before, layup.scan, equal_nan=True)


def test_other_threads_run_while_the_core_solves(layup):
    """Were the GIL held, nobody could raise the stop, and the thousand starts would go on."""
    from debulk.doctor import _pocket_sheet
    from debulk.solve import minimise

    stop, began = _core.Stop(), threading.Event()

    def raise_it():
        began.wait(LONG_S)
        stop.cancel()

    helper = threading.Thread(target=raise_it)
    helper.start()
    began.set()
    found = minimise(_pocket_sheet(), starts=1000, stop=stop)
    helper.join()
    assert len(found.minima) < 1000
    assert not stop.past_deadline


def test_other_threads_run_while_the_core_cleans():
    points = np.random.default_rng(0).normal(size=(400_000, 3)).astype(np.float32) * 100
    stop = _core.Stop()
    helper = threading.Timer(0.02, stop.cancel)
    helper.start()
    with pytest.raises(_core.Stopped):
        for _ in range(1000):
            cloud.remove_outliers(points, stop=stop)
    helper.join()


# --- to stop ---


def test_cancel_from_another_thread(layup):
    inspector = make(layup, ENDLESS)
    before = threading.active_count()
    solving = threading.Event()

    def progress(stage, _done):
        if stage == "debulk":
            solving.set()

    def stop():
        solving.wait(LONG_S)
        time.sleep(0.05)
        inspector.cancel()

    helper = threading.Thread(target=stop)
    helper.start()
    with pytest.raises(Cancelled):
        inspector.inspect(layup.scan, progress=progress)
    helper.join()
    assert threading.active_count() == before


def test_cancel_with_nothing_running_does_not_stop_the_next(inspector, layup, report):
    inspector.cancel()
    assert bits(inspector.inspect(layup.scan)) == bits(report)


def test_cancel_stops_every_thread_that_inspects(layup):
    inspector = make(layup, ENDLESS)
    solving = threading.Barrier(4, timeout=LONG_S)
    passed = threading.local()

    def progress(stage, _done):
        if stage == "debulk" and not hasattr(passed, "barrier"):
            passed.barrier = True
            solving.wait()

    def one(_):
        with pytest.raises(Cancelled):
            inspector.inspect(layup.scan, progress=progress)

    with ThreadPoolExecutor(3) as pool:
        runs = [pool.submit(one, k) for k in range(3)]
        solving.wait()
        inspector.cancel()
        for run in runs:
            run.result(LONG_S)


@pytest.mark.usefixtures("ctrl_c")
@pytest.mark.parametrize("stage", ["height map", "debulk"])
def test_ctrl_c_ends_the_inspection(layup, stage):
    inspector = make(layup, ENDLESS)
    before = threading.active_count()

    def progress(now, _done):
        if now == stage and not helpers:
            helpers.append(threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)))
            helpers[0].start()

    helpers: list[threading.Timer] = []
    with pytest.raises(KeyboardInterrupt):
        inspector.inspect(layup.scan, progress=progress)
    helpers[0].join()
    assert threading.active_count() == before
    assert inspector.inspect(layup.scan, deadline_s=0.5).verdict is not Verdict.CEASE  # usable again


def test_an_error_in_progress_ends_the_inspection(layup):
    inspector = make(layup, ENDLESS)
    before = threading.active_count()

    def progress(stage, done):
        if stage == "debulk":
            raise ZeroDivisionError("in the caller's code")

    with pytest.raises(ZeroDivisionError):
        inspector.inspect(layup.scan, progress=progress)
    assert threading.active_count() == before


@pytest.mark.parametrize("deadline_s", [1e-6, 0.05, 0.5])
def test_deadlines_are_kept_and_never_pass(layup, deadline_s):
    inspector = make(layup, ENDLESS)
    began = time.perf_counter()
    report = inspector.inspect(layup.scan, deadline_s=deadline_s)
    assert time.perf_counter() - began < LONG_S
    assert report.verdict is not Verdict.CEASE
    json.dumps(report.to_dict(), allow_nan=False)  # whole, and can be saved


# --- quiet ---


def test_silent_by_default_and_loud_when_asked():
    script = (
        "import sys, logging, debulk\n"
        "if len(sys.argv) > 1: logging.basicConfig(level=logging.INFO)\n"
        "l = debulk.scenes.layup(seed=4, pixels=(160, 120))\n"
        "r = debulk.Recipe(segmentation={'area_tol_mm2': 8000.0}, solve={'starts': 1})\n"
        "debulk.inspect(l.scan, l.reference, r, l.ply_outline, mold_from_scanner=l.mold_from_scanner)\n"
    )
    quiet = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert (quiet.stdout, quiet.stderr) == ("", "")
    loud = subprocess.run([sys.executable, "-c", script, "loud"], capture_output=True, text=True, check=True)
    assert "debulk" in loud.stderr


# --- prepared once, kept in a file ---


@pytest.fixture(scope="module")
def saved(inspector, tmp_path_factory):
    path = tmp_path_factory.mktemp("cell") / "cell.npz"
    inspector.save(path)
    return path


def test_a_loaded_inspector_gives_equal_bits(saved, layup, report, inspector):
    loaded = Inspector.load(saved)
    assert loaded.recipe == inspector.recipe
    assert bits(loaded.inspect(layup.scan)) == bits(report)


def test_everything_that_was_given_is_kept(layup, tmp_path):
    mask = np.zeros(layup.scan.shape[:2], dtype=bool)
    mask[100:120, 50:90] = True
    angles = Grid(np.full((4, 5, 2), (30.0, 120.0)), np.array([-800.0, -600.0]), 500.0)
    given = make(layup, Recipe(**FEW), fibre_angles_deg=angles, camera=layup.camera, mask=mask)
    given.save(tmp_path / "cell.npz")
    loaded = Inspector.load(tmp_path / "cell.npz")
    assert np.array_equal(loaded.mask, mask)
    assert np.array_equal(loaded.camera, given.camera)
    assert np.array_equal(loaded.mold_from_scanner, given.mold_from_scanner)
    assert np.array_equal(loaded.fibre_angles_deg.values, angles.values)
    assert bits(loaded.inspect(layup.scan)) == bits(given.inspect(layup.scan))


def test_nothing_that_was_not_given_is_made_up(layup, tmp_path):
    pose = layup.mold_from_scanner
    in_mold = (layup.reference @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)  # an image at the origin needs a pose
    bare = Inspector(Recipe(**FEW), in_mold)
    bare.save(tmp_path / "cell.npz")
    loaded = Inspector.load(tmp_path / "cell.npz")
    assert loaded.ply_outline is loaded.mold_from_scanner is loaded.camera is loaded.mask is None


def test_another_recipe_may_be_used_if_it_cleans_alike(saved):
    other = Recipe(**{**FEW, "verdict": {"max_rms_mm": 0.28}})
    assert Inspector.load(saved, other).recipe is other
    with pytest.raises(InputError, match="clean"):
        Inspector.load(saved, Recipe(clean={"neighbours": 8}))


def test_an_inspector_says_how_it_gets_into_another_process(inspector, report):
    for take in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match=r"save\(\) it to a file, and load\(\) that in each process"):
            take(inspector)
    settled = report.settle()
    assert bits(pickle.loads(pickle.dumps(settled))) == bits(settled)


def test_two_inspectors_share_what_was_prepared(inspector, layup, report):
    turned = Inspector(inspector.recipe, inspector.prepared, inspector.ply_outline, (30, 120), layup.mold_from_scanner)
    alone = bits(turned.inspect(layup.scan))
    with ThreadPoolExecutor(4) as pool:
        runs = [pool.submit(one.inspect, layup.scan) for one in (inspector, turned, inspector, turned)]
        assert [bits(run.result()) for run in runs] == [bits(report), alone] * 2


def rewrite(source: Path, target: Path, **changes):
    with np.load(source) as archive:
        arrays = {name: archive[name] for name in archive.files}
    arrays.update(changes)
    np.savez(target, **{name: value for name, value in arrays.items() if value is not None})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "debulk inspector 9"}, "format"),
        ({"recipe": "{"}, "recipe"),
        ({"recipe": "[]"}, "recipe"),
        ({"recipe": '{"material": {"thickness_mm": -1}}'}, "thickness_mm"),
        ({"reference": None}, "reference is missing"),
        ({"reference": np.zeros(5)}, "reference is float64"),
        ({"reference": np.full((9, 9), np.nan)}, "finite"),
        ({"reference_grid": np.array([0.0, 0.0, -1.0])}, "spacing"),
        ({"seen_grid": np.array([0.0, np.nan, 1.0])}, "seen_grid"),
        ({"ply_outline": np.zeros((2, 2))}, "ply_outline"),
        ({"fibre_angles_deg": None}, "fibre_angles_deg"),
        ({"mask": np.zeros((4, 4))}, "mask is float64"),
        ({"reference": np.array([[{}]])}, "not a prepared inspector"),
    ],
)
def test_a_spoilt_file_is_named(saved, tmp_path, changes, words):
    bad = tmp_path / "bad.npz"
    rewrite(saved, bad, **changes)
    with pytest.raises(InputError, match=words) as caught:
        Inspector.load(bad)
    assert "bad.npz" in str(caught.value)


def test_files_that_are_none(saved, tmp_path, inspector):
    data = saved.read_bytes()
    for name, content in (("cut.npz", data[: len(data) // 2]), ("empty.npz", b""), ("text.npz", b"hello")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=name):
            Inspector.load(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("reference.npy", bytes(10_000_000))
    with pytest.raises(InputError, match="larger than the file"):
        Inspector.load(tmp_path / "bomb.npz")
    with pytest.raises(InputError, match="cannot be read"):
        Inspector.load(tmp_path / "none.npz")
    with pytest.raises(InputError, match=r"\.npz"):
        inspector.save(tmp_path / "cell.pkl")


# --- many cycles ---


def memory_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.slow
def test_many_cycles_with_flat_memory_and_equal_bits():
    small = scenes.layup(seed=4, pixels=(400, 300))
    inspector = make(small, Recipe(segmentation={"area_tol_mm2": 3000.0}, net={"node_target": 49}, solve={"starts": 1}))
    first = bits(inspector.inspect(small.scan))
    for _ in range(60):  # until the allocator has what it wants: 1.4 MB more in the next 190 cycles
        inspector.inspect(small.scan)
    before, threads = memory_mb(), threading.active_count()
    for _ in range(90):
        assert bits(inspector.inspect(small.scan)) == first
    assert memory_mb() - before < 90 * 0.0375  # no cycle may keep a map of its scan, nor the tenth of one
    assert threading.active_count() == threads
