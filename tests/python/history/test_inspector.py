"""An inspector with a history: what it returns is in there, and the command line's report is as it was saved."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
from debulk import files
from debulk.cli import app
from debulk.history import History


@pytest.fixture(scope="module")
def layup():
    return debulk.scenes.layup(seed=0, pixels=(640, 480))


@pytest.mark.layup
def test_reports_and_comparisons_are_in_the_history(layup, tmp_path):
    path = tmp_path / "cell.sqlite"
    pose = layup.mold_from_scanner
    inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=pose, history=path)
    report = inspector.inspect(layup.scan, context={"part": "A-17"})
    comparison = inspector.compare(report, layup.debulked().scan)
    assert report.warnings == () or "history" not in report.warnings[-1]
    history = History(path)
    stored = history.report(1)
    assert stored.reason == report.reason and stored.trace.context == {"part": "A-17"}
    decided = report.as_decided().pockets  # nets are kept where the verdict needed them
    assert [p.as_decided().solve for p in stored.pockets] == [p.solve for p in decided]
    assert all(np.array_equal(p.outline_mm, q.outline_mm) for p, q in zip(stored.pockets, decided, strict=True))
    assert history.comparison(2).agreement == comparison.agreement
    assert [row.record for row in history.find(part="A-17")] == [1]

    inspector.save(tmp_path / "i.npz")
    again = debulk.Inspector.load(tmp_path / "i.npz", history=history)
    path.unlink()
    path.mkdir()
    late = again.inspect(layup.scan)
    assert late.verdict is report.verdict and late.warnings[-1].startswith("not in the history: ")
    with pytest.raises(debulk.InputError, match=r"history: expected a debulk\.history\.History"):
        debulk.Inspector(None, layup.reference, history=3)


@pytest.mark.layup
def test_the_command_line_stores_what_it_saves(layup, tmp_path):
    files.save_cloud(tmp_path / "scan.pcd", layup.scan)
    files.save_cloud(tmp_path / "ref.pcd", layup.reference)
    np.savetxt(tmp_path / "pose.txt", layup.mold_from_scanner)
    np.savetxt(tmp_path / "outline.csv", layup.ply_outline, delimiter=",")
    files.save_cloud(tmp_path / "after.pcd", layup.debulked().scan)

    def run(*words):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exit_code in (0, 1, 3, 4), done.output
        return done

    both = ("--reference", tmp_path / "ref.pcd", "--pose", tmp_path / "pose.txt", "--history", tmp_path / "c.sqlite")
    more = ("--outline", tmp_path / "outline.csv", "--context", "part=B")
    run("inspect", tmp_path / "scan.pcd", *both, *more, "-o", tmp_path / "r.json")
    run("compare", tmp_path / "r.json", tmp_path / "after.pcd", *both)
    history = History(tmp_path / "c.sqlite")
    saved = debulk.Report.load(tmp_path / "r.json")
    kept = dataclasses.replace(saved, height_map=None, excess_map=None, shear_map=None)
    assert json.dumps(history.report(1).to_dict()) == json.dumps(kept.to_dict())
    assert (history.kind(2), len(history.find())) == ("comparison", 1)
