"""A stack lays a ply only on one that passed after debulking, and its page shows what each ply lies on."""

import dataclasses
import threading
import time

import numpy as np
import pytest

import debulk
from debulk import Cancelled, InputError, Recipe, Stack, Verdict
from debulk.comparison import Comparison
from debulk.page.stack import Layup, page, references
from debulk.report import Report
from debulk.results.comparison import Standing
from debulk.results.trace import ArrayTrace, Trace
from debulk.stack import StackPly
from html_reader import read

pytestmark = pytest.mark.layup
RECIPE = Recipe(solve={"when": "needed"})


@pytest.fixture(scope="module")
def virtual():
    # Its mold, raised, is a flat ply after debulking. Of points 2 mm apart more noise and holes would leave that open.
    return debulk.scenes.layup(seed=0, pixels=(640, 480), noise_mm=0.02, dropout_share=0.0)


def raised(cloud, layup, height_mm, seed):
    """Return a cloud with every point on the ply higher, and with noise of its own."""
    pose = layup.mold_from_scanner
    noise = np.random.default_rng(seed).normal(0, 0.03, cloud.shape[:2])
    on = debulk.pocket.inside(layup.ply_outline, (cloud @ pose[:3, :3].T + pose[:3, 3])[..., :2].reshape(-1, 2))
    return (cloud + (height_mm * on.reshape(noise.shape) + noise)[..., None] * pose[2, :3]).astype(np.float32)


def text_of(path):
    return " ".join(" ".join(read(path.read_text(encoding="utf-8")).text).split())


def test_a_ply_of_a_stack_has_angles_of_a_sensor_and_its_nominal_ones(virtual):
    measured = debulk.Grid(np.full((21, 21, 2), (5.0, 95.0)), (-800.0, -800.0), 80.0)
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    inspector = stack.lay(virtual.ply_outline, measured, nominal_angles_deg=(0.0, 90.0))
    assert inspector.nominal_angles_deg is not None
    (turned,) = [one for one in stack.inspect(virtual.scan).findings if one.check == "fibre_angles"]
    with Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner) as ahead:
        ahead.lay_ahead(virtual.ply_outline, measured, nominal_angles_deg=(0.0, 90.0))
        (again,) = [one for one in ahead.inspect(virtual.scan).findings if one.check == "fibre_angles"]
    assert again == turned and turned.at_best is Verdict.INVALID
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    stack.lay(virtual.ply_outline)
    seen = stack.inspect(virtual.scan, fibre_angles_deg=measured)  # by a sensor that looks at each ply as it is scanned
    assert turned.reason in [one.reason for one in seen.findings if one.check == "fibre_angles"]
    assert not [one for one in stack.inspect(virtual.scan).findings if one.check == "fibre_angles"]


def test_a_stack_carries_the_reference_from_ply_to_ply(virtual, tmp_path):
    stack = Stack(RECIPE, virtual.reference, part="A-17", mold_from_scanner=virtual.mold_from_scanner)
    with pytest.raises(InputError, match="expected a ply to be laid first"):
        stack.inspect(virtual.scan)
    with pytest.raises(InputError, match="no ply of this stack was inspected"):
        stack.save(tmp_path / "stack.html")
    stack.lay(virtual.ply_outline)
    with pytest.raises(InputError, match="expected an inspection of ply 1 first"):
        stack.debulked(virtual.reference)
    with pytest.raises(InputError, match="cannot be laid: ply 1 was not inspected"):
        stack.lay(virtual.ply_outline)
    first = stack.inspect(virtual.scan)
    assert first.trace.context == {"part": "A-17", "ply": 1, "reference": "the bare mold"}

    creased = stack.debulked(virtual.debulked().scan)
    assert any(one.measured is Verdict.CREASE for one in creased.pockets)
    with pytest.raises(InputError, match="cannot be laid: ply 1 did not pass after debulking: pocket"):
        stack.lay(virtual.ply_outline)
    stack.save(tmp_path / "stack.html")
    assert "after debulking did not pass: pocket" in text_of(tmp_path / "stack.html")

    flat = raised(virtual.reference, virtual, 0.25, seed=1)
    assert all(one.measured is Verdict.CEASE for one in stack.debulked(flat).pockets)
    inspector = stack.lay(virtual.ply_outline)  # from the cloud as the comparison cleaned it
    afresh = debulk.Inspector(RECIPE, flat, virtual.ply_outline, mold_from_scanner=virtual.mold_from_scanner).prepared
    assert inspector.prepared.image == afresh.image and inspector.prepared.cloud == afresh.cloud
    for of in (lambda p: p.reference.heights_mm, lambda p: p.seen.values, lambda p: p.sample):
        assert of(inspector.prepared).tobytes() == of(afresh).tobytes()
    flat[:] = np.nan  # the stack keeps its own copy
    second = stack.inspect(raised(virtual.scan, virtual, 0.25, seed=2), context={"operator": "N. N."})
    assert second.trace.context["reference"] == "ply 1 after debulking, which passed"
    assert second.trace.context["operator"] == "N. N."
    assert second.trace.reference == inspector.prepared.cloud != first.trace.reference
    assert abs(second.level.laid_mm - 0.3) < 0.05
    stack.save(tmp_path / "stack.html")
    text = text_of(tmp_path / "stack.html")
    assert "reference ply 1 after debulking, which passed" in text
    assert "after debulking passed: every pocket ceased" in text
    assert "wrong reference" not in text


