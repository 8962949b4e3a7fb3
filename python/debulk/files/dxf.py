"""The closed lines in a DXF file, read by ezdxf: an extra, imported only here."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.files.source import open_source
from debulk.files.units import check_size

log = logging.getLogger("debulk")
_MM_PER_UNIT = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0, 13: 0.001, 14: 100.0}  # by $INSUNITS; 0 names none
_UNIT_NAMES = {1: "inches", 2: "feet", 4: "mm", 5: "cm", 6: "m", 13: "µm", 14: "dm"}
_FLAT_MM = 0.01  # how far the sides of the outline may be from a curve
_GAP_MM = 0.05  # ends at most so far apart are joined
_MOST_BYTES = 1 << 26
_MOST_PARTS, _MOST_CORNERS = 20_000, 1_000_000
_FARTHEST_MM = 1e8
_CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")


class _Line(NamedTuple):
    layer: str
    corners: NDArray[np.float64]  # (N, 2), mm

    @property
    def closed(self) -> bool:
        return len(self.corners) > 2 and bool(np.hypot(*(self.corners[0] - self.corners[-1])) <= _GAP_MM)

    @property
    def described(self) -> str:
        width, height = np.ptp(self.corners, axis=0)
        x, y = self.corners[0]
        return f"{width:.4g} x {height:.4g} mm from ({x:.4g}, {y:.4g}) on layer {self.layer[:40]!r}"


def read_dxf(path: Path, mm_per_unit: float, layer: str | None) -> list[NDArray[np.float64]]:
    """Return the corners of the closed line that holds all others, (M, 2) in mm, and of those: cut-outs.

    `mm_per_unit` holds where the file names no unit.
    """
    try:
        from ezdxf.filemanagement import readfile
    except ImportError:
        raise InputError(
            f"{path}: a DXF is read by ezdxf, which is not installed: pip install 'debulk[dxf]', or export the outline "
            "as lines of x,y"
        ) from None
    with open_source(path) as source:
        if source.size > _MOST_BYTES:
            raise InputError(f"{path}: expected a small .dxf, got {source.size} bytes")
        if source.file.read(4) == b"AC10":
            raise InputError(f"{path}: the file holds DWG data; save it as DXF")
    try:
        document = readfile(str(path))
        parts, others = _parts(path, document, mm_per_unit, layer)
    except InputError:
        raise
    except Exception as error:  # whatever is wrong with a damaged file raises in ezdxf
        raise InputError(f"{path}: not readable DXF: {' '.join(str(error).split())[:120]}") from None
    lines = _joined(path, parts)
    closed = [line for line in lines if line.closed]
    closed.sort(key=lambda line: -float(np.prod(np.ptp(line.corners, axis=0))))
    nested = len(lines) == len(closed) > 0 and all(_holds(closed[0], line) for line in closed[1:])
    layers = {line.layer.lower() for line in closed}
    if nested and (len(layers) == 1 or layer is not None):
        rings = [_corners(line) for line in closed]
        try:
            check_size(path, float(np.ptp(rings[0], axis=0).max(initial=0.0)), "outline", "mm")
        except InputError as error:
            raise InputError(f"{error}: {_unit_said(document)}") from None
        return rings
    where = "" if layer is None else f" on layer {layer[:40]!r}"
    if not lines:
        found = ", ".join(f"{count} {name}" for name, count in others.most_common(6)) or "nothing"
        raise InputError(f"{path}: expected one closed line{where}, got {found}")
    shown = [("closed, " if line.closed else "open, ") + line.described for line in lines[:8]]
    raise InputError(
        f"{path}: expected one closed line{where}, got {len(closed)} closed and {len(lines) - len(closed)} open: "
        f"{'; '.join(shown)}: give the layer (--outline-layer, layer=...), or keep only the outline in the file"
        + (", with its cut-outs on its layer" if nested else "")
    )


def _holds(outer: _Line, line: _Line) -> bool:
    """Tell whether a line lies in the box round another; the rings are checked to the corner later."""
    low, high = outer.corners.min(axis=0), outer.corners.max(axis=0)
    return bool((line.corners > low).all() and (line.corners < high).all())


def _corners(line: _Line) -> NDArray[np.float64]:
    sides = np.roll(line.corners, -1, axis=0) - line.corners  # the last corner repeats the first
    return np.ascontiguousarray(line.corners[np.hypot(*sides.T) > _GAP_MM])


def _unit_said(document: Any) -> str:
    named = int(document.header.get("$INSUNITS", 0))
    return f"$INSUNITS in the file says {_UNIT_NAMES[named]}" if named else "the file names no unit ($INSUNITS)"


def _parts(path: Path, document: Any, mm_per_unit: float, layer: str | None) -> tuple[list[_Line], Counter[str]]:
    """Return the curves as lines of corners, and how many there are of what else."""
    from ezdxf.disassemble import recursive_decompose

    named = int(document.header.get("$INSUNITS", 0))
    if named:
        if named not in _MM_PER_UNIT:
            raise InputError(f"{path}: its unit, $INSUNITS {named}, is none of {', '.join(_UNIT_NAMES.values())}")
        if mm_per_unit != _MM_PER_UNIT[named]:
            log.warning("%s: read in %s, as it says itself ($INSUNITS)", path, _UNIT_NAMES[named])
        mm_per_unit = _MM_PER_UNIT[named]
    wanted = {name.strip().lower() for name in layer.split(",")} if layer is not None else set()
    parts: list[_Line] = []
    others: Counter[str] = Counter()
    for number, entity in enumerate(recursive_decompose(document.modelspace())):
        if number == _MOST_PARTS:
            raise InputError(f"{path}: expected at most {_MOST_PARTS} entities, got more: keep only the outline")
        on = str(entity.dxf.get("layer", "0"))
        if wanted and on.lower() not in wanted:  # DXF does not tell cases of names apart
            continue
        if entity.dxftype() not in _CURVES:
            others[entity.dxftype()] += 1
            continue
        for corners in _flattened(path, entity, mm_per_unit):
            parts.append(_Line(on, corners))
    return parts, others


def _flattened(path: Path, entity: Any, mm_per_unit: float) -> Iterator[NDArray[np.float64]]:
    """Yield the corners of a curve, (N, 2) in mm; of a polyline those of each of its sides and arcs joined."""
    kind, distance = entity.dxftype(), _FLAT_MM / mm_per_unit
    if kind in ("LWPOLYLINE", "POLYLINE"):
        if kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline):
            return
        sides = [part for side in entity.virtual_entities() for part in _flattened(path, side, mm_per_unit)]
        if not sides:
            return
        joined = [sides[0]]
        for side in sides[1:]:  # an arc always runs counter-clockwise, whichever way the polyline runs
            forward = np.hypot(*(side[0] - joined[-1][-1])) <= np.hypot(*(side[-1] - joined[-1][-1]))
            if len(joined) == 1 and min(np.hypot(*(end - joined[0][-1])) for end in (side[0], side[-1])) > min(
                np.hypot(*(end - joined[0][0])) for end in (side[0], side[-1])
            ):
                joined[0] = joined[0][::-1]
                forward = np.hypot(*(side[0] - joined[-1][-1])) <= np.hypot(*(side[-1] - joined[-1][-1]))
            joined.append(side if forward else side[::-1])
        yield np.concatenate(joined)
        return
    if kind == "LINE":
        points: Any = (entity.dxf.start, entity.dxf.end)
    elif kind in ("ARC", "CIRCLE"):
        if not 0 < entity.dxf.radius * mm_per_unit <= _FARTHEST_MM:
            raise InputError(f"{path}: {kind} with a radius of {entity.dxf.radius:g}")
        points = entity.flattening(distance)
    elif kind == "SPLINE" and not len(entity.control_points):
        raise InputError(
            f"{path}: a SPLINE of fit points alone, which says nothing of its course between them: explode it"
        )
    else:
        points = entity.flattening(distance, 8)
    corners = np.array([(point.x, point.y) for point in islice(points, _MOST_CORNERS)], dtype=np.float64) * mm_per_unit
    if len(corners) < 2:
        return
    if len(corners) == _MOST_CORNERS or not np.isfinite(corners).all() or np.abs(corners).max() > _FARTHEST_MM:
        raise InputError(f"{path}: a {kind} is too long or too far away for the outline of a ply")
    yield corners


def _joined(path: Path, parts: list[_Line]) -> list[_Line]:
    """Join lines whose ends meet, on one layer or on several."""
    lines = [part for part in parts if part.closed]
    loose = [part for part in parts if not part.closed and np.hypot(*(part.corners[0] - part.corners[-1])) > 0]
    ends = np.array([(part.corners[0], part.corners[-1]) for part in loose]).reshape(-1, 2)  # two of each part
    free = np.ones(len(ends), dtype=bool)
    for k, part in enumerate(loose):
        if not free[2 * k]:
            continue
        free[2 * k : 2 * k + 2] = False
        corners = part.corners
        for _ in range(2):  # on from the last corner, then from the first
            while True:
                near = np.flatnonzero(free & (np.hypot(*(ends - corners[-1]).T) <= _GAP_MM))
                if len({int(place) // 2 for place in near}) > 1:
                    x, y = corners[-1]
                    raise InputError(
                        f"{path}: more than two lines meet at ({x:.4g}, {y:.4g}) mm: keep only the outline, or "
                        "give its layer"
                    )
                if not len(near):
                    break
                other, at_last = divmod(int(near[0]), 2)
                free[2 * other : 2 * other + 2] = False
                added = loose[other].corners[::-1] if at_last else loose[other].corners
                corners = np.concatenate([corners, added[1:]])
            corners = corners[::-1]
        lines.append(_Line(part.layer, corners))
    return lines
