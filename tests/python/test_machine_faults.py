"""What a real machine does to a program: full disks, read-only folders, files that change, clocks that jump, SIGTERM.

The disks are real ones, a few megabytes of memory, mounted where only the program under test sees them.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import boards
import cloud_files
import debulk
from debulk import InputError, Report, files
from debulk.files.replacing import write_picture
from debulk.history import History
from debulk.history.export import export
from debulk.scanner import Calibration

CALL = [sys.executable, "-c", "from debulk.cli import main; main()"]
KILOBYTES = 8000
CLOUD = np.arange(6000.0).reshape(-1, 3)


def save_calibration(report: Report, path: Path) -> None:
    cameras = (boards.MATRICES, boards.DISTORTIONS, boards.ROTATION, boards.TRANSLATION * len(report.reason))
    Calibration(*cameras, boards.PIXELS).save(path)


OUTPUTS = {
    **dict.fromkeys(("a.json", "a.csv", "a.html"), Report.save),
    **dict.fromkeys(
        ("a.npy", "a.ply", "a.xyz"), lambda report, path: files.save_cloud(path, CLOUD + len(report.reason))
    ),
    "a.dfq": lambda _, path: export(History(path.with_name("cell.sqlite")), path),
    "map.png": lambda report, path: write_picture(path, np.full((200, 300), len(report.reason), np.uint8)),
    "scanner.json": save_calibration,
}


def outputs(folder: Path, report: Report) -> dict[str, str]:
    """Write every kind of file in a folder; return what was said about those that could not be written."""
    said = {}
    for name, save in OUTPUTS.items():
        try:
            save(report, folder / name)
        except InputError as error:
            said[name] = str(error)
    return said


def again(report: Report, number: int) -> Report:
    """Return the report as of another inspection, which a history keeps beside the first."""
    return dataclasses.replace(report, trace=dataclasses.replace(report.trace, context={"ply": number}))


def contents(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder; SQLite's own beside the history are not counted."""
    found = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file() and path.name != "filler"}
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
    report = again(report, 2)
    said = outputs(disk, report)
    assert said.keys() == OUTPUTS.keys(), said
    assert all("No space left on device" in text and name in text for name, text in said.items()), said
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
    assert said.keys() == OUTPUTS.keys(), said
    assert all("Read-only file system" in text and name in text for name, text in said.items()), said
    assert Report.load(disk / "a.json").verdict is report.verdict
    assert files.load_cloud(disk / "a.npy").shape == (2000, 3)
    kept = history.keep(again(report, 2))
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


def ended(folder: Path) -> None:
    """Child: a writer that is ended at random instants leaves each file whole, old or new, and what it announced."""
    first, history = Report.load(folder / "report.json"), History(folder / "grown.sqlite")
    versions = (first, first.changed(reason="another"))
    (folder / "out").mkdir()
    History(folder / "out" / "cell.sqlite").add(first)
    rng = np.random.default_rng(0)

    whole = []
    for report in versions:
        assert not (said := outputs(folder / "out", report)), said
        whole.append(contents(folder / "out"))
    announced: list[int] = []
    for _ in range(30):
        heard, saying = os.pipe()
        if (child := os.fork()) == 0:
            code = 1
            try:
                signal.signal(signal.SIGTERM, signal.default_int_handler)
                os.write(saying, bytes(8))
                for number in itertools.count():
                    for report in versions:
                        added = history.add(again(report, 1000 * os.getpid() + number))
                        os.write(saying, added.to_bytes(8, "little"))
                        assert not outputs(folder / "out", report)
            except KeyboardInterrupt:
                code = 130
            finally:
                os._exit(code)
        os.close(saying)
        with open(heard, "rb") as numbers:
            assert numbers.read(8) == bytes(8)
            time.sleep(rng.uniform(0, 1.0))
            os.kill(child, signal.SIGTERM)
            announced += np.frombuffer(numbers.read(), "<u8").tolist()
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 130
        found = contents(folder / "out")
        assert found.keys() == whole[0].keys()
        assert not (half := [name for name, data in found.items() if data not in (whole[0][name], whole[1][name])]), (
            half
        )
    kept = {row.record for row in history.find()}
    assert announced and kept >= set(announced) and history.check().passed, (announced, kept)