def test_a_ply_that_is_scanned_again_must_be_compared_again(virtual):
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    stack.lay(virtual.ply_outline)
    stack.inspect(virtual.scan)
    stack.debulked(raised(virtual.reference, virtual, 0.25, seed=1))
    assert stack.plies[-1].passed
    stack.inspect(virtual.scan)
    assert stack.plies[-1].open_reason == "ply 1 was not scanned after debulking"


def ply(number, reference, scan=None):
    trace = Trace(
        time_utc="2026-03-01T12:00:00.000Z",
        reference=ArrayTrace(shape=(9, 3), sha256=reference),
        scan=None if scan is None else ArrayTrace(shape=(9, 3), sha256=scan),
        context={"ply": number},
    )
    return Layup(Report(verdict=Verdict.CEASE, reason="", pockets=(), trace=trace), f"{number}.json")


def test_a_wrong_reference_shows_by_its_fingerprint():
    assert references([ply(1, "mold", "a"), ply(2, "b", "c"), ply(3, "d", "e")]) == ["", "", ""]
    assert references([ply(1, "mold", "a"), ply(1, "mold", "a2")]) == ["", ""]  # the same ply, scanned twice
    _, second = references([ply(1, "mold", "a"), ply(2, "mold", "c")])
    assert second == "it is that of ply 1, too: the ply between them is not in it"
    _, second = references([ply(1, "mold", "a"), ply(2, "a", "c")])
    assert second == "it is the scan of ply 1 before debulking, whose pockets it hides"
    bare = dataclasses.replace(ply(1, "mold").report, trace=None)
    assert references([Layup(bare, "old.json")]) == [""]


def test_a_ply_on_which_a_ridge_stands_beside_all_pockets_does_not_pass():
    done = Comparison(pockets=(), max_rms_mm=0.3, max_peak_mm=0.6)
    passed = StackPly(2, ply(2, "mold").report, done)
    assert passed.passed and done.headline != "1 ridge beside the pockets"
    ridge = Standing(place_mm=(120.0, 40.2), height_mm=0.852, length_mm=30.0)
    other = StackPly(2, passed.report, dataclasses.replace(done, standing=(ridge,)))
    assert other.open_reason == "ply 2 did not pass after debulking: a ridge of 0.85 mm at (120, 40) mm"
    assert not other.passed and other.comparison.headline == "1 ridge beside the pockets"
    shown = page([ply(1, "mold"), Layup(other.report, "2.json", comparison=other.comparison)])
    assert "did not pass: a ridge of 0.85 mm at (120, 40) mm" in shown


def of_verdict(report):
    """Return what an inspection decided and measured, without times."""
    return [(p.verdict, p.reason, p.area_mm2, p.peak_mm, p.deciding_ridge) for p in report.pockets], report.findings


