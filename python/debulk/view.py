"""A report in 3-D, by Open3D (the extra "view"): in a window that the mouse turns, or as a picture.

Open3D is imported where it is used and nowhere else: it takes two seconds, and 600 MB of disk.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.page.scales import colours
from debulk.pocket import inside_outline
from debulk.report import Report
from debulk.results.report import PocketReport
from debulk.verdict import Verdict

__all__ = ["Shapes", "shapes", "view"]

Floats = NDArray[np.float64]
COMMAND = "pip install 'debulk[view]'"
_PACKAGES = "libegl1 libgl1 libusb-1.0-0 libvulkan1 mesa-vulkan-drivers"
_MAX_POINTS = 400_000
_MAGNIFICATIONS = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
_HIGH = 0.3  # heights that are chosen here stay below this share of the width
_ABOVE_MM = 0.3  # outlines are drawn so much above the cut height, clear of the ply
# Okabe and Ito's colours, which the colour-blind tell apart.
_VERDICT_RGB = {
    Verdict.CEASE: (0.0, 0.62, 0.45),
    Verdict.UNDECIDED: (0.90, 0.62, 0.0),
    Verdict.CREASE: (0.84, 0.37, 0.0),
    Verdict.INVALID: (0.5, 0.5, 0.5),
}
_BEFORE_RGB = (0.34, 0.71, 0.91)


@dataclass(frozen=True, eq=False)
class Shapes:
    """What is drawn, mm, heights above the reference, magnified.

    Attributes
    ----------
    magnify
        How many times larger heights are drawn than lengths.
    points, point_rgb
        (N, 3) the height map, lighter the higher; left out where a net is drawn.
    corners, segments, segment_rgb
        (M, 3), (K, 2), (K, 3): outlines in the verdict's colour, nets before debulking in light blue, and after it.
    """

    magnify: float
    points: Floats
    point_rgb: Floats
    corners: Floats
    segments: NDArray[np.int32]
    segment_rgb: Floats


def shapes(report: Report, pocket: int | None = None, magnify: float | None = None) -> Shapes:
    """Make what `view` draws.

    Parameters
    ----------
    report, pocket, magnify
        As for `view`.

    Raises
    ------
    InputError
        No such pocket, a magnification that is not positive, or a report with nothing to draw.
    """
    if magnify is not None and not (np.isfinite(magnify) and magnify > 0):
        raise InputError(f"magnify: expected a positive factor, but got {magnify!r}")
    chosen = [p for p in report.pockets if pocket in (None, p.id)]
    if pocket is not None and not chosen:
        raise InputError(f"pocket: expected one of 1 to {len(report.pockets)}, but got {pocket!r}")
    points = _map_points(report, None if pocket is None else chosen[0])
    if len(points) == 0 and not chosen:
        raise InputError("report: expected a height map or a pocket to draw, but it has neither")
    cut = float(report.recipe.get("segmentation", {}).get("cut_height_mm", 2.0))
    parts = [part for p in chosen for part in _pocket_parts(p, cut + _ABOVE_MM)]
    corners = np.concatenate([np.empty((0, 3)), *(corners for corners, _, _ in parts)])
    everything = np.concatenate([points, corners])
    top = max(float(everything[:, 2].max()), 1.0)
    if magnify is None:
        width = float(np.ptp(everything[:, :2], axis=0).max())
        magnify = max([f for f in _MAGNIFICATIONS if f * top <= _HIGH * width], default=1.0)
    scale = np.array([1.0, 1.0, magnify])
    firsts = np.cumsum([0, *(len(corners) for corners, _, _ in parts)])
    return Shapes(
        magnify=magnify,
        points=points * scale,
        point_rgb=_rgb(points[:, 2] / top),
        corners=corners * scale,
        segments=np.concatenate(
            [np.empty((0, 2), np.int32), *(s + first for (_, s, _), first in zip(parts, firsts, strict=False))]
        ).astype(np.int32),
        segment_rgb=np.concatenate([np.empty((0, 3)), *(np.tile(rgb, (len(s), 1)) for _, s, rgb in parts)]),
    )


def _rgb(share: Floats) -> Floats:
    """Cividis, as on the page."""
    table = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours(64)]) / 255.0
    return np.asarray(table[np.clip(share * 64, 0, 63).astype(int)], dtype=np.float64)


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
        The report: height map, outlines, and every pocket's net before and after debulking, above the reference.
    picture
        A .png to write, without a screen. None: opens a window, and returns when it is closed.
    pocket
        Draw this one alone, by its number. None: all.
    magnify
        Heights are drawn so many times larger than lengths. None: as far as the picture has room for.
    size
        Width and height of the picture or the window, pixels.

    Raises
    ------
    InputError
        Open3D is missing (the command that installs it is named) or cannot draw here; or an argument is wrong.
    """
    path = None if picture is None else Path(picture)
    if path is not None and path.suffix.lower() != ".png":
        raise InputError(f"{path}: expected a file ending in .png")
    made = shapes(report, pocket, magnify)
    open3d = _open3d()
    if path is None:
        _window(open3d, made, size)
        return
    # Where a driver lacks, Open3D ends the process: let it be another one.
    child = multiprocessing.get_context("spawn").Process(target=_draw, args=(made, str(path), size), daemon=True)
    child.start()
    child.join()
    if child.exitcode != 0 or not path.is_file():
        raise InputError(f"{path}: Open3D cannot draw without a screen here; on Debian it needs {_PACKAGES}")


