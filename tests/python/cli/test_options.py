"""What all commands share: their help, -q and -v, --json, completion."""

import json
import logging
import os
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest
import typer.main
from typer.testing import CliRunner

from debulk import InputError, Recipe, Verdict, files, rings, scenes
from debulk.batch.archive import Layup
from debulk.batch.worker import inspected
from debulk.build import build_id
from debulk.cli import app
from debulk.cli.examples import EXAMPLES
from debulk.cli.given import Given
from debulk.cli.support import EXIT_CODES
from debulk.comparison import Comparison
from debulk.report import Report
from debulk.serve.inspectors import Cell

ROOT = typer.main.get_command(app)


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def commands(group, path=()):
    yield " ".join(path), group
    for name, command in getattr(group, "commands", {}).items():
        yield from commands(command, (*path, name))


def test_every_command_has_examples_and_no_other():
    assert sorted(EXAMPLES) == sorted(name for name, _ in commands(ROOT))


@pytest.mark.parametrize("name", [name for name, _ in commands(ROOT)])
def test_a_help_shows_examples_and_exit_codes(name):
    shown = " ".join(run(*name.split(), "--help").stdout.split())
    for example in EXAMPLES[name]:
        assert example in shown
    assert "Exit codes: " in shown and "130 interrupted" in shown
    if name in ("", "inspect"):
        assert all(f"{code} {verdict.name}" in shown for verdict, code in EXIT_CODES.items())