def test_a_ply_laid_ahead_is_the_ply_laid(virtual):
    seen, angles = [], np.array([0.0, 90.0])
    laid, ahead = (Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner) for _ in range(2))
    inspector = laid.lay(virtual.ply_outline, angles)
    assert ahead.lay_ahead(virtual.ply_outline, angles) is None
    angles[:] = 45.0, 135.0  # the stack keeps its own copy
    assert ahead.plies == []
    with pytest.raises(InputError, match="ply 1 was laid ahead, and not inspected yet"):
        ahead.lay(virtual.ply_outline)
    with pytest.raises(InputError, match="ply 1 was laid ahead, and not inspected yet"):
        ahead.debulked(virtual.scan)
    found = ahead.inspect(virtual.scan, progress=lambda name, done: seen.append((name, done)))
    assert of_verdict(found) == of_verdict(laid.inspect(virtual.scan))
    assert len(ahead.plies) == 1
    assert seen[0][0].startswith(("reference", "preparing"))
    shares = [done for _, done in seen]
    assert shares == sorted(shares)
    assert np.array_equal(ahead._inspector.reference.heights_mm, inspector.reference.heights_mm)


def test_what_was_laid_ahead_wrongly_can_be_laid_again(virtual):
    with Stack(RECIPE, virtual.reference[:1], mold_from_scanner=virtual.mold_from_scanner) as stack:
        with pytest.raises(InputError, match="ply_outline"):
            stack.lay_ahead([[0, 0], [1, 1]])  # what is wrong with the arguments is said at once
        for _ in range(2):
            stack.lay_ahead(virtual.ply_outline)
            for _ in range(2):
                with pytest.raises(InputError, match="reference: expected"):
                    stack.inspect(virtual.scan)
            assert stack.plies == []


def test_the_deadline_counts_the_wait_and_the_preparation_goes_on(virtual):
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    stack.lay_ahead(virtual.ply_outline)
    with pytest.raises(InputError, match="deadline_s: expected a positive number"):
        stack.inspect(virtual.scan, deadline_s=-1.0)
    with pytest.raises(TimeoutError, match="the inspector was being prepared"):
        stack.inspect(virtual.scan, deadline_s=1e-6)
    assert stack.inspect(virtual.scan, deadline_s=600.0).verdict is Verdict.CREASE


def threads_ahead():
    return [thread for thread in threading.enumerate() if thread.name.startswith("debulk")]


def test_a_scan_of_a_ply_that_was_not_laid_never_meets_the_ply_before(virtual):
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    stack.lay(virtual.ply_outline)
    stack.inspect(virtual.scan)
    stack.debulked(raised(virtual.reference, virtual, 0.25, seed=1))
    stack.lay_ahead(virtual.ply_outline)
    with pytest.raises(InputError, match="debulked: ply 2 was laid ahead"):
        stack.debulked(virtual.reference)
    stack.cancel()
    for _ in range(2):
        with pytest.raises(Cancelled):
            stack.inspect(virtual.scan)
    assert len(stack.plies) == 1
    stack.lay_ahead(virtual.ply_outline)
    assert stack.inspect(raised(virtual.scan, virtual, 0.25, seed=2)).trace.context["ply"] == 2


def test_cancel_and_an_exception_leave_no_thread(virtual):
    stack = Stack(RECIPE, virtual.reference, mold_from_scanner=virtual.mold_from_scanner)
    stack.lay_ahead(virtual.ply_outline)
    assert threads_ahead()
    stack.cancel()
    assert not threads_ahead()
    stack.lay_ahead(virtual.ply_outline)
    while threads_ahead():
        time.sleep(0.01)
    stack.cancel()  # what is there already is given up, too
    with pytest.raises(Cancelled):
        stack.inspect(virtual.scan)
    stack.lay_ahead(virtual.ply_outline)
    waiting = threading.Timer(0.02, stack.cancel)
    waiting.start()
    with pytest.raises(Cancelled, match="the preparation was cancelled"):
        stack.inspect(virtual.scan)
    waiting.join()
    with pytest.raises(ZeroDivisionError), stack:
        stack.lay_ahead(virtual.ply_outline)
        raise ZeroDivisionError
    assert not threads_ahead()
    stack.lay(virtual.ply_outline)
    assert len(stack.plies) == 1
