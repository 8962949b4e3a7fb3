"""Marks on the map in addition to heights and pockets: axes, fibre directions, holes, and other bumps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from debulk.results.advice import Deed, hole_line, wrinkle_line
from debulk.results.report import LeftOut, PocketReport, UnseenHole, Wrinkle

_HATCHES = 7  # number of lines across a hole


class Spot(NamedTuple):
    """A mark on the map; x to the right and y down, mm."""

    x: float
    y: float
    path: str
    title: str


class Push(NamedTuple):
    """An arrow on the map: where it begins, and its tip from there; x to the right and y down, mm."""

    x: float
    y: float
    path: str
    title: str
    tip: tuple[float, float]


class Tick(NamedTuple):
    """A place on an axis, in the direction of the map, and its figure in the mold frame."""

    at: float
    text: str


def ticks(low: float, high: float, step: float, sign: int) -> list[Tick]:
    """Return the multiples of `step` from `low` to `high`, mold frame; `sign` is -1 if the map counts downwards."""
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [Tick(sign * k * step, f"{k * step:g}".replace("-", "−")) for k in range(first, last + 1)]


def hatch(box: tuple[float, float, float, float], apart: float) -> str:
    """Return slanting lines over a box of x, y, width and height; under the heights, they show where these are NaN."""
    x, y, width, height = box
    parts = []
    for k in range(1, math.floor((width + height) / apart) + 1):
        # Each line runs from the upper or right side to the left or lower one, along x + y = k times the distance.
        c = k * apart
        a, b = min(c, width), min(c, height)
        parts.append(f"M{x + a:.1f} {y + c - a:.1f}L{x + c - b:.1f} {y + b:.1f}")
    return "".join(parts)


def holes(unseen: Sequence[UnseenHole]) -> list[Spot]:
    """Return hatched ellipses round the centres of the holes, as wide and as high as the holes."""
    spots = []
    for hole in unseen:
        (x, y), a, b = hole.centre_mm, max(hole.extent_mm[0] / 2, 1.0), max(hole.extent_mm[1] / 2, 1.0)
        parts = [f"M{-a:.1f} 0a{a:.1f} {b:.1f} 0 1 0 {2 * a:.1f} 0a{a:.1f} {b:.1f} 0 1 0 {-2 * a:.1f} 0"]
        radius = math.hypot(a, b)
        for k in range(1, _HATCHES + 1):
            # The chord a u - b v = c of the unit circle is the line x - y = c through the ellipse.
            c = radius * (2 * k / (_HATCHES + 1) - 1)
            u, v, half = a * c / radius**2, -b * c / radius**2, math.sqrt(1 - (c / radius) ** 2) / radius
            ends = [(a * (u + s * half * b), -b * (v + s * half * a)) for s in (-1, 1)]
            parts.append("M" + "L".join(f"{p:.1f} {q:.1f}" for p, q in ends))
        spots.append(Spot(x, -y, "".join(parts), hole_line(hole)))
    return spots


def bumps(left_out: Sequence[LeftOut], pockets: Sequence[PocketReport], size: float) -> list[Spot]:
    """Return diamonds at bumps below the tolerances, including those that are judged as pockets; a cross is CREASE."""
    s, half = f"{size:.1f}", f"{0.75 * size:.1f}"
    diamond = f"M0 -{s}L{half} 0L0 {s}L-{half} 0Z"
    named = [(entry.place_mm, f"{entry.what}: {entry.why}") for entry in left_out]
    named += [(p.centroid_mm, f"pocket {p.id} is judged: {p.promoted}") for p in pockets if p.promoted]
    return [Spot(place[0], -place[1], diamond, title) for place, title in named if place is not None]


def wrinkles(standing: Sequence[Wrinkle]) -> list[Spot]:
    """Return lines along the wrinkles that already stand in the ply."""
    spots = []
    for wrinkle in standing:
        (x, y), (to_x, to_y) = wrinkle.start_mm, wrinkle.end_mm
        spots.append(Spot(x, -y, f"M0 0L{to_x - x:.1f} {y - to_y:.1f}", wrinkle_line(wrinkle)))
    return spots


def pushes(deeds: Sequence[Deed], font: float) -> list[Push]:
    """Return arrows from the places that length is to leave, towards the edge over which it goes."""
    spots = []
    for deed in deeds:
        if deed.place_mm is None:
            continue
        for way_deg in deed.ways_deg:
            x, y = math.cos(math.radians(way_deg)), -math.sin(math.radians(way_deg))
            tip, back, half = 3.4 * font, 2.6 * font, 0.45 * font
            head = f"M{tip * x:.1f} {tip * y:.1f}L"
            wings = "".join(f"{head}{back * x - s * y:.1f} {back * y + s * x:.1f}" for s in (-half, half))
            path = f"M0 0L{tip * x:.1f} {tip * y:.1f}{wings}"
            spots.append(Push(deed.place_mm[0], -deed.place_mm[1], path, str(deed), (tip * x, tip * y)))
    return spots


def fibres(pockets: Sequence[PocketReport], size: float) -> list[Spot]:
    """Return the mean directions of the two fibres for each pocket with a net."""
    spots = []
    for pocket in pockets:
        middle = pocket.centroid_mm
        if pocket.net is None or middle is None:
            continue
        ways = []
        for fibre in (0, 1):
            ahead = pocket.net.neighbours[:, 2 * fibre]
            from_node = np.flatnonzero(ahead >= 0)
            if len(from_node):
                steps = pocket.net.nodes_mm[ahead[from_node], :2] - pocket.net.nodes_mm[from_node, :2]
                x, y = (float(c) for c in steps.mean(axis=0))
                length = math.hypot(x, y)
                if length > 0:
                    ways.append((x / length, y / length))
        path = "".join(f"M{-size * x:.1f} {size * y:.1f}L{size * x:.1f} {-size * y:.1f}" for x, y in ways)
        angles = ", ".join(f"{math.degrees(math.atan2(y, x)):.0f}°" for x, y in ways)
        if path:
            spots.append(Spot(middle[0], -middle[1], path, f"fibre directions of pocket {pocket.id}: {angles}"))
    return spots
