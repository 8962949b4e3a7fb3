"""`debulk page` and `debulk compare`: what they write, and their exit codes."""

import dataclasses

import numpy as np
import pytest
from typer.testing import CliRunner

from debulk import files
from debulk.cli import app
from debulk.comparison import Comparison, PocketComparison
from debulk.inspection import calls
from debulk.results.trace import Trace
from debulk.verdict import Verdict
from html_reader import read


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path, report, monkeypatch):
    """Return a folder with three plies' reports, the first of which has a page of its own."""
    (tmp_path / "plies").mkdir()
    for ply, verdict in ((1, Verdict.INVALID), (2, Verdict.INVALID), (3, Verdict.INVALID)):
        trace = Trace(time_utc="2026-03-01T12:00:00Z", context={"ply": ply})
        one = dataclasses.replace(report, verdict=verdict, trace=trace)
        one.save(tmp_path / "plies" / f"ply {ply} #a.json")
        if ply == 1:
            one.save(tmp_path / "plies" / f"ply {ply} #a.html")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_stack_links_the_pages_that_are_there_as_seen_from_its_own_place(folder):
    names = [f"plies/ply {k} #a.json" for k in (3, 1, 2)]
    result = run("page", *names, "-o", "stack.html")
    assert (result.exit_code, result.output) == (0, "written: stack.html\n")
    html = (folder / "stack.html").read_text(encoding="utf-8")
    outward = {a["href"] for _, a in read(html).elements if a.get("href", "#")[0] != "#" and "base64" not in a["href"]}
    assert outward == {"plies/ply%201%20%23a.html"}
    assert html.index("<h2>Ply 1") < html.index("<h2>Ply 2") < html.index("<h2>Ply 3")
    assert run("page", *names, "-o", "plies/ply 1 #a.html").exit_code == 0  # a page does not link to itself
    assert "ply%201" not in (folder / "plies" / "ply 1 #a.html").read_text(encoding="utf-8")


def test_two_reports_are_shown_side_by_side(folder):
    names = ["plies/ply 1 #a.json", "plies/ply 2 #a.json"]
    assert run("page", *names, "--compare", "-o", "both.html").exit_code == 0
    assert "0 of 7 places differ" in (folder / "both.html").read_text(encoding="utf-8")
    for wrong in (names[:1], names + names[:1]):
        assert "expected two reports" in run("page", *wrong, "--compare", "-o", "no.html").stderr
    assert not (folder / "no.html").exists()


