"""Poses in the files of many programs, written by others than debulk; what is ambiguous is refused by name."""

import json
import logging

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from debulk import InputError, arrays, files

POSE = np.eye(4)
POSE[:3, :3] = Rotation.from_rotvec([0.1, -0.7, 2.0]).as_matrix()
POSE[:3, 3] = 10, -20.25, 2400.5
ROWS = POSE.tolist()
FLAT = POSE.ravel().tolist()
R, T = POSE[:3, :3], POSE[:3, 3]


def in_lines(rows, separator=" ", comma=False):
    text = "\n".join(separator.join(map(repr, row)) for row in rows)
    return text.replace(".", ",") if comma else text


def blocks(rows):
    """Write nested lists as PyYAML does by default."""
    return "".join("".join(("- - " if k == 0 else "  - ") + f"{v!r}\n" for k, v in enumerate(row)) for row in rows)


TEXTS = {
    "four.txt": in_lines(ROWS),
    "three.txt": in_lines(ROWS[:3], ", "),
    "line.txt": in_lines([FLAT]),
    "line.csv": in_lines([FLAT], ","),
    "kitti.txt": in_lines([FLAT[:12]]),
    "commas.csv": in_lines(ROWS, ";", comma=True),
    "blanks.txt": "# cell 7\n" + in_lines(ROWS, "\t", comma=True),
    "numpy.txt": np.array2string(POSE, precision=17),
    "matlab.txt": "[" + "; ".join(" ".join(map(repr, row)) for row in ROWS) + "]",
    "lists.json": json.dumps(ROWS),
    "flat.json": json.dumps(FLAT),
    "matrix.json": json.dumps({"name": "cell 7", "pixels": [1280, 960], "matrix": ROWS}),
    "parts.json": json.dumps({"pose": {"rotation": R.tolist(), "translation": T.tolist()}}),
    "zivid.yaml": "__version__:\n  serializer: 1\n  data: 1\nFloatMatrix:\n  Data:\n    [\n      "
    + ",\n      ".join(map(str, ROWS)) + "\n    ]\n",
    "zivid_short.yaml": f"__version__: 1\nFloatMatrix:\n  Data: {ROWS}\n",
    "rows.yaml": "pose:\n" + "".join(f"  - {row}\n" for row in ROWS),
    "blocks.yaml": "pose:\n" + blocks(ROWS),
    "parts.yaml": f"a: 3\nrotation: {R.tolist()}\ntranslation: {T.tolist()}\n",
}  # fmt: skip


@pytest.mark.parametrize("name", TEXTS)
def test_text_json_and_yaml(tmp_path, name):
    (tmp_path / name).write_text(TEXTS[name])
    np.testing.assert_allclose(files.load_pose(tmp_path / name), POSE, atol=1e-12)
    np.testing.assert_allclose(files.load_pose(tmp_path / name, "m")[:3, 3], 1000 * T)


@pytest.mark.parametrize("ending", ["yml", "yaml", "xml", "json"])
def test_opencv(tmp_path, ending):
    def write(**matrices):
        storage = cv2.FileStorage(str(tmp_path / f"p.{ending}"), cv2.FILE_STORAGE_WRITE)
        storage.write("serial", 7)
        for name, matrix in matrices.items():
            storage.write(name, np.asarray(matrix))
        storage.release()
        return tmp_path / f"p.{ending}"

    np.testing.assert_allclose(files.load_pose(write(camera=np.eye(3), pose=POSE)), POSE, atol=1e-12)
    np.testing.assert_allclose(files.load_pose(write(R=R, T=T.reshape(3, 1), D=np.zeros((1, 5)))), POSE, atol=1e-12)
    np.testing.assert_allclose(files.load_pose(write(pose=POSE.astype("f4"))), POSE, rtol=1e-6, atol=1e-6)
    for matrices, part in (
        ({"left": POSE, "right": POSE}, "expected one pose, got 2: left, right: keep one"),
        ({"R": R, "rotation": R, "T": T.reshape(3, 1)}, "expected one rotation and one translation, got 3"),
        ({"K": R}, "called translation, got K"),
    ):
        with pytest.raises(InputError, match=part):
            files.load_pose(write(**matrices))


