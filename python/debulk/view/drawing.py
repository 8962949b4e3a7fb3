"""Draws the shapes with Open3D, which is imported only here, as it takes two seconds and 600 MB of disk."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from debulk._core import InputError
from debulk.arguments import typed
from debulk.report import Report
from debulk.view.shapes import Lines, Shapes, shapes

__all__ = ["view"]

COMMAND = "pip install 'debulk[view]'"
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
        The report. Its height map, outlines, and every pocket's net before and after debulking are drawn, above the
        reference.
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
    if path is not None and path.suffix.lower() != ".png":
        raise InputError(f"{path}: expected a file ending in .png")
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
    centre, reach = 0.5 * (low + high), float(np.linalg.norm(high - low))
    for name, geometry in _geometries(open3d, made).items():
        material = rendering.MaterialRecord()
        material.shader = "defaultUnlit" if name == "map" else "unlitLine"
        material.line_width, material.point_size = _LINE_WIDTHS.get(name, 1.0), _point_size(made, reach, size)
        if not geometry.is_empty():
            renderer.scene.add_geometry(name, geometry, material)
    eye = centre + reach * np.array([0.0, -0.72, 0.72])
    renderer.setup_camera(40.0, centre.astype(np.float32), eye.astype(np.float32), np.array([0, 0, 1], np.float32))
    open3d.io.write_image(path, renderer.render_to_image())


def _point_size(made: Shapes, reach: float, size: tuple[int, int]) -> float:
    """Size in pixels that closes the gaps of the map: the distance between its points as seen."""
    if len(made.points) == 0:
        return 2.0
    width, depth = np.ptp(made.points[:, :2], axis=0)
    distance = np.sqrt(max(width * depth, 1.0) / len(made.points))
    return float(np.clip(2.4 * distance * size[0] / reach, 2.0, 24.0))
