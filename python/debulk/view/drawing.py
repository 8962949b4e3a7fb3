"""Draws the shapes with Open3D, which is imported only here, as it takes two seconds and 600 MB of disk."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
from os import PathLike
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.files.replacing import check_ending, write_picture
from debulk.report import Report
from debulk.view.shapes import Lines, Shapes, shapes

COMMAND = "pip install 'debulk[view]'"
_FIELD_DEG = 40.0  # of the camera, from top to bottom
_ROOM = 0.94  # share of the picture that may be used
_LINE_WIDTHS = {"nets": 2.5, "labels": 3.0}  # pixels
_PACKAGES = "libegl1 libgl1 libusb-1.0-0 libvulkan1 mesa-vulkan-drivers"


@typed
def view(
    report: Report,
    picture: str | PathLike[str] | None = None,
    *,
    pocket: int | None = None,
    magnify: float | None = None,
    size: tuple[int, int] = (1600, 1000),
) -> None:
    """Show a report in 3-D, or draw it into a file.

    Parameters
    ----------
    report
        The report. The ply after debulking with the predicted ridges is drawn, and every pocket's net before debulking
        over it, above the reference. A picture has a legend.
    picture
        Name of a .png to write without a screen. None opens a window, and returns when it is closed.
    pocket
        Number of the only pocket to draw. None draws all.
    magnify
        Factor by which heights are drawn larger than lengths. None: as large as the picture has room for.
    size
        Width and height of the picture or the window, pixels.

    Raises
    ------
    InputError
        If Open3D is missing (the message names the command that installs it) or cannot draw here, or an argument is
        wrong.
    """
    path = None if picture is None else Path(picture)
    if path is not None:
        check_ending(path, ".png")
    made = shapes(report, pocket, magnify)
    open3d = _open3d()
    if path is None:
        _window(open3d, made, size)
        return
    # If a driver is missing, Open3D ends the process, so it runs in a separate one.
    child = multiprocessing.get_context("spawn").Process(target=_draw, args=(made, str(path), size), daemon=True)
    child.start()
    child.join()
    if child.exitcode != 0 or not path.is_file():
        raise InputError(f"{path}: Open3D cannot draw without a screen here; on Debian it needs {_PACKAGES}")


def _window(open3d: Any, made: Shapes, size: tuple[int, int]) -> None:
    """Open a window and return when it is closed."""
    # Without a screen, Open3D opens an invisible window and waits for ever.
    seen = not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    window = open3d.visualization.Visualizer()
    if not (seen and window.create_window(f"debulk, heights x {made.magnify:g}", *size)):
        raise InputError("view: there is no screen to open a window on; with --png FILE it draws a picture without one")
    for geometry in _geometries(open3d, made).values():
        window.add_geometry(geometry)
    window.run()
    window.destroy_window()


def _open3d() -> Any:
    try:
        return importlib.import_module("open3d")
    except ImportError as error:
        if error.name == "open3d":
            raise InputError(f"view: Open3D is not installed; install it by {COMMAND}") from None
        raise InputError(f"view: Open3D cannot be loaded ({error}); on Debian it needs {_PACKAGES}") from None


def _geometries(open3d: Any, made: Shapes) -> dict[str, Any]:
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(made.points))
    cloud.colors = open3d.utility.Vector3dVector(made.point_rgb)
    return {"map": cloud, "nets": _line_set(open3d, made.lines), "labels": _line_set(open3d, made.labels)}


def _line_set(open3d: Any, lines: Lines) -> Any:
    made = open3d.geometry.LineSet(
        open3d.utility.Vector3dVector(lines.corners), open3d.utility.Vector2iVector(lines.segments)
    )
    made.colors = open3d.utility.Vector3dVector(lines.rgb)
    return made


def _draw(made: Shapes, path: str, size: tuple[int, int]) -> None:
    """Draw off-screen, obliquely from above; runs in a process of its own."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the renderer prints messages
    open3d = _open3d()
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    rendering = open3d.visualization.rendering
    renderer = rendering.OffscreenRenderer(*size)
    renderer.scene.set_background([1.0, 1.0, 1.0, 1.0])
    renderer.scene.view.set_post_processing(False)  # keeps the chosen colours
    everything = np.concatenate([made.points, made.lines.corners, made.labels.corners])
    low, high = everything.min(axis=0), everything.max(axis=0)
    reach = float(np.linalg.norm(high - low))
    for name, geometry in _geometries(open3d, made).items():
        material = rendering.MaterialRecord()
        material.shader = "defaultUnlit" if name == "map" else "unlitLine"
        material.line_width, material.point_size = _LINE_WIDTHS.get(name, 1.0), _point_size(made, reach, size)
        if not geometry.is_empty():
            renderer.scene.add_geometry(name, geometry, material)
    centre, eye = _camera(everything, size[0] / size[1])
    renderer.setup_camera(
        _FIELD_DEG, centre.astype(np.float32), eye.astype(np.float32), np.array([0, 0, 1], np.float32)
    )
    drawn = np.ascontiguousarray(np.asarray(renderer.render_to_image())[..., ::-1])
    _write_legend(drawn, made)
    write_picture(Path(path), drawn)


def _camera(points: Floats, aspect: float) -> tuple[Floats, Floats]:
    """Return where to look at and from where, so that all points just fit into the picture, obliquely from above."""
    ahead = np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    up = np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)
    right = np.array([1.0, 0.0, 0.0])
    tall = np.tan(np.radians(_FIELD_DEG / 2)) * _ROOM
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for _ in range(8):
        x, y, z = ((points - centre) @ axis for axis in (right, up, ahead))
        away = float(max((np.abs(x) / (tall * aspect) - z).max(), (np.abs(y) / tall - z).max()))
        u, v = x / (away + z), y / (away + z)
        centre = centre + 0.5 * away * ((u.max() + u.min()) * right + (v.max() + v.min()) * up)
    return centre, centre - away * ahead


def _write_legend(drawn: NDArray[np.uint8], made: Shapes) -> None:
    """Write what the colours mean, and by how much heights are magnified, into the upper left corner."""
    unit = max(drawn.shape[0] / 1000, 0.4)
    at = 0
    for (red, green, blue), words in (*made.legend, ((0.0, 0.0, 0.0), f"heights x {made.magnify:g}")):
        at += round(26 * unit)
        colour = tuple(round(255 * part) for part in (blue, green, red))
        cv2.rectangle(drawn, (round(16 * unit), at - round(14 * unit)), (round(40 * unit), at), colour, -1)
        place, black = (round(50 * unit), at), (20, 20, 20)
        cv2.putText(drawn, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.6 * unit, black, max(1, round(unit)), cv2.LINE_AA)


def _point_size(made: Shapes, reach: float, size: tuple[int, int]) -> float:
    """Size in pixels that closes the gaps of the map: the distance between its points as seen."""
    if len(made.points) == 0:
        return 2.0
    width, depth = np.ptp(made.points[:, :2], axis=0)
    distance = np.sqrt(max(width * depth, 1.0) / len(made.points))
    return float(np.clip(2.4 * distance * size[0] / reach, 2.0, 24.0))