@pytest.mark.parametrize(
    ("name", "text", "part"),
    [
        ("p.txt", in_lines([POSE.T.ravel().tolist()]), "it stands by columns, with the translation in the last line"),
        ("p.json", json.dumps(POSE.T.tolist()), "it stands by columns"),
        ("p.csv", in_lines(ROWS, ",", comma=True), "got 4 of 8 (decimal commas between commas?)"),
        ("p.csv", in_lines(ROWS, ";", comma=True).replace("0,0;0,0;0,0", "0.0;0,0;0,0"), "decimal points or decimal"),
        ("p.txt", in_lines([[1.0, 2.0, 3.0]] * 3), "three lines of four, or one line of 16 by rows, got 3 of 3"),
        ("p.json", json.dumps([ROWS, ROWS]), "expected one pose, got 2: [0], [1]"),
        ("p.json", json.dumps({"rotation": [0, 0, 0, 1], "translation": [1, 2, 3]}), "got rotation 1x4"),
        ("p.json", "{", "not readable JSON"),
        ("p.json", "[" * 100_000, "lists inside lists"),
        ("p.json", '{"m": [[1e999, 0], [0, 1]]}', "m: expected finite numbers"),
        ("p.json", "[" + "9" * 400 + ", 1]", "expected finite numbers"),
        ("p.json", "[[1, 2], [3]]", "its lines have different lengths"),
        ("p.yml", "A: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [1.]\n", "4 x 4 numbers"),
        ("p.xml", "<?xml version='1.0'?><a/>", "got none"),
    ],
)  # fmt: skip
def test_what_is_ambiguous_is_refused(tmp_path, name, text, part):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        files.load_pose(tmp_path / name)
    assert part in str(caught.value) and str(caught.value).startswith(str(tmp_path / name))


@pytest.mark.parametrize("decimals", [2, 3, 4, 5, 6])
def test_poses_that_lack_digits(decimals, caplog):
    rng = np.random.default_rng(decimals)
    warned = 0
    for k in range(500):
        turned = Rotation.random(random_state=rng) if k % 2 else Rotation.from_rotvec(rng.normal(0, 0.1, 3))
        pose = POSE.copy()
        pose[:3, :3] = turned.as_matrix().round(decimals)
        caplog.clear()
        if decimals == 2:
            with pytest.raises(InputError, match=r"^p: .* (has only 2 decimals: over 1 m it changes lengths|scales)"):
                arrays.rigid(pose, "p")
            continue
        found = arrays.rigid(pose.astype(np.float32) if k % 5 == 0 else pose, "p")[:3, :3]
        warned += "p: its rotation has only" in caplog.text and "per metre of distance: write 6 decimals" in caplog.text
        assert np.abs(found @ found.T - np.eye(3)).max() < 1e-14
        assert (Rotation.from_matrix(found) * turned.inv()).magnitude() < 1.1 * 10.0**-decimals  # as the warning says
    assert {2: 0, 3: 490}.get(decimals, 0) <= warned <= {3: 500, 4: 200}.get(decimals, 0)


@pytest.mark.parametrize("wrong", [1.001 * R, 1.0005 * R, R @ np.diag([1, 1, 1.002]), R + [[0, 0.003, 0]] * 3])
def test_what_rounding_does_not_explain_is_refused(wrong):
    pose = POSE.copy()
    pose[:3, :3] = wrong
    with pytest.raises(
        InputError, match=r"scales or shears: over 1 m it changes lengths by up to .* mm and right angles"
    ):
        arrays.rigid(pose, "p")
    pose[:3, :3] = R
    assert arrays.rigid(pose, "p").tobytes() == pose.tobytes()


def test_the_warning_reaches_who_loads(tmp_path, caplog):
    (tmp_path / "p.txt").write_text("\n".join(" ".join(f"{v:.3f}" for v in row) for row in ROWS))
    with caplog.at_level(logging.WARNING):
        found = files.load_pose(tmp_path / "p.txt")
    np.testing.assert_allclose(found, POSE, atol=1e-3)
    assert "p.txt: its rotation has only 3 decimals: over 1 m it changes lengths by up to" in caplog.text
    assert "turned by up to 1.1 mm per metre of distance" in caplog.text


PIECES = st.sampled_from(
    ["[", "]", "{", "}", ",", ":", "\n", "- ", "  ", " ", "1", "0.5", "-1e3", "nan", '"', "a", "R", "rotation", "data",
     "%YAML:1.0\n---\n", "!!opencv-matrix\n", "rows: 3\n", "cols: 3\n", "dt: d\n", "data: [", "<?xml?>", "<data>", "#",
     '<m type_id="opencv-matrix">', "<rows>4</rows>", "\0", "\xe9", "translation: [1, 2, 3]\n", ";"]
)  # fmt: skip


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    ending=st.sampled_from(["txt", "json", "yml", "xml", "csv"]),
    parts=st.lists(PIECES, max_size=40),
    name=st.sampled_from(sorted(TEXTS)),
    cut=st.tuples(st.floats(0, 1), st.floats(0, 1)),
)
def test_anything_else_is_one_error(tmp_path, ending, parts, name, cut):
    place, end = sorted(int(share * len(TEXTS[name])) for share in cut)
    for text in ("".join(parts), TEXTS[name][:place] + "".join(parts) + TEXTS[name][end:]):
        path = tmp_path / f"p.{ending}"
        path.write_text(text)
        try:
            assert files.load_pose(path).shape == (4, 4)
        except InputError as error:
            assert str(error).startswith(str(path))
