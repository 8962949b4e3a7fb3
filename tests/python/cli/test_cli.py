import dataclasses
import json
import os
import re
import subprocess
import sys
import types

import numpy as np
import pytest
from typer.testing import CliRunner

from debulk import InputError, files
from debulk.cli import app
from debulk.history import History
from debulk.net import Draping
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results.deciding import worst_first
from debulk.verdict import Verdict


class FakeInspector:
    """Stands in for the inspection: keeps what it was given, and returns the report it was set to."""

    answer: Report | Exception
    seen: dict

    def __init__(self, recipe, reference, **options):
        FakeInspector.seen = {"recipe": recipe, "reference": reference, **options}

    def inspect(self, scan, deadline_s=None, progress=None, context=None, *, fibre_angles_deg=None):
        FakeInspector.seen |= {"scan": scan, "deadline_s": deadline_s, "context": context}
        progress("segment", 0.5)
        if isinstance(self.answer, BaseException):
            raise self.answer
        return self.answer


@pytest.fixture
def cell(tmp_path, report, monkeypatch):
    """Return a folder with a scan and a reference, and the inspection replaced."""
    monkeypatch.setitem(sys.modules, "debulk.inspection.inspector", types.SimpleNamespace(Inspector=FakeInspector))
    monkeypatch.setattr(FakeInspector, "answer", report, raising=False)
    points = np.arange(60.0).reshape(4, 5, 3)
    files.save_cloud(tmp_path / "scan.pcd", points + 2)
    files.save_cloud(tmp_path / "ref.ply", points + 1)
    (tmp_path / "cell.toml").write_text("[net]\nnode_target = 60\n")
    (tmp_path / "pose.txt").write_text("1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n")
    (tmp_path / "outline.csv").write_text("0,0\n100,0\n100,100\n")
    np.save(tmp_path / "mask.npy", np.arange(20).reshape(4, 5) == 7)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


BASIC = ("inspect", "scan.pcd", "--reference", "ref.ply")


def test_a_place_behind_the_angles_is_where_the_ply_is_first_laid_down(cell):
    run(*BASIC, "--angles=-45,45@100,-50.5")
    assert FakeInspector.seen["fibre_angles_deg"] == Draping((100.0, -50.5), (-45.0, 45.0))


def test_inspect_hands_everything_on(cell):
    result = run(
        *BASIC, "--recipe", "cell.toml", "--pose", "pose.txt", "--outline", "outline.csv", "--angles=-45,45",
        "--deadline", "2.5", "--camera", "900,2,1.5", "--mask", "mask.npy",
        "--context", "part=A-17", "--context", "note=a=b", "-o", "a.html", "-o", "b.json", "-o", "c.csv",
    )  # fmt: skip
    assert result.exit_code == 3, result.output
    seen = FakeInspector.seen
    assert seen["recipe"] == Recipe(net={"node_target": 60})
    assert seen["scan"].shape == seen["reference"].shape == (4, 5, 3)
    assert (seen["scan"][0, 0, 0], seen["reference"][0, 0, 0]) == (2.0, 1.0)
    assert seen["camera"] == (900.0, 2.0, 1.5) and seen["mask"].sum() == 1
    assert seen["fibre_angles_deg"] == (-45.0, 45.0) and seen["deadline_s"] == 2.5
    np.testing.assert_array_equal(seen["mold_from_scanner"][:3, 3], [5, 6, 7])
    assert seen["ply_outline"].shape == (3, 2)
    assert seen["context"] == {"part": "A-17", "note": "a=b"}
    assert "INVALID: pocket 6" in result.stdout and "written: c.csv" in result.stdout
    assert result.stderr == ""
    assert (cell / "a.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    assert Report.load(cell / "b.json").source == {
        "scan": "scan <1>.pcd",
        "reference": "ref.pcd",
        "recipe": "cell.toml",
    }


def test_what_a_file_holds_beside_its_points_is_in_the_report(cell):
    data = (cell / "scan.pcd").read_bytes()
    (cell / "scan.pcd").write_bytes(data.replace(b"VIEWPOINT 0 0 0 1 0 0 0", b"VIEWPOINT 5 0 0 1 0 0 0"))
    result = run(*BASIC, "-o", "b.json")
    warning = Report.load(cell / "b.json").warnings[0]
    assert warning.startswith("scan.pcd: its VIEWPOINT, 5 0 0 1 0 0 0, is not applied")
    assert "scan.pcd: its VIEWPOINT, 5 0 0 1 0 0 0" in " ".join(result.stdout.split()) and result.stderr == ""


