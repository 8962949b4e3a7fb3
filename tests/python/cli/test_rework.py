"""`debulk rework`: the plan as text, and as JSON for a robot."""

import json

from typer.testing import CliRunner

from debulk.cli import app


def run(*arguments):
    return CliRunner().invoke(app, ["rework", *(str(argument) for argument in arguments)])


def test_the_plan_is_that_of_the_report_as_text_and_as_json(report, tmp_path):
    path, plan = tmp_path / "layup.json", tmp_path / "plan.json"
    report.save(path)
    said = run(path, "-o", plan)
    assert said.exit_code == 0 and f"written: {plan}" in said.output
    tree = json.loads(plan.read_text(encoding="utf-8"))
    assert tree == json.loads(json.dumps(report.rework().to_dict())) == json.loads(run(path, "--json").output)
    assert " ".join(said.output.split()).startswith(f"1. {report.rework().moves[0].at}: ")


def test_more_force_pulls_where_less_lifts(report, tmp_path):
    path = tmp_path / "layup.json"
    report.save(path)
    ways = [
        {move["by"] for move in json.loads(run(path, "--hold", hold, "--json").output)["moves"]} for hold in (1e-3, 1e9)
    ]
    assert ways == [{"lift"}, {"pull"}]


def test_bad_input_is_one_line(report, tmp_path):
    path = tmp_path / "layup.json"
    report.save(path)
    for arguments, part in (
        ((path, "--hold", -1), "hold_n: expected a positive number"),
        ((path, "-o", tmp_path / "plan.txt"), "expected a file ending in .json"),
        ((tmp_path / "none.json",), "none.json"),
    ):
        said = run(*arguments)
        assert said.exit_code == 2 and part in said.stderr and len(said.stderr.splitlines()) == 1
    assert not (tmp_path / "plan.txt").exists()
