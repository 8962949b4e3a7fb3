"""What is stored is found, read back, and its loss or change noticed; a history that fails costs no verdict."""

import csv
import dataclasses
import os
import shutil
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Timer

import pyarrow.parquet
import pytest
from typer.testing import CliRunner

from debulk import InputError, Report, Verdict
from debulk.cli import app
from debulk.comparison import Comparison
from debulk.history import History
from debulk.history.export import export
from debulk.history.kept import history_of
from debulk.history.rows import TABLES
from debulk.history.tables import connected
from debulk.results.comparison import PocketComparison
from debulk.results.finding import Finding

ROOT = Path(__file__).resolve().parents[3]


def of(report, time="2026-03-01T12:00:00.000Z", verdict=None, **context):
    trace = dataclasses.replace(report.trace, time_utc=time, context=context)
    return dataclasses.replace(report, trace=trace, verdict=verdict or report.verdict)


def compared(report, wrong=1):
    pockets = [
        PocketComparison(
            id=p.id, outline_mm=p.outline_mm, predicted=p.verdict,
            measured=Verdict.CREASE if p.id == wrong else Verdict.CEASE, reason="", measured_peak_mm=0.4,
        )
        for p in report.pockets
    ]  # fmt: skip
    return Comparison(pockets=tuple(pockets), max_rms_mm=0.3, max_peak_mm=0.6)


@pytest.fixture(scope="module")
def made(tmp_path_factory, report):
    """Three layups: two of part A-17, one of them INVALID and one UNDECIDED because of a hole; one of part B."""
    there = History(tmp_path_factory.mktemp("made") / "cell.sqlite")
    there.add(of(report, "2026-03-01T12:00:00.000Z", part="A-17", ply=3))
    findings = (Finding("coverage", Verdict.UNDECIDED, "little"), Finding("holes", Verdict.UNDECIDED, "a hole"))
    seen = Report(verdict=Verdict.UNDECIDED, reason="little", pockets=(), findings=findings, trace=report.trace)
    there.add(of(seen, "2026-03-02T12:00:00.000Z", part="A-17", ply=4))
    there.add(of(report, "2026-03-03T12:00:00.000Z", part="B"))
    return there.path


@pytest.fixture
def history(made, tmp_path):
    return History(shutil.copy(made, tmp_path))


@pytest.mark.parametrize(
    ("wanted", "records"),
    [
        ({}, [3, 2, 1]),
        ({"part": "A-17"}, [2, 1]),
        ({"part": "A-17", "ply": "3"}, [1]),
        ({"verdict": "undecided"}, [2]),
        ({"check": "holes"}, [3, 2, 1]),
        ({"check": "coverage"}, [2]),
        ({"check": "chain"}, []),
        ({"near_mm": (330, 260), "within_mm": 20}, [3, 1]),
        ({"near_mm": (330, 260), "within_mm": 20, "part": "B"}, [3]),
        ({"near_mm": (30, 30), "within_mm": 20}, []),
        ({"since": "2026-03-02"}, [3, 2]),
        ({"until": "2026-03-02"}, [1]),
        ({"limit": 1}, [3]),
    ],
)
def test_layups_are_found(history, wanted, records):
    assert [row.record for row in history.find(**wanted)] == records


@pytest.mark.parametrize(
    "wanted",
    [
        {"verdict": "good"},
        {"check": "cover"},
        {"within_mm": 0},
        {"limit": 0},
        {"near_mm": (330, float("nan"))},
        {"since": "yesterday"},
        {"since": "2026-3-1"},
        {"until": "2026-03-01 06:00"},
    ],
)
def test_a_search_that_cannot_be_meant_is_refused(history, wanted):
    with pytest.raises(InputError, match=next(iter(wanted))):
        history.find(**wanted)


@pytest.mark.parametrize("pictures", [True, False])
def test_a_report_comes_back(tmp_path, report, pictures):
    there = History(tmp_path / "c.sqlite", pictures=pictures)
    number = there.add(report)
    kept = report if pictures else dataclasses.replace(report, height_map=None)
    there.report(number).save(tmp_path / "a.json")
    kept.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    row = there.find()[0]
    assert row.noise_mm == pytest.approx(0.05, rel=0.05)  # of the made-up map, drop-outs and pockets in it


def test_a_comparison_brings_its_report_with_it(tmp_path, report):
    there = History(tmp_path / "c.sqlite")
    number = there.add_comparison(compared(report), report)
    assert (number, there.number_of(report), len(there.find())) == (2, 1, 1)
    assert there.add_comparison(compared(report), report) == 3
    assert [p.measured for p in there.comparison(2).pockets] == [p.measured for p in compared(report).pockets]
    assert [there.kind(k) for k in (1, 2)] == ["report", "comparison"]
    with pytest.raises(InputError, match="expected record 2 to be a report, but it is a comparison"):
        there.report(2)
    with pytest.raises(InputError, match="there is no record 9"):
        there.report(9)