@pytest.mark.parametrize(("frame", "times"), [(["--frame-unit", "mm"], 1), ([], 1000)])
def test_metres_apply_to_all_files_but_those_of_another_frame_unit(cell, frame, times):
    run(*BASIC, "--pose", "pose.txt", "--outline", "outline.csv", "--unit", "m", *frame)
    seen = FakeInspector.seen
    assert seen["scan"][0, 0, 0] == 2000 and seen["mold_from_scanner"][0, 3] == 5 * times
    assert seen["ply_outline"].max() == 100 * times


@pytest.mark.parametrize(
    ("verdict", "code"),
    [(Verdict.CEASE, 0), (Verdict.CREASE, 1), (Verdict.UNDECIDED, 4), (Verdict.INVALID, 3)],
)
def test_the_exit_code_tells_the_verdict(cell, report, monkeypatch, verdict, code):
    monkeypatch.setattr(FakeInspector, "answer", dataclasses.replace(report, verdict=verdict))
    assert run(*BASIC).exit_code == code


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("--reference", "none.ply"), "none.ply"),
        (("--recipe", "none.toml"), "none.toml"),
        (("--recipe", "bad.toml"), "material.friction: expected a number at least 0, got -1; net.node_target"),
        (("--pose", "outline.csv"), "outline.csv"),
        (("--outline", "scan.pcd"), "scan.pcd"),
        (("--angles", "0"), "--angles: expected two numbers"),
        (("--angles", "0,180"), "10 degrees apart"),
        (("--angles", "0,180@1,2"), "10 degrees apart"),
        (("--angles", "0,1.5708"), "10 degrees apart, but got 0 and 1.5708; are they in radians?"),
        (("--angles", "0,90@1"), "like 0,90@100,50, got '0,90,1'"),
        (("--angles", "nan,0"), "10 degrees apart"),
        (("--angles", "inf,0"), "10 degrees apart"),
        (("--context", "A-17"), "--context: expected NAME=VALUE like part=A-17, got 'A-17'"),
        (("--camera", "900,2"), "--camera: expected f,cx,cy"),
        (("--camera=-900,2,1",), "--camera: expected f,cx,cy"),
        (("--camera", "nan,2,1"), "--camera: expected f,cx,cy"),
        (("--mask", "scan.pcd"), "scan.pcd: expected a mask ending in"),
        (("--mask", "none.png"), "none.png: cannot be read"),
        (("--deadline", "0"), "--deadline"),
        (("--deadline", "nan"), "--deadline"),
        (("-o", "x.pdf"), "x.pdf: expected a file ending in .json, .csv or .html"),
        (("-o", "none/x.html"), "there is no folder none"),
    ],
)
def test_bad_input_is_one_clear_line(cell, arguments, part):
    (cell / "bad.toml").write_text("[material]\nfriction = -1\n[net]\nnode_target = 0.5\n")
    result = run(*BASIC, *arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert part in result.stderr
    assert result.stderr.startswith("debulk: ") and result.stderr.count("\n") == 1


def test_outputs_are_checked_before_the_work(cell):
    FakeInspector.seen = {}
    run(*BASIC, "-o", "none/x.html")
    assert FakeInspector.seen == {}


def test_what_the_inspection_refuses_is_bad_input(cell, monkeypatch):
    monkeypatch.setattr(FakeInspector, "answer", InputError("scan: expected (H, W, 3), got (4,)"))
    result = run(*BASIC)
    assert (result.exit_code, result.stderr) == (2, "debulk: scan: expected (H, W, 3), got (4,)\n")


def test_a_fault_never_looks_like_a_verdict(cell, monkeypatch):
    monkeypatch.setattr(FakeInspector, "answer", ZeroDivisionError("oh"))
    result = run(*BASIC)
    assert result.exit_code == 70
    assert "ZeroDivisionError: oh" in result.stderr and "fault" in result.stderr
    monkeypatch.setattr(FakeInspector, "answer", KeyboardInterrupt())
    assert run(*BASIC).exit_code == 130


def test_the_files_are_there_even_if_nobody_reads_the_table(cell, monkeypatch):
    def leave(_report):
        raise BrokenPipeError

    monkeypatch.setattr("debulk.cli.commands.show", leave)
    monkeypatch.setattr("os.dup2", lambda *_: None)
    assert run(*BASIC, "-o", "a.json").exit_code == 141
    assert (cell / "a.json").exists()


def test_missing_arguments_are_bad_input(cell):
    assert run("inspect", "scan.pcd").exit_code == 2
    assert run("inspect").exit_code == 2
    assert run("dance").exit_code == 2


def scene(**_options):
    square = np.array([[0, 0], [50, 0], [50, 40], [0, 40]], dtype=float)
    points = np.arange(36, dtype=np.float32).reshape(3, 4, 3)
    return types.SimpleNamespace(
        scan=points,
        reference=points,
        mold_from_scanner=np.eye(4),
        camera=(1000.0, 2.0, 1.5),
        ply_outline=square,
        truth=types.SimpleNamespace(pockets=[None] * 14, decoys=[None] * 6),
    )


def test_demo_leaves_report_and_files(cell, report, monkeypatch):
    monkeypatch.setattr("debulk.scenes.layup", scene)
    monkeypatch.setattr(FakeInspector, "answer", dataclasses.replace(report, verdict=Verdict.CREASE, source={}))
    result = run("demo", "-o", "deep/out", "--seed", "3", "--keep-files")
    assert result.exit_code == 0, result.output
    names = {
        "report.html",
        "report.json",
        "report.csv",
        "scan.pcd",
        "reference.pcd",
        "pose.txt",
        "outline.csv",
        "recipe.toml",
    }
    assert {path.name for path in (cell / "deep/out").iterdir()} == names
    assert FakeInspector.seen["camera"] == (1000.0, 2.0, 1.5)
    tree = json.loads((cell / "deep/out/report.json").read_text(encoding="utf-8"))
    assert "seed 3" in tree["source"]["scan"]
    shown = tree["source"]["what this shows"]
    assert "14 air pockets and 6 bumps" in shown and "7 places are judged, 0 of them" in shown
    assert shown in " ".join(result.stdout.split())
    # What it left behind goes through inspect.
    command = next(line for line in result.stdout.splitlines() if line.startswith("try: ")).split()[2:]
    monkeypatch.setattr(FakeInspector, "answer", dataclasses.replace(report, verdict=Verdict.CEASE))
    assert run(*command).exit_code == 0
    np.testing.assert_array_equal(FakeInspector.seen["ply_outline"], scene().ply_outline)
    assert FakeInspector.seen["recipe"] == Recipe()


def test_demo_says_if_its_scan_cannot_be_judged(cell, monkeypatch):
    monkeypatch.setattr("debulk.scenes.layup", scene)
    assert run("demo").exit_code == 3
    assert run("demo", "--pixels", "12 by 9").exit_code == 2
    (cell / "file").write_text("")
    assert run("demo", "-o", "file").exit_code == 2


def test_recipe_prints_what_it_reads(tmp_path):
    result = run("recipe")
    (tmp_path / "r.toml").write_text(result.stdout, encoding="utf-8")
    assert result.exit_code == 0 and Recipe.load(tmp_path / "r.toml") == Recipe()


def test_version():
    from debulk import __version__

    result = run("--version")
    assert (result.exit_code, result.stdout) == (0, f"debulk {__version__}\n")


@pytest.mark.parametrize("width", [80, 120, 250])
def test_the_table_on_a_terminal(report, monkeypatch, capsys, width):
    import debulk.cli.commands as cli

    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(width))
    cli._leave(report, [], details=True)
    text = capsys.readouterr().out
    assert "\x1b[" in text
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    assert max(map(len, plain.splitlines())) <= width
    assert "<script>alert('x')</script>" in " ".join(plain.split())
    assert plain.count("left out:") == len(report.left_out)
    first, *_, last = (line for line in plain.splitlines() if not line.startswith(" "))
    assert first == last and first.startswith("INVALID: pocket 6")  # what was left out buries neither
    lines = [line for line in plain.splitlines() if re.match(r" ?\d+  ", line)]
    assert len(lines) == len(report.pockets)
    assert all(len(line.split()) >= 9 for line in lines)  # no figure is broken over lines


