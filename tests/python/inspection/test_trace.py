"""A report says what it was made of, to the byte."""

import hashlib
import re
from datetime import UTC, datetime

import numpy as np
import pytest
import xxhash

import debulk
from debulk.inspection.clouds import fingerprint


@pytest.fixture(scope="module")
def layup():
    return debulk.scenes.layup(seed=3, pixels=(640, 480))


def made(layup, **given):
    given = {"ply_outline": layup.ply_outline, "mold_from_scanner": layup.mold_from_scanner} | given
    return debulk.Inspector(given.pop("recipe", None), layup.reference, **given)


def sha256(array):
    return hashlib.sha256(np.ascontiguousarray(array, "<f4").tobytes()).hexdigest()


def test_all_that_went_in_is_named(layup, tmp_path):
    mask = np.zeros((480, 640), bool)
    mask[:4] = True
    inspector = made(layup, fibre_angles_deg=(30, 120), mask=mask, camera=layup.camera)
    before = datetime.now(UTC)
    scan = layup.scan.astype(np.float64)
    report = inspector.inspect(scan, deadline_s=60.0, context={"part": "A-17", "ply": np.int64(3), "limits": (1, 2.5)})
    report.save(tmp_path / "r.json")
    trace = debulk.Report.load(tmp_path / "r.json").trace
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", trace.time_utc)
    assert abs((datetime.fromisoformat(trace.time_utc) - before).total_seconds()) < 5
    assert (trace.scan.shape, trace.scan.sha256) == ((480, 640, 3), None)
    assert trace.scan.xxh3 == xxhash.xxh3_128_hexdigest(layup.scan.astype("<f4").tobytes())
    assert (trace.reference.shape, trace.reference.sha256) == ((480, 640, 3), None)
    assert trace.reference.xxh3 == xxhash.xxh3_128_hexdigest(layup.reference.astype("<f4").tobytes())
    assert trace.mask.sha256 == hashlib.sha256(mask.tobytes()).hexdigest()
    assert trace.fibre_angles_deg.tolist() == [30, 120]
    assert (trace.mold_from_scanner == layup.mold_from_scanner).all()
    assert trace.camera.tolist() == trace.fitted_camera.tolist() == list(layup.camera)
    assert trace.deadline_s == 60
    assert trace.context == {"part": "A-17", "ply": 3, "limits": [1, 2.5]}
    assert trace.versions["debulk"] == debulk.__version__
    assert trace.versions["numpy"] == np.__version__
    assert {"compiler", "Python"} <= set(trace.versions)
    assert "-ffp-contract=off" in trace.versions["compiler options"]
    assert {"name", "system", "instructions", "threads used"} <= set(trace.host)


@pytest.mark.parametrize("deadline_s", [True, np.float32(1e-9), np.array(1e-9), 1, float("inf")])
def test_a_deadline_of_any_kind_comes_back(layup, tmp_path, deadline_s):
    made(layup).inspect(layup.scan, deadline_s=deadline_s).save(tmp_path / "r.json")
    kept = debulk.Report.load(tmp_path / "r.json").trace.deadline_s
    assert type(kept) is float
    assert kept == deadline_s


def test_a_map_of_angles_keeps_its_bits(layup, tmp_path):
    values = np.full((2, 2, 2), [0.1 + 0.2, 90.0])
    values[1, 1] = np.nan
    report = made(layup, fibre_angles_deg=debulk.Grid(values, np.array([0.0, 0.0]), 1000.0)).inspect(layup.scan)
    report.save(tmp_path / "r.json")
    kept = debulk.Report.load(tmp_path / "r.json").trace
    assert kept.fibre_angles_deg is None
    assert kept.fibre_angles_map.values.tobytes() == values.tobytes()


@pytest.mark.parametrize("wanted", ["xxh3", "sha256", False])
def test_a_saved_inspector_knows_its_reference(layup, tmp_path, wanted):
    inspector = made(layup, recipe=debulk.Recipe(run={"hash_scan": wanted}))
    inspector.save(tmp_path / "i.npz")
    assert debulk.Inspector.load(tmp_path / "i.npz").prepared.cloud == inspector.prepared.cloud


@pytest.mark.parametrize(
    ("wanted", "has_sha256", "has_xxh3"),
    [("xxh3", False, True), ("sha256", True, False), (True, True, False), (False, False, False)],
)
def test_the_recipe_says_which_hash_of_the_clouds_is_kept(layup, wanted, has_sha256, has_xxh3):
    report = made(layup, recipe=debulk.Recipe(run={"hash_scan": wanted})).inspect(layup.scan)
    clouds = {"scan": layup.scan, "reference": layup.reference}
    for name, cloud in clouds.items():
        kept = getattr(report.trace, name)
        assert kept.shape == (480, 640, 3)
        assert kept.sha256 == (sha256(cloud) if has_sha256 else None)
        assert (kept.xxh3 is not None) == has_xxh3
    again = debulk.repeat(report, layup.scan, layup.reference)
    assert again.same, again.differences
    assert set(again.unchecked) == (set() if wanted else {"scan", "reference"})
    for name, cloud in clouds.items() if wanted else ():
        changed = cloud.copy()
        changed[240, 320, 2] += 0.5
        with pytest.raises(debulk.InputError, match=f"{name}: expected the inspection's"):
            debulk.repeat(report, **{**clouds, name: changed})


def test_a_hash_ends_with_the_inspection():
    stop = debulk._core.Stop()
    stop.cancel()
    assert fingerprint.of_cloud(np.zeros((5, 3)), stop).sha256 is None


@pytest.mark.parametrize(
    ("context", "part"),
    [
        ("A-17", "context: expected a dictionary of names and values, but got 'A-17'"),
        ({3: "x"}, "context: expected names that are text, but got 3"),
        ({"a": {"b": float("nan")}}, "context.a.b: expected text, a finite number"),
        ({"a": [1, object()]}, "context.a[1]: expected text, a finite number"),
        ({"a": np.zeros(3)}, "context.a: expected text"),
    ],
)
def test_a_context_that_cannot_be_kept_is_refused_before_the_work(layup, context, part):
    with pytest.raises(debulk.InputError) as caught:
        made(layup).inspect(layup.scan, context=context)
    assert part in str(caught.value)


def test_the_caller_may_change_the_context_later(layup):
    context = {"plies": [1]}
    report = made(layup).inspect(layup.scan, context=context)
    context["plies"].append(2)
    assert report.trace.context == {"plies": [1]}


def test_stages_are_logged_and_an_inspector_is_shown_in_a_line(layup, caplog):
    inspector = made(layup)
    with caplog.at_level("DEBUG", logger="debulk"):
        report = inspector.inspect(layup.scan)
    logged = [r.getMessage() for r in caplog.records if r.levelname == "DEBUG"]
    for stage in ("level", "height map", "debulk"):
        assert any(re.fullmatch(rf"{stage}: \d+\.\d ms", line) for line in logged), (stage, logged)
    assert {"level", "debulk"} <= set(report.timings_ms)
    assert re.fullmatch(r"Inspector\(outline of \d+ corners, heights every [\d.]+ mm, Recipe\(\)\)", repr(inspector))
