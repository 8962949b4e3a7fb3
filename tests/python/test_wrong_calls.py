"""Wrong calls of the public API: each is answered by one clear error that names the argument."""

import pathlib
import re

import numpy as np
import pytest

import debulk
from debulk import InputError
from debulk.recipe import Net

FLAT = debulk.surface.Reference(np.zeros((20, 20)), (0, 0), 5.0)
SQUARE = [[20, 20], [80, 20], [80, 80], [20, 80]]
CLOUD = np.zeros((4, 5, 3))
HEIGHTS = debulk.Grid(np.zeros((9, 9)), np.zeros(2), 2.0)
PATH = pathlib.Path("ref.pcd")
recipe = debulk.Recipe()


def inspector(reference=CLOUD, **more):
    return debulk.Inspector(more.pop("recipe", None), reference, **more)


def net(**more):
    return debulk.net.fibre_net(FLAT, FLAT, (50, 50), (0, 90), **{"spacing_mm": 5.0, "outline_mm": SQUARE, **more})


# By the argument that the error begins with: what is called, and a word that says what came or what was expected.
CALLS = {
    "recipe": [
        (lambda: inspector(recipe="cell.toml"), "'cell.toml'; debulk.Recipe.load"),
        (lambda: inspector(recipe=PATH), "'ref.pcd'; debulk.Recipe.load"),
        (lambda: inspector(recipe={"material": {}}), "a dict"),
        (lambda: debulk.section.fold(0.5, 20.0, recipe="x"), "'x'"),
        (lambda: debulk.Inspector.load("i.npz", recipe=3), "got 3"),
    ],
    "material.young_mpa, loads.pressure_mpa": [
        (lambda: inspector(recipe=debulk.Recipe(material={"young_mpa": 0.36})), "0.36 MPa under 0.1 MPa"),
        (
            lambda: inspector(recipe=debulk.Recipe(material={"young_mpa": 3.6}, loads={"pressure_mpa": 1.0})),
            "not GPa or bar",
        ),
    ],
    "reference": [
        (lambda: inspector(None), "got None"),
        (lambda: inspector("ref.pcd"), "'ref.pcd'; debulk.files.load_cloud"),
        (lambda: inspector(PATH), "'ref.pcd'; debulk.files.load_cloud"),
        (lambda: inspector(3.0), "got 3.0"),
        (lambda: inspector(["a", "b"]), "a list of text"),
        (lambda: inspector({"points": CLOUD}), "a dict"),
        (lambda: inspector([]), "shape (0,)"),
        (
            lambda: inspector(np.zeros((5, 5))),
            "shape (5, 5); where x, y, z are its first columns, pass points[..., :3]",
        ),
        (lambda: inspector(np.zeros((3, 9, 5))), "pass numpy.moveaxis(points, 0, -1)"),
        (lambda: inspector(np.zeros((5, 5, 3), int)), "int64"),
        (lambda: inspector([[1.0, 2.0, 3.0], [1.0]]), "different lengths"),
    ],
    "ply_outline": [
        (lambda: inspector(ply_outline="ply.csv"), "'ply.csv'"),
        (lambda: inspector(ply_outline=3), "got 3"),
        (lambda: inspector(ply_outline=["a", "b", "c"]), "a list of text"),
        (lambda: inspector(ply_outline={"x": 1}), "a dict"),
        (lambda: inspector(ply_outline=[[1, 2], [3]]), "corners"),
    ],
    "fibre_angles_deg": [
        (lambda: inspector(fibre_angles_deg=None), "got None"),
        (lambda: inspector(fibre_angles_deg="0,90"), "'0,90'"),
        (lambda: inspector(fibre_angles_deg=45), "got 45"),
        (lambda: inspector(fibre_angles_deg=("0", "90")), "a tuple of text"),
    ],
    "mold_from_scanner": [
        (lambda: inspector(mold_from_scanner="pose.txt"), "'pose.txt'"),
        (lambda: inspector(mold_from_scanner=1.0), "got 1.0"),
        (lambda: inspector(mold_from_scanner=np.eye(3)), "shape (3, 3)"),
    ],
    "camera": [(lambda: inspector(camera=900), "got 900"), (lambda: inspector(camera="900,2,1"), "'900,2,1'")],
    "mask": [
        (lambda: inspector(mask="mask.png"), "'mask.png'"),
        (lambda: inspector(mask=True), "got True"),
        (lambda: inspector(mask=[[True], []]), "different lengths"),
        (lambda: inspector(mask=np.zeros((4, 5), int)), "int64"),
    ],
    "scan": [
        (lambda: debulk.surface.height_map("a", FLAT), "'a'; debulk.files"),
        (lambda: debulk.surface.height_map(None, FLAT), "got None"),
    ],
    "deadline_s": [
        (lambda: debulk.inspect(CLOUD, CLOUD, deadline_s="1"), "'1'"),
        (lambda: debulk.inspect(CLOUD, CLOUD, deadline_s=np.ones(2)), "an array"),
        (lambda: debulk.inspect(CLOUD, CLOUD, deadline_s=10**400), "got 1000000"),
    ],
    "progress": [(lambda: debulk.inspect(CLOUD, CLOUD, progress=True), "got True")],
    "report": [
        (lambda: debulk.compare("r.json", CLOUD, CLOUD), "'r.json'; debulk.Report.load"),
        (lambda: debulk.compare(None, CLOUD, CLOUD), "got None"),
        (lambda: debulk.repeat(PATH, CLOUD, CLOUD), "'ref.pcd'; debulk.Report.load"),
    ],
    "path": [
        (lambda: debulk.Report.load(None), "got None"),
        (lambda: debulk.Comparison.load(3), "got 3"),
        (lambda: debulk.Recipe.load({}), "a dict"),
        (lambda: debulk.Inspector.load(CLOUD), "an array"),
        (lambda: debulk.files.load_cloud(None), "got None"),
        (lambda: debulk.files.load_pose(3), "got 3"),
        (lambda: debulk.files.load_outline(["a.csv"]), "a list"),
        (lambda: debulk.files.load_mask(""), "got ''"),
        (lambda: debulk.scanner.Calibration.load(None), "got None"),
    ],
    "unit": [
        (lambda: debulk.files.load_cloud("a.pcd", unit=["mm"]), "['mm']"),
        (lambda: debulk.files.load_cloud("a.pcd", unit=None), "None"),
    ],
    "points": [
        (lambda: debulk.files.save_cloud("a.pcd", "points"), "'points'"),
        (lambda: debulk.files.save_cloud("a.pcd", [[1.0, 2.0, 3.0], [1.0]]), "different lengths"),
        (lambda: debulk.cloud.remove_outliers(None), "got None"),
    ],
    "neighbours": [(lambda: debulk.cloud.remove_outliers(CLOUD, neighbours=4.5), "4.5")],
    "std_ratio": [(lambda: debulk.cloud.remove_outliers(CLOUD, std_ratio=None), "got None")],
    "material": [
        (lambda: debulk.Recipe(material=3), "got 3"),
        (lambda: debulk.Recipe(material=None), "got None"),
        (lambda: debulk.Recipe(material=Net()), "a table"),
        (lambda: debulk.Recipe.model_validate({"material": 3}), "got 3"),
        (lambda: setattr(recipe, "material", 3), "does not change"),
        (lambda: delattr(recipe, "material"), "does not change"),
    ],
    "material.1": [(lambda: debulk.Recipe(material={1: 2}), "text")],
    "material.thickness_mm": [(lambda: debulk.Recipe(material={"thickness_mm": "0.2"}), "'0.2'")],
    "materiel": [(lambda: debulk.Recipe(materiel={}), "did you mean material")],
    "thickness_mm": [(lambda: setattr(recipe.material, "thickness_mm", 3), "does not change")],
    "update": [(lambda: recipe.model_copy(update=3), "got 3")],
    "obj": [(lambda: debulk.Recipe.model_validate(3), "got 3")],
    "json_data": [(lambda: debulk.Recipe.model_validate_json("{"), "JSON")],
    "seed": [(lambda: debulk.scenes.layup(seed="a"), "'a'")],
    "scale_mm": [(lambda: debulk.files.load_heights("a.csv", (1, 1), scale_mm=0), "got 0")],
    "pixels": [
        (lambda: debulk.scenes.layup(pixels=640), "640"),
        (lambda: debulk.scanner.fringe_patterns(pixels="a"), "'a'"),
    ],
    "heights_mm": [(lambda: debulk.surface.Reference("a", (0, 0), 1.0), "'a'")],
    "spacing_mm": [
        (lambda: debulk.surface.Reference(np.zeros((9, 9)), (0, 0), "1"), "'1'"),
        (lambda: debulk.net.drape(FLAT, (50, 50), (0, 90), None), "got None"),
        (lambda: debulk.Grid(np.zeros((9, 9)), (0, 0), None), "got None"),
        (lambda: net(spacing_mm="a"), "'a'"),
    ],
    "origin_mm": [
        (lambda: debulk.surface.Reference(np.zeros((9, 9)), 3, 1.0), "got 3"),
        (lambda: debulk.Grid(np.zeros((9, 9)), "a", 1.0), "'a'"),
    ],
    "values": [(lambda: debulk.Grid("a", (0, 0), 1.0), "'a'")],
    "xy": [(lambda: FLAT.height("a"), "'a'"), (lambda: FLAT.height(3.0), "got 3.0")],
    "height_map": [
        (lambda: debulk.pocket.segment(np.zeros((5, 5))), "an array"),
        (lambda: debulk.pocket.segment(None), "None"),
    ],
    "cut_height_mm": [(lambda: debulk.pocket.segment(HEIGHTS, cut_height_mm="2"), "'2'")],
    "paths": [(lambda: net(paths="straight"), "straight"), (lambda: net(paths=None), "None")],
    "nodes_mm": [(lambda: debulk.sheet.Sheet("a", "b", "c", 1.0, 1.0, FLAT), "'a'")],
    "kinds": [(lambda: debulk.sheet.Sheet(np.zeros((1, 3)), [[-1] * 4], "c", 1.0, 1.0, FLAT), "'c'")],
    "sheet": [(lambda: debulk.solve.minimise(None), "got None; debulk.sheet.Sheet()")],
    "ply_length_mm": [(lambda: debulk.ridge.ridge_height("a", 1, 0.3), "'a'")],
    "excess_length_mm": [(lambda: debulk.section.fold("a", 1.0), "'a'")],
    "pressure": [(lambda: debulk.section.fold(0.5, 20.0, pressure="down"), "down")],
    "rms_mm": [(lambda: debulk.verdict.judge(certified=True, rms_mm="a"), "'a'")],
    "max_rms_mm": [(lambda: debulk.verdict.Criteria(max_rms_mm="a"), "'a'")],
    "images": [(lambda: debulk.scanner.decode(None), "None")],
    "calibration": [
        (lambda: debulk.scanner.Scanner("c"), "'c'; debulk.scanner.Calibration.load"),
        (lambda: debulk.scanner.triangulate(CLOUD, CLOUD, "c"), "'c'"),
    ],
    "layup": [(lambda: debulk.scenes.fringe_images("a"), "'a'; debulk.scenes.layup")],
}
TABLE = [(name, call, word) for name, calls in CALLS.items() for call, word in calls]
MACHINERY = ("pydantic", "attribute", "shape ()", "validation", "incompatible", "NoneType", "ndarray", "PosixPath")