def test_a_report_that_several_add_at_once_is_there_once(tmp_path, report):
    """Of two records of one inspection the second would count twice in what is learned from outcomes."""
    there = History(tmp_path / "c.sqlite")
    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(lambda _: there.add(report), range(8))) == {1}
    assert there.add(of(report, part="another")) == 2
    other = dataclasses.replace(report, recipe={**report.recipe, "of": "somebody else"})
    assert there.add(other) == 3
    assert there.add_comparison(compared(report), report) == 4
    half = of(report, part="half of a character \udc80")
    assert (there.add(half), there.add(half), there.number_of(half)) == (5, 5, 5)
    assert len(there.find()) == 4


def test_a_history_that_several_begin_at_once_is_theirs(tmp_path):
    """One found no number of a history in the file, then the tables that another had just made: "not a history"."""

    def begin(path: Path) -> None:
        with connected(path, write=True):
            pass

    with ThreadPoolExecutor(8) as pool:
        for k in range(40):
            list(pool.map(begin, [tmp_path / f"{k}.sqlite"] * 8))


def test_a_reader_waits_for_a_history_that_somebody_just_makes(tmp_path):
    path = tmp_path / "cell.sqlite"
    maker, begun = History(path), sqlite3.connect(path)
    begun.execute("PRAGMA journal_mode = WAL")  # the first step of whoever makes one: a file without a table
    begun.close()
    making = Timer(0.2, maker.add, (Report(verdict=Verdict.INVALID, reason="", pockets=()),))
    making.start()
    assert all(row.record == 1 for row in History(path).find())
    making.join()
    assert len(History(path).find()) == 1


def test_a_check_of_an_earlier_debulk_is_found(history):
    change(history, "UPDATE cause SET name = 'seen' WHERE name = 'coverage'")
    assert [row.record for row in history.find(check="seen")] == [2]


def test_the_word_of_an_operator_is_kept(history):
    assert history.add_outcome(1, 3, "crease", by="A. Smith", note="seen under light") == 4
    wrongs = (
        ((1, 99, "crease"), "no pocket 99 in record 1"),
        ((99, 1, "crease"), "there is no record 99"),
        ((1, 3, "good"), "measured: expected"),
    )
    for wrong, message in wrongs:
        with pytest.raises(InputError, match=message):
            history.add_outcome(*wrong)
    got = CliRunner().invoke(app, ["history", "get", str(history.path), "4", "-o", "x.html"])
    assert "expected record 4 to be a report, but it is an operator's outcome" in got.stderr


def test_no_cell_of_an_exported_table_is_a_formula(tmp_path, report):
    there = History(tmp_path / "cell.sqlite")
    there.add(of(report, part='=HYPERLINK("x")'))
    export(there, tmp_path / "layup.csv")
    with (tmp_path / "layup.csv").open(newline="") as file:
        assert [row["part"] for row in csv.DictReader(file)] == ['\'=HYPERLINK("x")']


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_tables_are_exported(history, tmp_path, ending):
    history.add_outcome(1, 3, "crease")
    counts = {"layup": 3, "pocket": 14, "cause": 6, "outcome": 1, "chain": 0}
    for table, kind in TABLES.items():
        path = tmp_path / f"{table}.{ending}"
        assert export(history, path, table) >= counts[table]
        if ending == "csv":
            with path.open(newline="") as file:
                rows = list(csv.DictReader(file))
        else:
            rows = pyarrow.parquet.read_table(path).to_pylist()
        assert not counts[table] or list(rows[0]) == list(kind.__dataclass_fields__)
    found = [row for row in rows if str(row["record"]) == "4"]
    assert [(row["measured"], row["source"]) for row in found] == [("CREASE", "operator")]
    with pytest.raises(InputError, match=r"ending in \.csv, \.parquet or \.dfq"):
        export(history, tmp_path / "x.xls")


# --- a history that was tampered with ---


def change(history, *statements):
    with sqlite3.connect(history.path) as connection:
        for statement in statements:
            connection.execute(statement)
    connection.close()


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        ("UPDATE body SET text = (SELECT text FROM body WHERE number = 3) WHERE number = 2", "record 2 was changed"),
        ("UPDATE record SET stored_utc = '2020' WHERE number = 1", "record 1 was changed"),
        ("DELETE FROM body WHERE number = 2", "record 2 was changed"),
        ("DELETE FROM record WHERE number = 2", "record 2 is missing"),
        ("DELETE FROM record WHERE number = 1", "record 1 is missing"),
        ("DELETE FROM record WHERE number > 1", "records 2 to 3 are missing"),
        ("UPDATE layup SET verdict = 'CEASE' WHERE record = 1", "the figures of record 1"),
        ("DELETE FROM pocket WHERE record = 3 AND id = 2", "the figures of record 3"),
        ("INSERT INTO cause VALUES (2, 'excess', 'CREASE')", "the figures of record 2"),
        ("UPDATE cause SET record = 'x' WHERE record = 1", "the figures of record 1"),
        ("UPDATE layup SET reason = x'00ff' WHERE record = 1", "the figures of record 1"),
        ("UPDATE body SET text = 'abc' WHERE number = 1", "record 1 was changed"),
    ],
)
def test_a_change_is_found(history, statement, problem):
    assert history.check().passed
    change(history, statement)
    found = history.check()
    assert not found.passed and len(found.problems) == 1
    assert found.problems[0].startswith(problem)


