"""A solve in one file: the same again."""

import numpy as np
import pytest

from debulk import InputError, sheet, solve, surface
from lab import kept_solves


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
    kept_solves.dump(tmp_path / "a.json", model, solution, starts=2, seed=3)
    again, options, ended = kept_solves.load(tmp_path / "a.json")
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
    kept_solves.dump(tmp_path / "a.json", model, solution)
    assert kept_solves.main([tmp_path / "a.json"]) == (0 if solution.certified else 1)
    text = capsys.readouterr().out
    assert "then: {'status': 'converged'" in text
    assert "now:" in text


def test_other_options_are_refused(model, tmp_path):
    kept_solves.dump(tmp_path / "c.json", model, solve.minimise(model), speed=3)
    with pytest.raises(InputError, match=r"c\.json: expected a solve"):
        kept_solves.load(tmp_path / "c.json")


@pytest.mark.parametrize("text", ["", "[1", "{}", '{"format": "debulk-solve-2"}', "\x00\xff"])
def test_what_is_no_dump_is_one_clear_error(tmp_path, text):
    (tmp_path / "solve.json").write_text(text)
    with pytest.raises(InputError, match=r"solve\.json"):
        kept_solves.load(tmp_path / "solve.json")
    with pytest.raises(InputError, match="cannot be read"):
        kept_solves.load(tmp_path / "none.json")
