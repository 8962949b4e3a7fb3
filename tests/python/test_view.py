"""What is drawn is tested without Open3D; that it can be drawn, only where the extra is installed."""

import dataclasses
import importlib.util
import subprocess
import sys
import types

import numpy as np
import pytest

import debulk
from debulk.view import shapes, view

HAS_OPEN3D = importlib.util.find_spec("open3d") is not None


def test_all_pockets(report):
    made = shapes(report, magnify=10.0)
    edges = sum(len(p.outline_mm) + (0 if p.net is None else len(p.net.edges)) for p in report.pockets)
    strong = [p for p in report.pockets if p.deciding_ridge and p.deciding_ridge.most_mm > 0.6]
    edges += sum(len(line) - 1 for p in strong for one in p.ridges for line in one.lines_mm)
    assert made.lines.segments.shape == (edges, 2)
    assert made.lines.rgb.shape == (edges, 3)
    assert made.lines.segments.min() == 0
    assert made.lines.segments.max() == len(made.lines.corners) - 1
    assert made.lines.corners[:, 2].max() == pytest.approx(
        10 * max(p.initial_gap_mm.max() for p in report.pockets if p.net)
    )
    assert len(made.points) == len(made.point_rgb) <= 400_000
    assert 0 <= made.point_rgb.min() <= made.point_rgb.max() <= 1


def test_there_is_ply_wherever_the_scan_saw_some_and_no_spike_of_the_coarse_net(report):
    """Inside the nets the ply after debulking is drawn, outside them the map, and nowhere a hole."""
    known = report.pockets[1]
    top = int(np.argmax(known.initial_gap_mm))
    spike, ridge = np.zeros_like(known.debulked_gap_mm), np.full_like(known.post_processed_gap_mm, 0.25)
    spike[top], ridge[top] = 5.0, 1.1
    p = dataclasses.replace(known, debulked_gap_mm=spike, post_processed_gap_mm=ridge)
    pockets = (report.pockets[0], p, *report.pockets[2:])
    made = shapes(dataclasses.replace(report, pockets=pockets), pocket=2, magnify=1.0)
    inside = made.points[np.hypot(*(made.points[:, :2] - p.centroid_mm).T) < 40]
    cells = {tuple(cell) for cell in np.floor(inside[:, :2] / 4).astype(int).tolist()}
    x, y = np.floor(np.array(p.centroid_mm) / 4).astype(int)
    assert all((x + i, y + j) in cells for i in range(-6, 7) for j in range(-6, 7))
    assert 1.0 < inside[:, 2].max() <= 1.1 + 1e-9
    blue, orange = inside[:, 2] < 0.59, inside[:, 2] > 0.61
    rgb = made.point_rgb[np.hypot(*(made.points[:, :2] - p.centroid_mm).T) < 40]
    assert (rgb[blue, 2] > rgb[blue, 0]).all() and (rgb[orange, 0] > rgb[orange, 2]).all()


def test_the_map_is_not_one_flat_colour_and_a_legend_names_all(report):
    made = shapes(report)
    assert len(np.unique(made.point_rgb.round(3), axis=0)) > 60
    words = [text for _, text in made.legend]
    for told in (
        "CREASE",
        "before debulking",
        "below the limit of 0.6 mm",
        "above the limit",
        "ridge",
        "rest of the ply",
    ):
        assert any(told in text for text in words)


@pytest.mark.parametrize("pocket", [None, 2, 7])
def test_everything_fits_into_the_picture(report, pocket):
    from debulk.view.drawing import _camera

    made = shapes(report, pocket)
    every = np.concatenate([made.points, made.lines.corners, made.labels.corners])
    centre, eye = _camera(every, 1.6)
    ahead = (centre - eye) / np.linalg.norm(centre - eye)
    right = np.array([1.0, 0.0, 0.0])
    z = (every - eye) @ ahead
    across, up = ((every - eye) @ axis / z / np.tan(np.radians(20)) for axis in (right, np.cross(right, ahead)))
    assert np.abs(across).max() <= 1.6 and np.abs(up).max() <= 1.0
    assert max(np.abs(across).max() / 1.6, np.abs(up).max()) > 0.85  # and fills it