def test_forged_hashes_are_found_by_a_noted_head_alone(history, report):
    head = history.check().head
    history.add(report)
    assert history.check(head).passed
    forged = History(history.path.parent / "forged.sqlite")
    for k in range(4):
        forged.add(of(report, part=str(k)))
    assert forged.check().passed and not forged.check(head).passed
    change(history, "DELETE FROM record WHERE number > 2", "UPDATE sqlite_sequence SET seq = 2")
    assert history.check().passed
    assert history.check(head).problems == ("record 3 is missing",)
    with pytest.raises(InputError, match="head: expected number and hash"):
        history.check("17")


# --- a history that cannot be written ---


def test_a_history_that_cannot_be_written_costs_no_verdict(tmp_path, report):
    folder = tmp_path / "gone"
    folder.mkdir()
    there = history_of(str(folder / "c.sqlite"))
    assert there.keep(report) is report
    assert there.kept(report) == (report, 1)
    for name in os.listdir(folder):
        (folder / name).unlink()
    folder.rmdir()
    kept, record = there.kept(report)
    assert kept.verdict is report.verdict and record is None
    assert kept.warnings[:-1] == report.warnings and kept.warnings[-1].startswith("not in the history: ")
    comparison = there.keep_comparison(compared(report), report)
    assert "not in the history" in comparison.warnings[0]


@pytest.mark.program
def test_a_full_disk_costs_no_verdict_and_no_record(tmp_path, report):
    there = History(tmp_path / "c.sqlite", pictures=True)
    there.add(report)
    pages = sqlite3.connect(there.path).execute("PRAGMA page_count").fetchone()[0]
    code = (
        "import resource, sys, signal; from debulk import Report; from debulk.history import History;"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({4096 * pages}, {4096 * pages}));"
        "report = Report.load(sys.argv[2]); there = History(sys.argv[1], pictures=True);"
        "from dataclasses import replace; traces = [replace(report.trace, context={'ply': k}) for k in range(3)];"
        "kept = [there.keep(replace(report, trace=trace)) for trace in traces]; print(kept[-1].warnings[-1])"
    )
    report.save(tmp_path / "r.json")
    done = subprocess.run(
        [sys.executable, "-c", code, there.path, tmp_path / "r.json"], capture_output=True, text=True, check=True
    )
    assert "not in the history" in done.stdout, done.stdout
    assert there.check().passed


def test_what_is_no_history_is_refused_when_it_is_set_up(tmp_path, report):
    (tmp_path / "a.txt").write_text("no history" * 1000)
    with sqlite3.connect(tmp_path / "other.sqlite") as connection:
        connection.execute("CREATE TABLE a (b)")
    connection.close()
    for name, message in (("a.txt", "not a database"), ("other.sqlite", "not a history"), ("no/c.sqlite", "no folder")):
        with pytest.raises(InputError, match=message):
            history_of(tmp_path / name)
    with pytest.raises(InputError, match="history: expected a debulk"):
        history_of(7)
    with pytest.raises(InputError, match="there is no such history"):
        History(tmp_path / "new.sqlite").find()


def test_a_history_of_the_first_layout_is_read_and_goes_on(history, report):
    change(history, "DROP TABLE chain", "PRAGMA user_version = 1")
    assert history.check().passed and history.find()
    assert export(history, history.path.with_name("chain.csv"), "chain") == 0
    before = len(history.find())
    history.add(report)
    assert history.check().passed and len(history.find()) == before + 1
    with sqlite3.connect(history.path) as connection:
        assert connection.execute("PRAGMA user_version").fetchone() == (2,)
    connection.close()


def test_a_damaged_name_in_the_file_is_named(history):
    data = history.path.read_bytes()
    history.path.write_bytes(data.replace(b"CREATE TABLE layup", b"CREATE TABLE l\xa0yup"))
    with pytest.raises(InputError, match="cannot be read"):
        history.check()


def test_a_writer_that_waits_in_vain_says_so(history, report, monkeypatch):
    monkeypatch.setattr("debulk.history.tables._PATIENCE_S", 0.05)
    busy = sqlite3.connect(history.path, isolation_level=None)
    busy.execute("BEGIN IMMEDIATE")
    assert "locked" in history.keep(report).warnings[-1]
    assert len(history.find()) == 3  # readers do not wait
    busy.execute("ROLLBACK")
    busy.close()
    assert history.keep(report) is report


@pytest.mark.program
def test_writers_that_are_killed_lose_no_record():
    done = subprocess.run(
        [sys.executable, ROOT / "bench" / "history" / "killed.py", "--kills", "40"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