@pytest.mark.parametrize(("name", "call", "word"), TABLE, ids=[f"{name} {k}" for k, (name, _, _) in enumerate(TABLE)])
def test_one_clear_error_names_the_argument(name, call, word):
    with pytest.raises(InputError) as caught:
        call()
    said = str(caught.value)
    assert said.startswith(f"{name}: ") and word in said
    assert "\n" not in said and len(said) < 250
    assert not any(word in said for word in MACHINERY)


def test_a_report_refuses_wrong_calls(report):
    for call, begins in (
        (lambda: report.save(None), "path: expected the name of a file, but got None"),
        (lambda: report.pocket("2"), "number: expected the number of a pocket of this report (1, 2"),
        (lambda: report.plot("ax"), "ax: expected axes of Matplotlib, but got 'ax'"),
    ):
        with pytest.raises(InputError, match=re.escape(begins)):
            call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: inspector(outline=SQUARE),
        lambda: debulk.inspect(CLOUD, CLOUD, poses=3),
        lambda: debulk.Recipe("cell.toml"),
        lambda: debulk.pocket.segment(HEIGHTS, cut=2.0),
    ],
)
def test_a_wrong_keyword_is_a_type_error(call):
    with pytest.raises(TypeError, match=r"keyword|positional"):
        call()


def test_what_is_right_is_let_through():
    assert debulk.section.fold(np.float32(0.5), np.array(20.0), segments=np.int64(60)).height_mm > 0
    assert debulk.surface.Reference(np.zeros((9, 9)), (0, 0), 1).height((3, 3)) == 0.0