def test_the_magnification_that_is_chosen_fits_the_picture(report):
    made = shapes(report)
    width = np.ptp(np.concatenate([made.points, made.lines.corners])[:, :2], axis=0).max()
    assert made.magnify > 1
    assert made.lines.corners[:, 2].max() <= 0.3 * width


def test_without_a_screen_a_window_is_refused(report, monkeypatch):
    def window(*_args):
        raise AssertionError("Open3D would wait for ever")

    utility = types.SimpleNamespace(set_verbosity_level=lambda _: None, VerbosityLevel=types.SimpleNamespace(Error=0))
    visualization = types.SimpleNamespace(Visualizer=lambda: types.SimpleNamespace(create_window=window))
    fake = types.SimpleNamespace(utility=utility, visualization=visualization)
    monkeypatch.setitem(sys.modules, "open3d", fake)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(debulk.InputError, match="--png"):
        view(report)


def test_one_pocket_keeps_its_lengths(report):
    p = report.pockets[1]
    made = shapes(report, pocket=2, magnify=1.0)
    first = len(p.outline_mm)
    a, b = (made.lines.corners[made.lines.segments[first : first + len(p.net.edges), k]] for k in (0, 1))
    i, j = p.net.edges.T
    assert np.allclose((a - b)[:, :2], (p.net.nodes_mm[i] - p.net.nodes_mm[j])[:, :2])
    assert np.allclose(made.lines.corners[first : first + len(p.net.nodes_mm), 2], p.initial_gap_mm)
    assert (np.abs(made.points[:, :2] - p.outline_mm.mean(axis=0)) < 300).all()


def test_every_pocket_has_its_number_above_it_and_the_scales_are_true(report):
    made = shapes(report, magnify=4.0)
    heights = made.labels.corners[made.labels.segments]
    for pocket in report.pockets:
        x, y = pocket.centroid_mm
        near = (abs(heights[:, :, 0] - x) < 40).all(axis=1) & (abs(heights[:, :, 1] - y) < 1).all(axis=1)
        strokes = sum({"1": 2, "7": 3, "4": 4, "0": 6, "6": 6, "8": 7}.get(digit, 5) for digit in str(pocket.id))
        assert near.sum() == strokes + 1  # and the pin
        assert heights[near][:, :, 2].min() == pytest.approx(4.0 * pocket.peak_mm)
    bars = heights[heights[:, :, 2].min(axis=1) == 0]
    longest = np.abs(bars[:, 1] - bars[:, 0]).max(axis=0)
    assert longest[0] == 200.0 and longest[2] / 4.0 == pytest.approx(10.0)  # the ply is 1140 mm long, a pocket 15 high


def test_single_points_that_stray_are_not_drawn(report):
    values = report.height_map.values.copy()
    values[10:12, 10:12] = 80.0
    values[-5, -5] = -60.0
    stray = dataclasses.replace(report, height_map=dataclasses.replace(report.height_map, values=values))
    stray = dataclasses.replace(stray, ply_outline_mm=None)
    made = shapes(stray, magnify=1.0)
    assert made.points[:, 2].max() <= max(p.peak_mm for p in report.pockets)
    assert made.points[:, 2].min() > -1.0


@pytest.mark.parametrize(("more", "words"), [({"pocket": 99}, "pocket"), ({"magnify": 0.0}, "magnify")])
def test_bad_arguments(report, more, words):
    with pytest.raises(debulk.InputError, match=words):
        shapes(report, **more)


def test_nothing_to_draw():
    with pytest.raises(debulk.InputError, match="neither"):
        shapes(debulk.Report(verdict=debulk.Verdict.CEASE, reason="", pockets=()))


def test_the_missing_extra_is_named_with_its_command(report, monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(debulk.InputError, match=r"pip install 'debulk\[view\]'"):
        view(report, "net.png")


def test_the_package_does_not_load_open3d():
    script = "import sys, debulk.view; sys.exit('open3d' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


@pytest.mark.skipif(not HAS_OPEN3D, reason="the extra view is not installed")
def test_a_picture(report, tmp_path):
    view(report, tmp_path / "net.png", size=(320, 200))
    assert (tmp_path / "net.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(debulk.InputError, match=r"\.png"):
        view(report, tmp_path / "net.gif")
