"""An archive inspected again: nothing is lost and nothing done twice, whatever is killed."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
from debulk.batch import layups, run
from debulk.batch.worker import inspected
from debulk.build import build_id
from debulk.cli import app
from debulk.history import History

PLIES = 5
PROGRAM = "from debulk.cli import main; main()"


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """Return a folder with five scans of one mold; what they share lies above them."""
    folder = tmp_path_factory.mktemp("archive")
    layup = debulk.scenes.layup(1, (448, 336))
    np.save(folder / "reference.npy", layup.reference)
    np.savetxt(folder / "pose.txt", layup.mold_from_scanner, fmt="%.17g")
    np.savetxt(folder / "outline.csv", layup.ply_outline, delimiter=",", fmt="%.17g")
    for ply in range(PLIES):
        (own := folder / f"ply{ply}").mkdir()
        np.save(own / "scan.npy", debulk.scenes.layup(1, (448, 336), repeat=ply).scan)
        (own / "layup.toml").write_text(
            'scan = "scan.npy"\nreference = "../reference.npy"\npose = "../pose.txt"\noutline = "../outline.csv"\n'
            f'[context]\npart = "A-17"\nply = {ply}\n'
        )
    return folder


def plies(history):
    return sorted(row.ply for row in History(history).find())


def begun(history):
    """Whether a record is there: a file that another process is just making is none yet."""
    with suppress(debulk.InputError):
        return bool(plies(history))
    return False


def test_every_layup_is_in_the_history_once_though_a_worker_and_the_client_are_killed(archive, tmp_path):
    history = tmp_path / "killed.sqlite"
    command = [sys.executable, "-c", PROGRAM, "batch", archive, "--history", history, "--workers", "2"]
    with subprocess.Popen(list(map(str, command)), start_new_session=True, stdout=subprocess.DEVNULL) as client:
        began = time.monotonic()
        while client.poll() is None and not begun(history) and time.monotonic() - began < 120:
            time.sleep(0.05)
        os.killpg(client.pid, signal.SIGKILL)
    before = plies(history)
    assert 1 <= len(before) < PLIES

    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        killed = []

        def kill(batch):
            if not killed:
                killed.append(cluster.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        batch = run(layups(archive), debulk.Recipe(), history, cluster.scheduler_address, progress=kill)
    assert killed and not batch.wrong
    assert (batch.done, batch.verdicts.total()) == (len(before), PLIES - len(before))
    assert plies(history) == [str(ply) for ply in range(PLIES)]
    assert History(history).check().passed
    assert run(layups(archive), debulk.Recipe(), history).done == PLIES


def test_a_layup_that_cannot_be_read_is_named_and_the_others_are_inspected(archive, tmp_path):
    wrong = tmp_path / "archive"
    for name, scan in (("good", archive / "ply0" / "scan.npy"), ("bad", archive / "none.npy")):
        (wrong / name).mkdir(parents=True)
        (wrong / name / "layup.toml").write_text(
            f'scan = "{scan}"\nreference = "{archive / "reference.npy"}"\npose = "{archive / "pose.txt"}"\n'
        )
    done = CliRunner().invoke(app, ["batch", str(wrong), "--history", str(tmp_path / "h.sqlite"), "--workers", "1"])
    assert done.exit_code == 1, done.output
    assert "no report: bad" in done.stdout and "none.npy" in done.stdout
    assert [row.part for row in History(tmp_path / "h.sqlite").find()] == ["good"]


def test_what_a_sensor_saw_of_a_ply_is_inspected_with_it(archive, tmp_path):
    seen = [f"{x},{y},5,95" for x in range(-800, 801, 80) for y in range(-800, 801, 80)]
    (archive / "angles.csv").write_text("\n".join(seen))
    (tmp_path / "layup.toml").write_text('scan = "s"\nreference = "r"')
    (layup,) = layups(tmp_path)
    files = {"scan": "ply0/scan.npy", "reference": "reference.npy", "pose": "pose.txt", "measured_angles": "angles.csv"}
    turned = layup.model_copy(update={name: archive / file for name, file in files.items()})
    text, wrong = inspected(turned, debulk.Recipe().model_dump(), build_id())
    assert not wrong and "5.0 degrees counter-clockwise from nominal" in text.decode()


def test_a_pose_may_have_another_unit_than_the_clouds(archive, tmp_path):
    pose = np.loadtxt(archive / "pose.txt")
    pose[:3, 3] /= 1000
    np.savetxt(tmp_path / "pose.txt", pose, fmt="%.17g")
    said = 'scan = "{0}/ply0/scan.npy"\nreference = "{0}/reference.npy"\npose = "pose.txt"\nframe_unit = "m"'
    (tmp_path / "layup.toml").write_text(said.format(archive))
    (layup,) = layups(tmp_path)
    known = layup.model_copy(update={"pose": archive / "pose.txt", "frame_unit": None})
    (text, wrong), (same, _) = (inspected(one, debulk.Recipe().model_dump(), build_id()) for one in (layup, known))
    pockets = [[(p["verdict"], p["area_mm2"]) for p in json.loads(one)["pockets"]] for one in (text, same)]
    assert not wrong and pockets[0] and pockets[0] == pockets[1]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('reference = "r.npy"', "scan: Field required"),
        ('scan = "s.npy"\nreference = "r.npy"\nfoo = 1', "foo: Extra inputs"),
        ("scan =", "layup.toml: not valid TOML"),
        ("scan = " + "[" * 100_000, "layup.toml: not a layup: nested too deeply"),
        ('scan = "s.npy"\nreference = "r.npy"\ncontext = 3', "context"),
    ],
    ids=["no scan", "unknown name", "broken", "deep", "no table"],
)
def test_a_wrong_description_is_named(tmp_path, text, says):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "layup.toml").write_text(text)
    with pytest.raises(debulk.InputError, match=says):
        layups(tmp_path)


def test_wrong_descriptions_are_all_named_at_once(tmp_path):
    for name in ("a", "b", "c"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "layup.toml").write_text('scan = "s"\nreference = "r"' if name == "b" else "scan =")
    done = CliRunner().invoke(app, ["batch", str(tmp_path), "--history", str(tmp_path / "h.sqlite")])
    assert (done.exit_code, done.stderr.count("layup.toml"), done.stderr.count("\n")) == (2, 2, 1), done.stderr


def test_an_archive_without_layups_or_with_one_twice_is_refused(tmp_path):
    with pytest.raises(debulk.InputError, match="found none"):
        layups(tmp_path)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "layup.toml").write_text('scan = "s"\nreference = "r"\ncontext = {part = "A", ply = 1}')
    with pytest.raises(debulk.InputError, match="both are ply '1' of part 'A'"):
        layups(tmp_path)
