"""With a file of approved recipes, no other recipe passes a layup."""

import pytest
from typer.testing import CliRunner

import debulk
from debulk import InputError, Report, Verdict
from debulk.cli import app
from debulk.inspection.checks.pockets import approval as findings
from debulk.recipe import Recipe
from debulk.results.approval import approvals, approve

TIME = "2026-03-01T12:00:00.000Z"


def test_an_approved_recipe_and_another(tmp_path):
    path = tmp_path / "approved.toml"
    first = approve(path, Recipe().model_dump(), 'A. "Owner" é', TIME)
    approve(path, Recipe(net={"node_target": 90}).model_dump(), "B", TIME)
    found = approvals(path)
    assert found[0] == first and [one.name for one in found] == ['A. "Owner" é', "B"]
    assert findings(found, Recipe(run={"threads": 3})) == findings(None, Recipe(net={"node_target": 91})) == []
    (finding,) = findings(found, Recipe(net={"node_target": 91}))
    assert finding.at_best is Verdict.UNDECIDED and "none of the 2 approved" in finding.reason


@pytest.mark.parametrize(
    ("text", "says"),
    [
        *(
            (one, "expected approvals as debulk approve writes them")
            for one in ("", "approved = 3\n", "[[approved]]\nname = 1\n", "approved = [3]\n")
        ),
        ("[[approved]\n", "not valid TOML"),
        ("approved = " + "[" * 100_000, "not approvals: nested too deeply"),
    ],
    ids=["empty", "a number", "too little", "a list", "broken", "deep"],
)
def test_what_is_no_such_file_is_named(tmp_path, text, says):
    path = tmp_path / "a.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"a\.toml: {says}"):
        approvals(path)
    with pytest.raises(InputError):
        approve(path, Recipe().model_dump(), "A", TIME)
    assert path.read_text() == text


@pytest.mark.layup
def test_an_inspector_asks_for_it(tmp_path):
    (tmp_path / "cell.toml").write_text("[verdict]\nmax_rms_mm = 5.0\nmax_ridge_mm = 9.0\n")
    words = ["approve", tmp_path / "cell.toml", "--in", tmp_path / "approved.toml", "--by", "A. Owner"]
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0 and "approved by A. Owner, 20" in done.stdout
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    options = {"mold_from_scanner": layup.mold_from_scanner, "approved": tmp_path / "approved.toml"}
    verdicts = []
    for recipe in (Recipe.load(tmp_path / "cell.toml"), Recipe(verdict={"max_rms_mm": 5.0, "max_ridge_mm": 9.5})):
        report = debulk.Inspector(recipe, layup.reference, layup.ply_outline, **options).inspect(layup.scan)
        report.save(tmp_path / "r.json")
        assert Report.load(tmp_path / "r.json").verdict is report.verdict
        verdicts.append(report.verdict)
        assert len(report.trace.versions["build"]) == 16
    assert verdicts == [Verdict.CEASE, Verdict.UNDECIDED]
    assert report.findings[-1].check == "approval"
    clouds = layup.scan, layup.reference
    assert debulk.repeat(report, *clouds, approved=options["approved"]).same
    assert "verdict" in debulk.repeat(report, *clouds).differences
