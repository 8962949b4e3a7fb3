"""`debulk qualify` and `debulk inspect --chain`, from files to files."""

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
from debulk.chain import Chain
from debulk.cli import app


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Return a folder with ten scans of a layup, five of each of two days, one more, and what belongs to them."""
    folder = tmp_path_factory.mktemp("cell")
    for day in ("monday", "tuesday"):
        (folder / day).mkdir()
    for k in range(11):
        layup = debulk.scenes.layup(1, (448, 336), repeat=k)
        name = "more.npy" if k == 10 else f"{('monday', 'tuesday')[k // 5]}/{k}.npy"
        np.save(folder / name, layup.scan)
    np.save(folder / "reference.npy", layup.reference)
    np.savetxt(folder / "pose.txt", layup.mold_from_scanner, fmt="%.17g")
    np.savetxt(folder / "outline.csv", layup.ply_outline, delimiter=",", fmt="%.17g")
    (folder / "recipe.toml").write_text(debulk.Recipe(solve={"when": "needed"}).to_toml())
    return folder


def of(cell):
    names = {"reference": "reference.npy", "pose": "pose.txt", "outline": "outline.csv", "recipe": "recipe.toml"}
    return [word for name, file in names.items() for word in (f"--{name}", cell / file)]


def test_a_chain_is_qualified_and_recognised(cell):
    scans = [cell / f"{('monday', 'tuesday')[k // 5]}" / f"{k}.npy" for k in range(10)]
    done = run("qualify", *scans, *of(cell), "--name", "cell 3", "-o", cell / "chain.json", "-o", cell / "chain.html")
    assert done.exit_code == 0, done.output
    assert "ridge: %GRR" in done.stdout and "note: no gauge was scanned" in done.stdout
    chain = Chain.load(cell / "chain.json")
    assert (chain.name, chain.scans, chain.studies[0].sessions) == ("cell 3", 10, 2)
    assert "cell 3" in (cell / "chain.html").read_text(encoding="utf-8")
    seen = run("inspect", cell / "more.npy", *of(cell), "--chain", cell / "chain.json", "-o", cell / "own.json")
    assert seen.exit_code in (0, 1, 3, 4), seen.output
    report = debulk.Report.load(cell / "own.json")
    assert report.chain.sha256 == chain.sha256
    assert not any(finding.check == "chain" for finding in report.findings)
    scan = np.load(cell / "more.npy")
    np.save(cell / "rounded.npy", np.round(scan.astype(float), 1).astype(np.float32))
    other = run("inspect", cell / "rounded.npy", *of(cell), "--chain", cell / "chain.json")
    assert other.exit_code == 3
    assert "does not come from the chain that was qualified (cell 3" in " ".join(other.stdout.split())


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["-o", "chain.txt"], "expected a file ending in .json or .html"),
        (["--strip", "0,0,100,0,0.5,10"], "--strip: expected together with --strip-scan"),
        (["--strip", "0,0", "--strip-scan", "s.npy"], "--strip: expected six numbers"),
        (["--angles", "0"], "--angles: expected two numbers"),
    ],
)
def test_wrong_options_are_named(words, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run("qualify", "a.npy", "--reference", "r.npy", *words)
    assert done.exit_code == 2
    assert says in done.stderr
