"""Fills a history with made-up layups, and measures the page that is made of it.

    python bench/history/fill.py --layups 100000 --out bench/history/page.txt --keep /tmp/history

The rows are those that reports would give, eight pockets a layup with a place where they recur, a drift of the level
from the middle on, and outcomes of every tenth layup. The bodies are random bytes, shorter than a report's, so that the
disk of a test machine holds them: the page reads none. What a real report takes is measured beside it.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import tempfile
import time
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

import debulk
from debulk.history import History, rows
from debulk.history.check import record_hash
from debulk.history.page import page
from debulk.history.rows import CauseRow, LayupRow, OutcomeRow, PocketRow
from debulk.history.tables import connected

POCKETS = 8
START = datetime(2026, 3, 1, 6)


def of_layup(rng: np.random.Generator, number: int, layup: int, layups: int) -> list[rows.Row]:
    """Make the rows of a layup up."""
    ridges = rng.gamma(2.0, 0.12, POCKETS)
    often = rng.random(POCKETS) < 0.35
    x = np.where(often, rng.normal(-350, 40, POCKETS), rng.uniform(-600, 600, POCKETS))
    y = np.where(often, rng.normal(120, 40, POCKETS), rng.uniform(-450, 450, POCKETS))
    verdicts = np.where(ridges > 0.63, "CREASE", np.where(ridges > 0.57, "UNDECIDED", "CEASE"))
    worst = max(verdicts, key=["CEASE", "UNDECIDED", "CREASE"].index)
    if rng.random() < 0.01:
        worst = "INVALID"
    level = 0.002 * rng.normal() + 0.006 * max(0.0, layup / layups - 0.5)
    found: list[rows.Row] = [
        LayupRow(
            number, f"{(START + timedelta(minutes=4 * layup)).isoformat(timespec='milliseconds')}Z", f"A-{layup // 12}",
            str(layup % 12 + 1), str(worst), "made up", POCKETS,
            int((verdicts == "CREASE").sum()), int((verdicts == "UNDECIDED").sum()), 0, 0.99 + 0.01 * rng.random(),
            0.0175 + 0.0004 * rng.normal(),
            level, level + 0.0005 * rng.normal(), abs(0.001 * rng.normal()), 0.01 + 0.002 * rng.normal(),
            380 * rng.lognormal(0, 0.08), "0.2.0", "", "ab" * 32, f"{layup:032x}",
        )
    ]  # fmt: skip
    for k in range(POCKETS):
        found.append(
            PocketRow(
                number, k + 1, str(verdicts[k]), "excess", x[k], y[k], 900.0, 6.0, ridges[k], ridges[k] - 0.03,
                ridges[k] + 0.03, 0.006, 0,
            )
        )  # fmt: skip
    found += [CauseRow(number, "pockets", str(v)) for v in sorted({*verdicts} - {"CEASE"})]
    if worst == "INVALID":
        found.append(CauseRow(number, "level", "INVALID"))
    if layup % 10 == 0:
        for k in range(POCKETS):
            measured = "CREASE" if ridges[k] > 0.60 + 0.05 * rng.normal() else "CEASE"
            found.append(
                OutcomeRow(number, number, k + 1, "scan", str(verdicts[k]), measured, ridges[k], ridges[k] * 1.05, 1.0)
            )
    return found


def fill(history: History, layups: int, body_bytes: int) -> None:
    """Store made-up layups in one transaction."""
    rng, previous = np.random.default_rng(1), hashlib.sha256(b"").hexdigest()
    with connected(history.path, write=True) as connection:
        for layup in range(layups):
            number = layup + 1
            tables = rows.as_tuples(of_layup(rng, number, layup, layups))
            header = (number, "report", None, "2026-03-01T00:00:00.000Z", rows.digest(tables), previous)
            body = rng.bytes(body_bytes)
            previous = record_hash(header, body)
            connection.execute("INSERT INTO record VALUES (?, ?, ?, ?, ?, ?, ?)", (*header, previous))
            connection.execute("INSERT INTO body VALUES (?, ?)", (number, body))
            for name, lines in tables.items():
                connection.executemany(f"INSERT INTO {name} VALUES ({', '.join('?' * len(lines[0]))})", lines)


def a_report() -> debulk.Report:
    """Inspect a virtual layup of the usual size."""
    layup = debulk.scenes.layup(seed=0, pixels=(1280, 960))
    return debulk.inspect(layup.scan, layup.reference, None, layup.ply_outline, (0, 90), layup.mold_from_scanner)


def timed(work, repeats: int, clock=time.perf_counter) -> tuple[float, object]:
    """Return the median time in seconds, and what the work gave last."""
    times = []
    for _ in range(repeats):
        began = clock()
        found = work()
        times.append(clock() - began)
    return float(np.median(times)), found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=100_000)
    parser.add_argument("--body-kb", type=float, default=20.0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--keep", type=Path, help="folder in which history and page are left")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = given.keep or Path(folder)
        path = folder / "cell.sqlite"
        history = History(path)
        began = time.perf_counter()
        if new := not path.exists():
            fill(history, given.layups, round(1000 * given.body_kb))
        filled = time.perf_counter() - began
        size = path.stat().st_size
        used, html = timed(lambda: page(history), 5, time.process_time)
        drawn, _ = timed(lambda: page(history), 5)
        busy = os.getloadavg()[0]
        (folder / "history.html").write_text(html)
        near, found = timed(lambda: history.find(near_mm=(-350, 120), within_mm=5, verdict="CREASE", limit=100), 5)
        one, _ = timed(lambda: history.find(part="A-77"), 5)
        began = time.perf_counter()
        checked = history.check()
        checking = time.perf_counter() - began
        report, real = a_report(), History(folder / "real.sqlite")
        others = (replace(report, trace=replace(report.trace, context={"ply": k})) for k in range(18))
        anew = iter(tuple(others))  # a report that is there already is not added again
        adding, _ = timed(lambda: real.add(next(anew)), 9)
        storing, _ = timed(lambda: real.add(next(anew)), 9, time.process_time)
        loading, _ = timed(lambda: real.report(3), 5)
        each = real.path.stat().st_size / 18
    figures = (size - 1000 * given.body_kb * given.layups) / given.layups
    text = f"""{given.layups} made-up layups of {POCKETS} pockets, bodies of {given.body_kb:g} kB{f", filled in {filled:.0f} s" if new else ""}
file: {size / 1e9:.2f} GB, {figures / 1e3:.2f} kB a layup beside its body
page: {used:.2f} s of processor time, {drawn:.2f} s on the clock (medians of 5; load of the two cores: {busy:.1f}),
      {len(html) / 1e3:.0f} kB
search by place and verdict, {len(found)} found: {1e3 * near:.0f} ms; by part: {1e3 * one:.1f} ms
check of all hashes: {checking:.1f} s, {"nothing changed or missing" if checked.passed else checked.problems[:3]}

a report of a virtual layup, 1280 x 960 pixels, {len(report.pockets)} pockets, without pictures: {each / 1e3:.0f} kB in the file
({given.layups} of them: {given.layups * each / 1e9:.0f} GB); stored in {1e3 * storing:.0f} ms of processor time,
{1e3 * adding:.0f} ms until it is on the disk, read back in {1e3 * loading:.0f} ms
"""  # noqa: E501
    print(text, end="")
    if given.out:
        given.out.write_text(text)


if __name__ == "__main__":
    main()