@pytest.mark.parametrize("width", [80, 120])
def test_what_to_do_fits_on_a_screen(report, monkeypatch, capsys, width):
    import debulk.cli.commands as cli

    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(width))
    cli._leave(report, [])
    plain = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)
    lines = plain.splitlines()
    assert max(map(len, lines)) <= width and len(lines) <= 16
    assert lines[0].startswith("INVALID: pocket 6")
    numbers = [int(line.split()[0]) for line in lines if re.match(r" ?\d+  ", line)]
    assert numbers == [p.id for p in worst_first(report.pockets) if p.verdict is not Verdict.CEASE]
    assert lines[-1] == "2 pockets CEASE, 2 left out: --details"


def test_no_bar_falls_back_and_each_stage_has_its_own(monkeypatch):
    import rich.progress

    from debulk.cli.support import shown_progress

    seen = {}

    def update(self, task, *, completed):
        seen.setdefault(self.tasks[task].description, []).append(completed)

    monkeypatch.setattr(rich.progress.Progress, "update", update)
    with shown_progress() as progress:
        for stage, fraction in (
            ("read", 0.0),
            ("read", 0.9),
            ("read", 0.4),
            ("solve", 0.0),
            ("solve", 2.0),
            ("read", 0.1),
        ):
            progress(stage, fraction)
    assert list(seen) == ["read", "solve"] and all(values == sorted(values) for values in seen.values())
    assert max(seen["solve"]) == 1.0