def test_a_dxf_may_have_its_cut_outs_on_a_layer_of_their_own(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    document, outside = ezdxf.new(units=4), np.array([(0.0, 0.0), (400.0, 0.0), (400.0, 300.0), (0.0, 300.0)])
    for layer, corners in (("1", outside), ("11", 0.1 * outside + 100)):
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    path = tmp_path / "ply.dxf"
    document.saveas(path)
    expected = rings.outline([outside, 0.1 * outside + 100], "ply_outline")
    context = ROOT.commands["inspect"].make_context("inspect", ["s.npy", "--reference=r.npy", "--outline-layer=1,11"])
    given = Given(outline=path, outline_layer=context.params["outline_layer"])
    np.testing.assert_allclose(given.read()["ply_outline"], expected)
    cell = Cell(Recipe(), outline_layer=given.outline_layer).changed(None, path)
    np.testing.assert_allclose(cell.ply_outline, expected)
    with pytest.raises(InputError, match=r"2 closed and 0 open.*give the layer \(--outline-layer"):
        Given(outline=path).read()
    np.save(tmp_path / "mold.npy", np.random.default_rng(0).uniform(1, 99, (999, 3)).astype(np.float32))
    layup = Layup(
        folder=tmp_path, scan="s.npy", reference="mold.npy", outline="ply.dxf", outline_layer="CUT", context={}
    )
    assert "expected one closed line on layer 'CUT', got nothing" in inspected(layup, {}, build_id())[1]


@pytest.mark.parametrize("example", sorted({line for lines in EXAMPLES.values() for line in lines}))
def test_an_example_parses(example):
    words = shlex.split(re.sub(r"^eval \"\$\((.*)\)\"$", r"\1", example).partition(">")[0])
    assert words.pop(0) == "debulk"
    command = ROOT
    context = command.make_context("debulk", words.copy(), resilient_parsing=False) if words[0][0] != "-" else None
    while getattr(command, "commands", None):
        name = words[0] if words[0] in command.commands else "images"  # a word that `debulk scan` lets one leave out
        words = words[words[:1] == [name] :]
        command = command.commands[name]
    if "--help" not in words:
        command.make_context(example, words, parent=context)  # an error would be raised


def test_an_example_that_lacks_something_would_not_parse():
    command = ROOT.commands["inspect"]
    with pytest.raises(Exception, match="reference"):
        command.make_context("inspect", ["scan.pcd"])


@pytest.fixture
def doctor(monkeypatch):
    """Replace the examination by one that logs and takes no time."""
    import debulk.doctor as module

    found = module.DoctorReport(
        versions={"debulk": "1"}, system="s", processor="p", instruction_set="i", cores=2, threads=2, memory_gb=None,
        bandwidth_gb_s=1.0, bundled=(), licences=(), licence_folder=None,
        tests=(module.SelfTest("solver", True, "a figure " * 30),),
    )  # fmt: skip

    def examined():
        logging.getLogger("debulk").debug("a stage: 1.0 ms")
        return found

    monkeypatch.setattr(module, "doctor", examined)


def test_verbose_logs_to_stderr_and_leaves_the_logger_as_it_was(doctor):
    log = logging.getLogger("debulk")
    before = log.level, list(log.handlers)
    loud, plain = run("doctor", "-v"), run("doctor")
    assert "a stage: 1.0 ms" in loud.stderr
    assert plain.stderr == "" and plain.stdout == loud.stdout
    assert (log.level, list(log.handlers)) == before


def test_quiet_prints_errors_only(doctor, tmp_path):
    done = run("doctor", "--quiet")
    assert (done.exit_code, done.output) == (0, "")
    wrong = run("view", tmp_path / "none.json", "-q")
    assert wrong.exit_code == 2 and "none.json: cannot be read" in wrong.stderr


def test_lines_that_go_into_a_file_are_folded(doctor):
    assert 80 < max(map(len, run("doctor").stdout.splitlines())) <= 100


@pytest.mark.parametrize("quiet", [(), ("-q",)])
def test_json_of_the_doctor(doctor, quiet):
    tree = json.loads(run("doctor", "--json", *quiet).stdout)
    assert tree["passed"] is True and tree["tests"][0]["name"] == "solver" and tree["memory_gb"] is None


def test_json_of_inspection_and_comparison_is_alone_and_reads_back(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("demo", "--pixels", "640x480", "-o", ".", "--keep-files", "-q").stdout == ""
    files.save_cloud("after.pcd", scenes.layup(seed=0, pixels=(640, 480)).debulked().scan)
    clouds = ("--reference", "reference.pcd", "--pose", "pose.txt")
    done = run("inspect", "scan.pcd", *clouds, "--outline", "outline.csv", "--json", "-o", "before.json")
    assert (done.exit_code, done.stderr) == (1, "")
    assert done.stdout.rstrip("\n") == (tmp_path / "before.json").read_text().rstrip("\n")
    report = Report.load("before.json")
    assert len(report.pockets) > 10 and report.verdict is Verdict.CREASE
    done = run("compare", "before.json", "after.pcd", *clouds, "--json", "-o", "became.json")
    assert done.stdout.rstrip("\n") == (tmp_path / "became.json").read_text().rstrip("\n")
    assert len(Comparison.load("became.json").pockets) == len(report.pockets)


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion_prints_a_script(shell):
    text = run("completion", shell).stdout
    assert "_DEBULK_COMPLETE=complete_" + shell in text and "debulk" in text
    assert run("completion", "tcsh").exit_code == 2


@pytest.mark.parametrize(
    ("words", "offered"),
    [("debulk ins", "inspect"), ("debulk inspect --ref", "--reference"), ("debulk scan pat", "patterns")],
)
def test_the_script_completes(tmp_path, words, offered):
    program = tmp_path / "debulk"
    program.write_text(f"#!{sys.executable}\nfrom debulk.cli import main\nmain()\n")
    program.chmod(0o755)
    script = (
        f"{run('completion', 'bash').stdout}\nCOMP_WORDS=({words}); COMP_CWORD={words.count(' ')}\n"
        '_debulk_completion debulk; echo "${COMPREPLY[@]}"'
    )
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", script], env=environment, capture_output=True, text=True, timeout=60)
    assert offered in done.stdout.split(), done.stderr
