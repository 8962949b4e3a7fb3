"""cmake/quietly.sh keeps a step's output in a log, and shows how far the step is."""

import os
import pty
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "cmake" / "quietly.sh"
BUILD = 'echo Collecting numpy; for k in $(seq 8); do echo "  [$k/8] Building x$k.cpp"; done; echo done'


def run(tmp_path, command, **more):
    return subprocess.run(
        [SCRIPT, tmp_path / "log", "bash", "-c", command], capture_output=True, text=True, timeout=30, **more
    )


def test_in_a_pipe_the_quarters_of_a_build_are_told(tmp_path):
    done = run(tmp_path, BUILD)
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr.split() == ["[2/8]", "[4/8]", "[6/8]", "[8/8]"]
    assert (tmp_path / "log").read_text().count("Building") == 8 + 1  # with the command itself


def test_a_terminal_shows_every_step_on_one_line(tmp_path):
    ours, theirs = pty.openpty()
    try:
        subprocess.run([SCRIPT, tmp_path / "log", "bash", "-c", BUILD], stdout=theirs, stderr=theirs, timeout=30)
        shown = os.read(ours, 10_000).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert "Collecting numpy" in shown and all(f"[{k}/8]" in shown for k in range(1, 9))
    assert "\n" not in shown and shown.endswith("\r\x1b[K")  # and nothing stays


def test_a_failure_shows_what_was_said_and_where_the_rest_is(tmp_path):
    (tmp_path / "log").write_text("an older step\n")
    done = run(tmp_path, "echo no compiler; exit 3")
    assert done.returncode == 3
    assert "no compiler" in done.stderr and "an older step" not in done.stderr
    assert f"the whole log: {tmp_path / 'log'}" in done.stderr


@pytest.mark.parametrize("name", ["quietly.sh", "install_dependencies.sh"])
def test_the_scripts_parse(name):
    subprocess.run(["bash", "-n", SCRIPT.parent / name], check=True)