def test_a_table_that_nobody_watches_has_a_line_a_pocket(report):
    lines = report.table().splitlines()
    assert sum(line.lstrip()[0].isdigit() for line in lines) == len(report.pockets)


def test_the_package_imports_nothing_heavy():
    code = (
        "import sys, debulk.report, debulk.files;"
        "bad = {'pydantic', 'cv2', 'jinja2', 'typer', 'rich'} & set(sys.modules); assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_the_console_script_runs():
    result = subprocess.run(
        [sys.executable, "-c", "import sys; sys.argv = ['debulk', 'inspect', 'no.pcd', '--reference', 'no.pcd']; "
         "from debulk.cli import main; main()"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert result.returncode == 2
    assert result.stderr.startswith("debulk: no.pcd: cannot be read") and result.stderr.count("\n") == 1


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8:strict"])
def test_a_character_that_the_stream_lacks_costs_nothing(tmp_path, encoding):
    """Half a character comes from the name of a file of another locale; JSON has escapes of its own."""
    there = History(tmp_path / "cell.sqlite")
    there.add(Report(verdict=Verdict.CREASE, reason="90° Δx \N{GRINNING FACE}", pockets=()))

    def said(words, *more):
        call = [sys.executable, "-m", "debulk", "history", words, str(there.path), *more]
        environment = os.environ | {"PYTHONIOENCODING": encoding}
        done = subprocess.run(call, capture_output=True, env=environment, timeout=60)
        assert (done.returncode, done.stderr) == (0, b"")
        return done.stdout

    assert b"CREASE" in said("list")
    assert json.loads(said("list", "--json"))[0]["reason"] == there.find()[0].reason
    assert b"\\udcf6.csv, 1 rows" in said("export", "-o", f"{tmp_path}/\udcf6.csv")


@pytest.mark.parametrize("closed", [(1,), (2,), (0, 1, 2)])
def test_a_command_that_was_started_without_streams_ends_as_usual(tmp_path, closed):
    """As by a scheduler: the exit code is that of the outcome, and no file takes the place of a stream."""

    def close():
        for number in closed:
            os.close(number)

    for words, code in ((["recipe"], 0), (["inspect", "no.pcd", "--reference", "no.pcd"], 2)):
        call = [sys.executable, "-m", "debulk", *words]
        done = subprocess.run(call, capture_output=True, text=True, preexec_fn=close, cwd=tmp_path, timeout=60)
        assert done.returncode == code and "Traceback" not in done.stderr