def test_a_single_reports_page_is_the_one_that_inspect_writes(folder):
    assert run("page", "plies/ply 1 #a.json", "-o", "one.html").exit_code == 0
    assert (folder / "one.html").read_bytes() == (folder / "plies" / "ply 1 #a.html").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("plies/ply 1 #a.json", "-o", "stack.json"), "ending in .html"),
        (("plies/ply 1 #a.json", "nowhere.json", "-o", "stack.html"), "nowhere.json"),
        (("plies/ply 1 #a.json", "-o", "nowhere/stack.html"), "there is no folder nowhere"),
        (("plies/ply 1 #a.html", "-o", "stack.html"), "ply 1 #a.html"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(folder, arguments, part):
    result = run("page", *arguments)
    assert result.exit_code == 2 and part in result.stderr and len(result.stderr.splitlines()) == 1
    assert not (folder / "stack.html").exists() and not (folder / "stack.json").exists()


def test_without_a_report_or_an_output_it_says_what_is_missing(folder):
    assert run("page", "-o", "stack.html").exit_code == 2
    assert run("page", "plies/ply 1 #a.json").exit_code == 2


@pytest.mark.parametrize(
    ("predicted", "measured", "code"),
    [
        ("cease", "cease", 0),
        ("crease", "crease", 0),
        ("cease", "crease", 1),
        ("crease", "cease", 1),
        ("undecided", "crease", 0),
        ("cease", "undecided", 0),
        ("invalid", "cease", 0),
        ("cease", "invalid", 0),
    ],
)
def test_compare_ends_with_1_where_an_outcome_was_wrong(folder, report, monkeypatch, predicted, measured, code):
    def pocket(number, predicted, measured):
        return PocketComparison(
            id=number, outline_mm=np.zeros((0, 2)), predicted=Verdict(predicted), measured=Verdict(measured), reason=""
        )

    one = Comparison(
        pockets=(pocket(1, "cease", "cease"), pocket(2, predicted, measured)), max_rms_mm=0.3, max_peak_mm=0.6
    )
    monkeypatch.setattr(calls, "compare", lambda *_: one)
    files.save_cloud(folder / "scan.pcd", np.arange(60.0).reshape(4, 5, 3))
    report.save(folder / "r.json")
    result = run("compare", "r.json", "scan.pcd", "--reference", "scan.pcd", "-o", "c.html")
    assert result.exit_code == code, result.output
    assert [p.id for p in one.wrong] == [2] * code
    assert (folder / "c.html").exists()  # written before it ends
    false = f"1 FALSE {predicted.upper()}: pocket 2"
    assert (f"<h1>{false}</h1>" in (folder / "c.html").read_text(encoding="utf-8")) == bool(code)
    assert result.stdout.startswith(false) == bool(code)


@pytest.mark.parametrize(("frame", "times"), [(["--frame-unit", "mm"], 1), ([], 1000)])
def test_the_pose_of_compare_may_have_another_unit_than_the_clouds(folder, report, monkeypatch, frame, times):
    """As that of inspect: a cell whose clouds are in metres could not compare with its pose in mm."""
    poses = []
    none = Comparison(pockets=(), max_rms_mm=0.3, max_peak_mm=0.6)
    monkeypatch.setattr(calls, "compare", lambda *given: poses.append(given[4]) or none)
    files.save_cloud(folder / "scan.pcd", np.arange(60.0).reshape(4, 5, 3))
    report.save(folder / "r.json")
    np.savetxt(folder / "pose.txt", np.eye(4) + np.eye(4, k=3) * 5)
    clouds = ("r.json", "scan.pcd", "--reference", "scan.pcd", "--unit", "m", "--pose", "pose.txt")
    result = run("compare", *clouds, *frame)
    assert result.exit_code == 0, result.output
    assert poses[0][0, 3] == 5 * times


def test_the_exit_code_of_compare_is_in_its_help():
    text = " ".join(run("compare", "--help").output.replace("│", " ").split())
    assert "exit code is 1 where an outcome was wrong" in text


def test_diff_of_reports_and_of_recipes(folder, report):
    report.save(folder / "a.json")
    dataclasses.replace(report, pockets=report.pockets[:6]).save(folder / "b.json")
    assert run("diff", "a.json", "a.json").exit_code == 0
    different = run("diff", "a.json", "b.json")
    assert different.exit_code == 1 and "only in the first" in different.stdout
    (folder / "a.toml").write_text("[net]\nnode_target = 60\n")
    assert run("diff", "a.toml", "a.toml").stdout == "the same settings\n"
    (folder / "b.toml").write_text("[net]\nnode_target = 70\n")
    recipes = run("diff", "a.toml", "b.toml")
    assert (recipes.exit_code, recipes.stdout) == (1, "recipe, net.node_target: 60, then 70\n")
    assert run("diff", "a.toml", "a.json").exit_code == 2


def test_every_check_is_explained_by_its_name(folder):
    from debulk.results.check_texts import CHECK_TEXTS

    everything = " ".join(run("checks").stdout.split())
    for check in CHECK_TEXTS:
        one = run("checks", check.name)
        text = " ".join(one.stdout.split())
        assert one.exit_code == 0 and text in everything
        assert text.startswith(f"{check.name}: ") and " ".join(check.remedy.split()) in text
    assert run("checks", "nothing").exit_code == 2