def _window(open3d: Any, made: Shapes, size: tuple[int, int]) -> None:
    """Open a window and return when it is closed."""
    # Without a screen Open3D opens a window that nobody sees, and waits for ever.
    seen = not sys.platform.startswith("linux") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    window = open3d.visualization.Visualizer()
    if not (seen and window.create_window(f"debulk, heights x {made.magnify:g}", *size)):
        raise InputError("view: there is no screen to open a window on; with --png FILE it draws a picture without one")
    for geometry in _geometries(open3d, made):
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


def _map_points(report: Report, pocket: PocketReport | None) -> Floats:
    """Points of the height map, round the pocket if one is chosen, no more than can be drawn."""
    grid = report.height_map
    if grid is None:
        return np.empty((0, 3))
    known = np.isfinite(grid.values)
    if report.ply_outline_mm is not None:
        known &= inside_outline(report.ply_outline_mm, grid)
    for p in report.pockets:  # the net before debulking is drawn instead, and with it what lies below
        if p.net is not None and (pocket is None or p is pocket):
            known &= ~inside_outline(p.outline_mm if p.foot_outline_mm is None else p.foot_outline_mm, grid)
    x, y = np.meshgrid(grid.x_mm, grid.y_mm)
    points = np.column_stack([x[known], y[known], grid.values[known].astype(np.float64)])
    if pocket is not None:
        low, high = pocket.outline_mm.min(axis=0) - 20.0, pocket.outline_mm.max(axis=0) + 20.0
        points = points[((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)]
    return points[:: max(1, -(-len(points) // _MAX_POINTS))]


def _pocket_parts(
    pocket: PocketReport, outline_height_mm: float
) -> list[tuple[Floats, NDArray[np.int32], tuple[float, float, float]]]:
    """Corners, segments and colour of a pocket's outline and nets."""
    count = len(pocket.outline_mm)
    ring = np.column_stack([np.arange(count), np.roll(np.arange(count), -1)]).astype(np.int32)
    rgb = _VERDICT_RGB[pocket.verdict]
    parts = [(np.column_stack([pocket.outline_mm, np.full(count, outline_height_mm)]), ring, rgb)]
    if pocket.net is not None:
        for nodes, gap, colour in (
            (pocket.net.nodes_mm, pocket.initial_gap_mm, _BEFORE_RGB),
            (pocket.debulked_mm, pocket.debulked_gap_mm, rgb),
        ):
            if nodes is not None and gap is not None:
                parts.append((np.column_stack([nodes[:, :2], gap]), pocket.net.edges, colour))
    return parts


def _geometries(open3d: Any, made: Shapes) -> list[Any]:
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(made.points))
    cloud.colors = open3d.utility.Vector3dVector(made.point_rgb)
    lines = open3d.geometry.LineSet(
        open3d.utility.Vector3dVector(made.corners), open3d.utility.Vector2iVector(made.segments)
    )
    lines.colors = open3d.utility.Vector3dVector(made.segment_rgb)
    return [cloud, lines]


def _draw(made: Shapes, path: str, size: tuple[int, int]) -> None:
    """Draw off-screen, from above at a slant; runs in a process of its own."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the renderer talks
    open3d = _open3d()
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    rendering = open3d.visualization.rendering
    renderer = rendering.OffscreenRenderer(*size)
    renderer.scene.set_background([1.0, 1.0, 1.0, 1.0])
    renderer.scene.view.set_post_processing(False)  # colours as they were chosen
    everything = np.concatenate([made.points, made.corners])
    low, high = everything.min(axis=0), everything.max(axis=0)
    centre, reach = 0.5 * (low + high), float(np.linalg.norm(high - low))
    for name, geometry in zip(("map", "lines"), _geometries(open3d, made), strict=True):
        material = rendering.MaterialRecord()
        material.shader = "unlitLine" if name == "lines" else "defaultUnlit"
        material.line_width, material.point_size = 2.5, _point_size(made, reach, size)
        if len(made.points if name == "map" else made.corners):
            renderer.scene.add_geometry(name, geometry, material)
    eye = centre + reach * np.array([0.0, -0.72, 0.72])
    renderer.setup_camera(40.0, centre.astype(np.float32), eye.astype(np.float32), np.array([0, 0, 1], np.float32))
    open3d.io.write_image(path, renderer.render_to_image())


def _point_size(made: Shapes, reach: float, size: tuple[int, int]) -> float:
    """Pixels that close the map: its points' distance, as seen."""
    if len(made.points) == 0:
        return 2.0
    width, depth = np.ptp(made.points[:, :2], axis=0)
    distance = np.sqrt(max(width * depth, 1.0) / len(made.points))
    return float(np.clip(2.4 * distance * size[0] / reach, 2.0, 24.0))
