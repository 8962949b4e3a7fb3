"""Whose memory an inspection works on: copies of everything but the scan, and a scan that changes meanwhile."""

import contextlib
import itertools
import threading

import numpy as np
import pytest

from debulk import Grid, InputError, Inspector, Recipe, _core, scenes
from debulk.inspection import inspector
from debulk.inspection.clouds import cleaning
from debulk.inspection.reference import prepared

FEW = {"segmentation": {"area_tol_mm2": 3000.0}, "solve": {"starts": 1, "most_starts": 1}}


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=4, pixels=(320, 240))


def make(layup):
    return Inspector(Recipe(**FEW), layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


def test_what_its_owner_changes_later_changes_neither_inspector_nor_report(layup):
    outline, pose, reference = (np.array(a) for a in (layup.ply_outline, layup.mold_from_scanner, layup.reference))
    angles, mask = np.array([0.0, 90.0]), np.zeros(reference.shape[:2], dtype=bool)
    camera = np.array(layup.camera, dtype=np.float64)
    inspector = Inspector(Recipe(**FEW), reference, outline, angles, pose, camera, mask)
    scan = layup.scan.copy()
    report = inspector.inspect(scan)
    before = report.to_dict()
    for array in (outline, pose, reference, angles, camera, scan):
        array[:] = 7.0
    mask[:] = True
    after = inspector.inspect(layup.scan).to_dict()
    for timed in (before, after):
        timed["timings_ms"] = {}
        timed["trace"].pop("time_utc")
        for pocket in timed["pockets"]:
            pocket.pop("runtime_ms"), pocket.pop("runtime_split_ms")
    assert after == before
    assert np.array_equal(report.ply_outline_mm, layup.ply_outline)


def test_what_a_report_hands_out_cannot_change_the_inspector(layup):
    report = make(layup).inspect(layup.scan)
    with pytest.raises(ValueError, match="read-only"):
        report.ply_outline_mm[0] = 0.0


def test_a_map_of_angles_is_copied_too(layup):
    ny, nx = 60, 80
    values = np.tile(np.array([0.0, 90.0]), (ny, nx, 1))
    grid = Grid(values, np.array([-400.0, -300.0]), 20.0)
    inspector = Inspector(Recipe(**FEW), layup.reference, None, grid, layup.mold_from_scanner)
    values[:] = np.nan
    assert np.isfinite(inspector.fibre_angles_deg.values).all()


def test_a_reference_that_nobody_can_write_into_is_neither_copied_nor_changed(layup):
    frozen, mask = layup.reference.copy(), np.zeros(layup.reference.shape[:2], dtype=bool)
    frozen.setflags(write=False)
    assert cleaning.owned(frozen, "reference", _core.Stop()) is frozen
    assert cleaning.owned(frozen[1:], "reference", _core.Stop()).base is None  # the owner of a view's memory may write
    mask[:40] = True
    for hidden in (None, mask):
        of_copy, of_frozen = (
            Inspector(Recipe(**FEW), one, mold_from_scanner=layup.mold_from_scanner, mask=hidden).prepared
            for one in (layup.reference, frozen)
        )
        assert of_copy.cloud == of_frozen.cloud
        np.testing.assert_array_equal(of_copy.seen.values, of_frozen.seen.values)
        np.testing.assert_array_equal(of_copy.reference.heights_mm, of_frozen.reference.heights_mm)
    np.testing.assert_array_equal(frozen, layup.reference)


class Scribbler:
    """A scanner that writes whatever comes into the memory of the scan, block after block, until the body ends."""

    def __init__(self, scan, original):
        self._scan, self._original = scan, original
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._write)
        self.blocks = 0

    def _write(self):
        random = np.random.default_rng(11)
        flat, source = self._scan.reshape(-1, 3), self._original.reshape(-1, 3)
        for value in itertools.cycle([np.nan, np.inf, -np.inf, 1e30, -1e30, 0.0, None, 3e38, 500.0, None]):
            if self._end.is_set():
                return
            first = int(random.integers(len(flat)))
            block = slice(first, first + int(random.integers(1, len(flat) // 4)))
            flat[block] = source[block] if value is None else value
            self.blocks += 1

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()


@pytest.mark.parametrize("shape", ["image", "points"])
def test_a_scan_that_changes_while_it_is_searched_crashes_nothing(layup, shape):
    inspector = make(layup)
    clean = layup.scan if shape == "image" else layup.scan.reshape(-1, 3)
    scan = clean.copy()
    right = [p.pocket.area_mm2 for p in inspector.find(clean).pockets]
    outcomes = set()
    with Scribbler(scan, clean) as scribbler:
        for _ in range(100):
            try:
                outcomes.add(len(inspector.find(scan).pockets))
            except InputError:
                outcomes.add("refused")
    assert scribbler.blocks > 0
    assert outcomes
    assert [p.pocket.area_mm2 for p in inspector.find(clean).pockets] == right  # nothing of it stays


def test_reports_of_a_scan_that_changes_are_whole(layup):
    inspector = make(layup)
    scan = layup.scan.copy()
    with Scribbler(scan, layup.scan):
        for _ in range(10):
            try:
                report = inspector.inspect(scan, deadline_s=20)
            except InputError:
                continue
            report.to_dict()


def test_a_reference_and_a_debulked_scan_that_change_crash_nothing(layup):
    inspector = make(layup)
    report = inspector.inspect(layup.scan)
    debulked = layup.debulked().scan

    def prepare_again():
        Inspector(None, changing, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)

    changing, changing_debulked = layup.reference.copy(), debulked.copy()
    with Scribbler(changing, layup.reference), Scribbler(changing_debulked, debulked):
        for _ in range(15):
            for call in (lambda: inspector.compare(report, changing_debulked), prepare_again):
                with contextlib.suppress(InputError):
                    call()


def test_a_comparison_reads_the_callers_memory_once(monkeypatch):
    layup = scenes.layup(seed=0, pixels=(640, 480))
    of_ply = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    report = of_ply.inspect(layup.scan)
    given = np.array(layup.debulked().scan)
    expected = of_ply.compare(report, given).table()

    def clean_while_the_scanner_writes(*arguments):
        given[:] = 0
        return prepared.cleaned(*arguments)

    monkeypatch.setattr(inspector, "cleaned", clean_while_the_scanner_writes)
    assert of_ply.compare(report, given).table() == expected
