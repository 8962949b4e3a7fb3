"""What a real machine does to a program: full disks, read-only folders, files that change, clocks that jump, SIGTERM.

The disks are real ones, a few megabytes of memory, mounted where only the program under test sees them.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import cloud_files
import debulk
from debulk import InputError, Report, files
from debulk.cli.support import EXIT_CODES
from debulk.history import History
from debulk.history.export import export

CALL = [sys.executable, "-c", "from debulk.cli import main; main()"]
KILOBYTES = 8000
CLOUD = np.arange(6000.0).reshape(-1, 3)

ENDINGS = {
    **{ending: Report.save for ending in (".json", ".csv", ".html")},
    **{ending: lambda _, path: files.save_cloud(path, CLOUD) for ending in (".npy", ".ply", ".xyz")},
    ".dfq": lambda _, path: export(History(path.with_name("cell.sqlite")), path),
}


def outputs(folder: Path, report: Report) -> dict[str, str]:
    """Write every kind of file in a folder; return what was said about those that could not be written."""
    said = {}
    for ending, save in ENDINGS.items():
        try:
            save(report, folder / f"a{ending}")
        except InputError as error:
            said[ending] = str(error)
    return said


def contents(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder; SQLite's own beside the history are not counted."""
    found = {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "filler"}
    return {name: data for name, data in found.items() if not name.endswith(("-wal", "-shm"))}


def full_disk(disk: Path) -> None:
    """Child: whatever is written onto a full disk leaves the old files as they were, and says why."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={KILOBYTES}k", "tmpfs", disk], check=True)
    report, history = Report.load(disk.with_name("report.json")), History(disk / "cell.sqlite")
    history.add(report)
    assert not (said := outputs(disk, report)), said
    before = contents(disk)
    with (disk / "filler").open("wb", buffering=0) as filler:
        try:
            while filler.write(bytes(1000)):
                pass
        except OSError:
            pass
    said = outputs(disk, report)
    assert said.keys() == ENDINGS.keys(), said
    assert all("No space left on device" in text and f"a{ending}" in text for ending, text in said.items()), said
    kept = history.keep(report)
    assert kept.verdict is report.verdict and "not in the history" in kept.warnings[-1], kept.warnings
    assert contents(disk) == before
    (disk / "filler").unlink()
    assert not (said := outputs(disk, report)), said
    assert history.keep(report) is report
    assert history.check().passed and len(history.find()) == 2


def read_only(disk: Path) -> None:
    """Child: a folder that cannot be written to can be read, and a verdict is not lost."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={KILOBYTES}k", "tmpfs", disk], check=True)
    report, history = Report.load(disk.with_name("report.json")), History(disk / "cell.sqlite")
    history.add(report)
    assert not (said := outputs(disk, report)), said
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    said = outputs(disk, report)
    assert said.keys() == ENDINGS.keys(), said
    assert all("Read-only file system" in text and f"a{ending}" in text for ending, text in said.items()), said
    assert Report.load(disk / "a.json").verdict is report.verdict
    assert files.load_cloud(disk / "a.npy").shape == (2000, 3)
    kept = history.keep(report)
    assert kept.verdict is report.verdict and "not in the history" in kept.warnings[-1], kept.warnings
    assert history.check().passed and history.report(1).verdict is report.verdict and len(history.find()) == 1


@pytest.mark.program
@pytest.mark.parametrize("child", [full_disk, read_only])
def test_a_disk_that_takes_nothing_costs_no_verdict_and_no_file(tmp_path, report, child):
    alone = ["unshare", "--mount"]
    if shutil.which("unshare") is None or subprocess.run([*alone, "true"], capture_output=True).returncode:
        pytest.skip("a disk is mounted here: that takes root and name spaces")
    report.save(tmp_path / "report.json")
    (tmp_path / "disk").mkdir()
    program = [*alone, sys.executable, __file__, child.__name__, str(tmp_path / "disk")]
    done = subprocess.run(program, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.program
@pytest.mark.parametrize("words", [["recipe"], ["--version"], ["--help"]])
def test_an_output_that_goes_onto_a_full_disk_is_no_verdict(words):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*CALL, *words], stdout=full, stderr=subprocess.PIPE, text=True, env=environment)
    assert done.returncode == 2 and "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr and "ignored" not in done.stderr, done.stderr


