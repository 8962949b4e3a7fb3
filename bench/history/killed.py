"""Kills writers of a history at random instants, and looks whether a report is lost that was said to be stored.

    python bench/history/killed.py --kills 1000 --out bench/history/killed.txt

Each writer is a process of its own that adds reports to one file and says each number on a pipe once `add` has
returned. It is ended by SIGKILL at a random instant, while the next one starts on what it left. At the end every number
that was said must be there, with a body that loads, and the chain of hashes must be whole.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from debulk.grid import Grid
from debulk.history import History
from debulk.report import Report
from debulk.verdict import Verdict

MOST_S = 0.4  # a writer lives up to this long: some ten records, each waits for the disk


def a_report(k: int) -> Report:
    """A report with a map, so that a record has many pages of the file."""
    heights = np.random.default_rng(k).normal(0.3, 0.05, (60, 80)).astype(np.float32)
    return Report(
        verdict=Verdict.UNDECIDED, reason=f"report {k}", pockets=(), height_map=Grid(heights, np.zeros(2), 2.0)
    )


def write(path: Path, said: int) -> None:
    """Add reports until killed."""
    history, k = History(path, pictures=True), 0
    while True:
        number = history.add(a_report(k := k + 1))
        os.write(said, b"%d\n" % number)


def killed_once(path: Path, wait_s: float) -> list[int]:
    """Start a writer, kill it, and return the numbers that it said."""
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            write(path, theirs)
        finally:
            os._exit(1)
    os.close(theirs)
    time.sleep(wait_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), "the writer ended by itself"
    with os.fdopen(ours, "rb") as pipe:
        return [int(line) for line in pipe.read().split(b"\n")[:-1]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    instants, said, began = random.Random(given.seed), list[int](), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cell.sqlite"
        History(path).add(a_report(0))
        for _ in range(given.kills):
            said += killed_once(path, instants.uniform(0.0, MOST_S))
        history = History(path)
        checked = history.check()
        lost = [number for number in said if history.report(number).verdict is not Verdict.UNDECIDED]
        size = path.stat().st_size
    # A record that was on the disk when its writer died before it could say so is no loss: it is one more.
    unsaid = checked.records - 1 - len(said)
    passed = checked.passed and not lost and len(set(said)) == len(said) and 0 <= unsaid <= given.kills and said
    text = (
        f"{given.kills} writers killed within {1e3 * MOST_S:.0f} ms of their start; {len(said)} records said to be "
        f"stored, {len(lost)} lost; {unsaid} stored, but not said yet; chain of {checked.records} records: "
        f"{'whole' if checked.passed else checked.problems}; {size / checked.records / 1e3:.1f} kB a record, "
        f"{time.perf_counter() - began:.0f} s\n"
    )
    print(text, end="")
    if given.out:
        given.out.write_text(text)
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
