"""A solve in one file: the same again."""

import json

import numpy as np
import pytest

import debulk
from debulk import InputError, Recipe, scenes, sheet, solve, surface
from debulk.inspection.minima import replay


@pytest.fixture
def model():
    """A ridge of three by five nodes on a mold much larger than it."""
    x = np.arange(-200.0, 201.0, 5.0)
    xx, yy = np.meshgrid(x, x)
    reference = surface.Reference((xx**2 + yy**2) / 4000, (-200.0, -200.0), 5.0)
    turns = np.radians([40.0, 10.0, -20.0, -40.0])
    along = np.concatenate([[[0.0, 0.0]], np.cumsum(5 * np.column_stack([np.cos(turns), np.sin(turns)]), axis=0)])
    nodes = np.array([(a, 5.0 * j, z + 0.5) for j in range(3) for a, z in along])
    number = np.arange(15).reshape(3, 5)
    padded = np.pad(number, 1, constant_values=-1)
    neighbours = np.stack([padded[1:-1, 2:], padded[1:-1, :-2], padded[2:, 1:-1], padded[:-2, 1:-1]], -1).reshape(-1, 4)
    kinds = np.where(np.isin(number % 5, (0, 4)), 1, 0).ravel()
    return sheet.Sheet(nodes, neighbours, kinds, 5.0, 300.0, reference)


def test_a_dumped_solve_is_done_again(model, tmp_path):
    solution = solve.minimise(model, starts=2, seed=3)
    replay.dump(tmp_path / "a.json", model, solution, starts=2, seed=3)
    again, options, ended = replay.load(tmp_path / "a.json")
    assert options == {"starts": 2, "seed": 3}
    assert ended["certified"] == solution.certified
    assert again.reference.heights_mm.size < model.reference.heights_mm.size
    assert again.ply == model.ply
    np.testing.assert_allclose(again.gaps(again.start_mm), model.gaps(model.start_mm), atol=1e-9)
    repeated = solve.minimise(again, **options)
    assert len(repeated.minima) == 2
    assert repeated.status == solution.status
    assert repeated.energy_mj == pytest.approx(solution.energy_mj, rel=1e-7)


def test_the_command_says_then_and_now(model, tmp_path, capsys):
    solution = solve.minimise(model)
    replay.dump(tmp_path / "a.json", model, solution)
    assert replay.main([tmp_path / "a.json"]) == (0 if solution.certified else 1)
    text = capsys.readouterr().out
    assert "then: {'status': 'converged'" in text
    assert "now:" in text


def test_other_options_are_refused(model, tmp_path):
    replay.dump(tmp_path / "c.json", model, solve.minimise(model), speed=3)
    with pytest.raises(InputError, match=r"c\.json: expected a solve"):
        replay.load(tmp_path / "c.json")


@pytest.mark.parametrize("text", ["", "[1", "{}", '{"format": "debulk-solve-2"}', "\x00\xff"])
def test_what_is_no_dump_is_one_clear_error(tmp_path, text):
    (tmp_path / "solve.json").write_text(text)
    with pytest.raises(InputError, match=r"solve\.json"):
        replay.load(tmp_path / "solve.json")
    with pytest.raises(InputError, match="cannot be read"):
        replay.load(tmp_path / "none.json")


def test_an_inspection_keeps_what_failed_and_what_was_slow(tmp_path, capsys):
    layup = scenes.layup(seed=0, pixels=(640, 480))
    folder = tmp_path / "solves"

    def inspect(**sections):
        sections.setdefault("run", {})["dump_folder"] = str(folder)
        sections["solve"] = {"when": "always"} | sections.get("solve", {})
        recipe = Recipe(segmentation={"area_tol_mm2": 5000.0}, **sections)  # the largest pockets
        return debulk.inspect(
            layup.scan, layup.reference, recipe, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
        )

    assert all(p.solve.certified for p in inspect().pockets)
    assert not folder.exists()
    assert len(inspect(run={"slow_ms": 1e-3}).pockets) == len(list(folder.iterdir())) > 1
    failed = inspect(solve={"max_iterations": 2}, verdict={"criterion": "paper"})
    assert {p.verdict for p in failed.pockets} == {"undecided"}
    kept = next(path for path in folder.iterdir() if not json.loads(path.read_text())["ended"]["certified"])
    assert replay.main([kept]) == 1
    assert "iteration" in capsys.readouterr().out


def test_a_folder_that_cannot_be_made_does_not_change_the_verdict(model, tmp_path, caplog):
    (tmp_path / "file").write_text("in the way")
    solution = solve.minimise(model)
    replay.keep(model, solution, False, 2.0, 7, Recipe(run={"dump_folder": str(tmp_path / "file"), "slow_ms": 1.0}))
    assert "pocket 7 could not be kept" in caplog.text