def changing(folder: Path) -> None:
    """Child: files that shrink, grow and change while they are read end in a cloud or an InputError."""
    points = np.random.default_rng(1).normal(0, 300, (60, 80, 3)).astype(np.float32)
    over = threading.Event()

    def scribble(path: Path, data: bytes) -> None:
        rng = np.random.default_rng(len(data))
        with path.open("r+b", buffering=0) as file:
            while not over.is_set():
                file.truncate(int(rng.integers(len(data))))
                file.seek(0)
                file.write(data)

    outcomes = set()
    for name, data, *_ in cloud_files.all_kinds(points):
        path = folder / name
        path.write_bytes(data)
        over.clear()
        thread = threading.Thread(target=scribble, args=(path, data))
        thread.start()
        until = time.monotonic() + 0.15
        try:
            while time.monotonic() < until:
                try:
                    outcomes.add(len(files.load_cloud(path)) > 0)
                except InputError as error:
                    outcomes.add(str(path) in str(error))
        finally:
            over.set()
            thread.join()
    assert outcomes == {True}


@pytest.mark.program
def test_a_file_that_changes_while_it_is_read_is_a_cloud_or_an_error(tmp_path):
    program = [sys.executable, "-W", "ignore", __file__, "changing", tmp_path]
    done = subprocess.run(program, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


# Every look at the clock finds it a day earlier or later than it was; what measures durations is left alone.
JUMPS = """
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static long jump(void) { static long n; return (n++ % 3 - 1) * 86400L; }
int clock_gettime(clockid_t id, struct timespec *t) {
  int status = (int)syscall(SYS_clock_gettime, id, t);
  if (id == CLOCK_REALTIME) t->tv_sec += jump();
  return status;
}
int gettimeofday(struct timeval *restrict t, void *restrict zone) {
  (void)zone;
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  t->tv_sec = now.tv_sec;
  t->tv_usec = now.tv_nsec / 1000;
  return 0;
}
time_t time(time_t *t) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return t ? (*t = now.tv_sec) : now.tv_sec;
}
"""


def jumping(folder: Path) -> None:
    """Child: an inspection with a deadline, kept in a history, while the clock jumps."""
    assert max(abs(np.diff([time.time() for _ in range(6)]))) > 80_000
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    history = History(folder / "cell.sqlite")
    inspector = debulk.Inspector(
        None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, history=history.path
    )
    for _ in range(3):
        print(inspector.inspect(layup.scan, deadline_s=60).reason)
    assert [row.record for row in history.find()] == [3, 2, 1] and history.check().passed


@pytest.mark.layup
@pytest.mark.skipif(shutil.which("cc") is None, reason="a C compiler makes the clock that jumps")
def test_a_clock_that_jumps_changes_no_verdict_and_no_order(tmp_path):
    (tmp_path / "jumps.c").write_text(JUMPS)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", tmp_path / "jumps.so", tmp_path / "jumps.c"], check=True)
    program = [sys.executable, "-W", "ignore", __file__, "jumping", tmp_path]
    environment = {**os.environ, "LD_PRELOAD": str(tmp_path / "jumps.so")}
    done = subprocess.run(program, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert done.stdout.splitlines() == 3 * [inspector.inspect(layup.scan).reason]


@pytest.mark.layup
@pytest.mark.slow
def test_sigterm_at_any_instant_leaves_whole_files_or_none(tmp_path):
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    files.save_cloud(tmp_path / "ref.npy", layup.reference)
    files.save_cloud(tmp_path / "scan.npy", layup.scan)
    np.savetxt(tmp_path / "pose.txt", layup.mold_from_scanner)
    words = ["inspect", "scan.npy", "--reference", "ref.npy", "--pose", "pose.txt", "--history", "cell.sqlite"]
    program = [*CALL, *words, "-o", "a.json", "-o", "a.html"]
    began = time.monotonic()
    whole = subprocess.run(program, cwd=tmp_path, capture_output=True).returncode
    lasted = time.monotonic() - began
    before, history = contents(tmp_path), History(tmp_path / "cell.sqlite")
    ends = set()
    for share in np.linspace(0.1, 1.0, 12):
        process = subprocess.Popen(program, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(share * lasted)
        process.terminate()
        ends.add(process.wait(30))
        assert contents(tmp_path).keys() == before.keys(), f"after {share:.2f} of the run"
        assert EXIT_CODES[Report.load(tmp_path / "a.json").verdict] == whole
        assert (tmp_path / "a.html").read_text().rstrip().endswith("</html>")
        assert history.check().passed
    assert ends <= {-signal.SIGTERM, 130, whole} and ends - {whole}


if __name__ == "__main__":
    globals()[sys.argv[1]](Path(sys.argv[2]))