@pytest.mark.program
def test_a_writer_that_is_ended_at_any_instant_leaves_whole_files_and_every_record(tmp_path, report):
    report.save(tmp_path / "report.json")
    done = subprocess.run([sys.executable, "-W", "ignore", __file__, "ended", tmp_path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def cell(tmp_path_factory, report):
    """Return a folder with what the commands need: a scan, a reference, an archive of two layups, a history."""
    folder = tmp_path_factory.mktemp("cell")
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    files.save_cloud(folder / "ref.npy", layup.reference)
    files.save_cloud(folder / "scan.npy", layup.scan)
    np.savetxt(folder / "pose.txt", layup.mold_from_scanner)
    for name in ("one", "two"):
        (folder / "archive" / name).mkdir(parents=True)
        lines = (f"{key} = '../../{file}'" for key, file in (("scan", "scan.npy"), ("reference", "ref.npy"), POSE))
        (folder / "archive" / name / "layup.toml").write_text("\n".join(lines))
    (folder / "spool").mkdir()
    report.save(folder / "a.json")
    return folder


POSE = ("pose", "pose.txt")
INSPECT = ["scan.npy", "--reference", "ref.npy", "--pose", "pose.txt"]
NODESET = Path(__file__).resolve().parents[2] / "build/nodesets/Opc.Ua.MachineVision.NodeSet2.xml"
COMMANDS = {
    "inspect": [*INSPECT, "--history", "cell.sqlite", "-o", "a.json", "-o", "a.html"],
    "history page": ["cell.sqlite", "-o", "history.html"],
    "history export": ["cell.sqlite", "-o", "layups.csv"],
    "batch": ["archive", "--history", "batch.sqlite", "--workers", "1"],
    "serve": ["--port", "0", "--spool", "spool", *INSPECT[1:]],
}


DIFFERING = """
import os, signal, sys
from debulk.results import difference

def report_difference(*_):
    {body}
    return []

difference.report_difference = report_difference
from debulk.cli import main
sys.argv = ["debulk", "diff", "a.json", "a.json"]
main()
"""
INTERRUPTED = """
    try:
        os.kill(os.getpid(), signal.{sign})
        sum(range(10))
    except KeyboardInterrupt as error:
        {then}
"""


def differing(cell, body):
    """Return how debulk diff ends if something happens while it compares."""
    program = [sys.executable, "-c", DIFFERING.format(body=body)]
    return subprocess.run(program, cwd=cell, capture_output=True, text=True, preexec_fn=interruptible)


@pytest.mark.layup
@pytest.mark.parametrize("sign", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("then", ["raise RuntimeError('as in a class') from error", "pass"], ids=["changed", "lost"])
def test_an_interrupt_is_no_fault_and_no_result_whatever_a_library_makes_of_it(cell, sign, then):
    done = differing(cell, INTERRUPTED.format(sign=sign, then=then))
    assert (done.returncode, done.stderr) == (130, f"debulk diff: ended by {sign}\n"), done


@pytest.mark.layup
def test_a_machine_with_too_little_memory_is_no_fault(cell):
    done = differing(cell, "bytes(1 << 60)")
    assert done.returncode == 2 and done.stderr.startswith("debulk: it does not fit into the memory"), done
    assert done.stderr.count("\n") == 1


def interruptible() -> None:
    """Listen to SIGINT, which whatever a shell started in the background ignores, and so this test with it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def left_of(session: int) -> list[str]:
    """Return the processes of a session."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            words = (place / "stat").read_text().rpartition(")")[2].split()
            if int(words[3]) == session and words[0] != "Z":
                found.append((place / "cmdline").read_text())
    return found


@pytest.mark.layup
@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_that_is_ended_at_any_instant_leaves_nothing_half_done(cell, command):
    """Files are whole, records are kept, no process is left, and one line says what was ended."""
    program = [*CALL, *command.split(), *COMMANDS[command]]
    if command == "serve" and NODESET.is_file():
        with socket.create_server(("127.0.0.1", 0)) as free:
            program += ["--opcua", f"opc.tcp://127.0.0.1:{free.getsockname()[1]}/", "--nodeset", str(NODESET)]
    began = time.monotonic()
    if command.startswith("history"):
        History(cell / "cell.sqlite").add(Report.load(cell / "a.json"))
    if command == "serve":
        first = subprocess.Popen(program, cwd=cell, stdout=subprocess.PIPE, text=True)
        assert first.stdout.readline().startswith("debulk: http://")
        first.send_signal(signal.SIGTERM)
        first.wait(60)
        first.stdout.close()
        wholes = {0}
    else:
        wholes = {subprocess.run(program, cwd=cell, capture_output=True).returncode}
    lasted, before, ends = time.monotonic() - began, contents(cell).keys(), []
    rng = np.random.default_rng(len(command))
    tries = 1 if command == "batch" else 2
    for sign in 4 * tries * (signal.SIGTERM, signal.SIGINT):
        if len(ends) >= 2 * tries and set(ends) - wholes:  # at least one was ended before it was done
            break
        (cell / "batch.sqlite").unlink(missing_ok=True)  # what is done already would not be done again
        process = subprocess.Popen(
            program,
            cwd=cell,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=interruptible,
        )
        time.sleep(rng.uniform(0.2, 1.0) * lasted)
        process.send_signal(sign)
        _, said = process.communicate(timeout=60)
        ends.append(process.returncode)
        lasted *= 0.8 if process.returncode in wholes else 1.0
        if process.returncode == 130:
            # asyncua may add that a task of its own was not awaited
            assert said.startswith(f"debulk {command.split()[0]}: ended by {sign.name}\n") and "Traceback" not in said
        end = time.monotonic() + 30
        while left := left_of(process.pid):
            assert time.monotonic() < end, left
            time.sleep(0.05)
        assert contents(cell).keys() - {"batch.sqlite"} == before - {"batch.sqlite"}
        assert not list((cell / "spool").iterdir())
        for path in cell.glob("*.sqlite"):
            assert History(path).check().passed
        for path in cell.glob("*.html"):
            assert path.read_text().rstrip().endswith("</html>")
        Report.load(cell / "a.json")
    assert set(ends) <= {-signal.SIGTERM, -signal.SIGINT, 130} | wholes and set(ends) - wholes


if __name__ == "__main__":
    globals()[sys.argv[1]](Path(sys.argv[2]))
