"""The open benchmark: its scenes are those of the committed hashes, and its scorer's figures are those of a hand."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "bench" / "open"))

import open_scenes
import scorer

import debulk

pytestmark = pytest.mark.layup
OPEN = Path(scorer.__file__).parent


@pytest.mark.parametrize("number", [2, 3])  # a ply with several pockets, and one with one
def test_a_scene_has_the_hash_that_is_listed(number):
    with (OPEN / "scenes.csv").open(newline="") as file:
        listed = {int(row["scene"]): row for row in csv.DictReader(file)}
    found = open_scenes.clouds(open_scenes.draw(number))
    assert open_scenes.digest(found) == listed[number]["sha256"]
    found["scan"][7, 9, 2] += 2e-3
    assert open_scenes.digest(found) != listed[number]["sha256"]


def test_a_pocket_stands_where_the_truth_says():
    scene = open_scenes.draw(3)
    found = open_scenes.clouds(scene)
    pose = scene.camera.mold_from_scanner
    rise = found["scan"][..., 2] - found["reference"][..., 2]
    row, column = np.unravel_index(np.nanargmin(rise), rise.shape)  # nearest to the camera
    top = found["scan"][row, column] @ pose[:3, :3].T + pose[:3, 3]
    pockets, _ = scorer.truths(OPEN / "pockets.csv")
    (only,) = np.flatnonzero(pockets["scene"] == 3)
    assert np.hypot(top[0] - pockets["x_mm"][only], top[1] - pockets["y_mm"][only]) < 5


@pytest.mark.parametrize(
    "number", [88, 146, 197]
)  # steep flanks, a fold on a bell, and lobes: 0.03 to 0.06 mm too low before
def test_the_true_ridge_lies_between_the_ends_of_its_range(number):
    scene = open_scenes.draw(number)
    recipe = debulk.Recipe(material={"thickness_mm": scene.ply.thickness_mm})
    angles = (scene.fibre_deg, scene.fibre_deg + 90)
    found = open_scenes.clouds(scene)
    report = debulk.inspect(
        found["scan"], found["reference"], recipe, scene.ply.outline, angles, scene.camera.mold_from_scanner
    )
    with (OPEN / "pockets.csv").open(newline="") as file:
        of = {(int(row["scene"]), int(row["pocket"])): float(row["excess_mm"]) for row in csv.DictReader(file)}
    compared = 0
    for k, lift in enumerate(scene.ply.bells):
        true_mm = of[number, k] / 2 + (2 - np.pi / 2) * scene.ply.thickness_mm
        near = [p for p in report.pockets if np.hypot(*(p.outline_mm.mean(axis=0) - (lift.x, lift.y))) < lift.a]
        for p in (p for p in near if p.excess is not None and 0.45 < true_mm < 0.75):
            low, high = p.excess.range_mm
            assert true_mm - 0.1 < low < true_mm + 0.01
            assert true_mm <= high < true_mm + 0.2
            compared += 1
    assert compared


SHARES = np.array([1.0, 0.5, 0.0, 0.0])  # of scenes 0 to 3


def answers(tmp_path, text):
    path = tmp_path / "answers.csv"
    path.write_text(text)
    return scorer.read(path)


def test_the_scores_are_those_of_a_hand(tmp_path):
    said = answers(tmp_path, "scene,verdict,score\n0,CREASE,3\n1,cease,1\n2,CREASE,2\n3,UNDECIDED,0\n")
    found = scorer.score(scorer.of_plies(said, 4), SHARES)
    assert (found["escapes"], found["false alarms"], found["UNDECIDED"]) == (1, 1, 1)
    assert found["AUC"] == 0.75  # of the four pairs, (1, 2) is in the wrong order
    assert found["alarms at no escape"] == 1  # scene 2 lies above the least score of those that crease
    assert found["at most"] == pytest.approx(np.sqrt(0.95), abs=1e-9)  # 1 of 2: p with 1 - p^2 = 0.05
    assert "Brier" not in found


def test_probabilities_have_a_brier_score_against_the_share(tmp_path):
    said = answers(tmp_path, "scene,probability\n0,0.9\n1,0.5\n2,0.2\n")  # nothing about scene 3: 0
    found = scorer.score(scorer.of_plies(said, 4), SHARES)
    assert found["Brier"] == pytest.approx((0.1**2 + 0 + 0.2**2 + 0) / 4)
    assert found["AUC"] == 1.0
    assert "escapes" not in found


def test_a_ply_is_the_worst_of_its_pockets_and_a_pocket_that_nobody_names_ceases(tmp_path):
    said = answers(tmp_path, "scene,x_mm,y_mm,verdict\n0,3,4,CREASE\n0,49,0,CREASE\n1,30,0,CREASE\n")
    plies = scorer.score(scorer.of_plies(said, 4), SHARES)
    assert (plies["escapes"], plies["false alarms"]) == (0, 0)
    columns = {"scene": [0, 0, 1], "x_mm": [0, 50, 0], "y_mm": [0, 0, 0], "radius_mm": [10, 10, 10]}
    pockets = scorer.of_pockets(said, {name: np.array(values) for name, values in columns.items()})
    found = scorer.score(pockets, np.array([1.0, 0.0, 0.5]))
    assert (found["escapes"], found["false alarms"]) == (1, 1)


@pytest.mark.parametrize(("events", "trials", "bound"), [(0, 100, 0.029513), (3, 50, 0.147837), (5, 5, 1.0)])
def test_the_upper_bound_is_that_of_clopper_and_pearson(events, trials, bound):
    assert scorer.upper_bound(events, trials) == pytest.approx(bound, abs=2e-6)


@pytest.mark.parametrize(
    ("row", "named"),
    [("0,maybe,", "MAYBE"), ("0,,1.5", "from 0 to 1"), ("x,CEASE,", "line 2"), ("200,CEASE,", "to 199")],
)
def test_a_bad_row_is_named(tmp_path, row, named):
    with pytest.raises(ValueError, match=named):
        answers(tmp_path, f"scene,verdict,probability\n{row}\n")
