"""Inspect layups of an independent make: python bench/trust/stranger.py [--scenes 300] [--seed 0] [--out FILE].

Nothing here comes from `debulk.scenes`: the molds, pockets, outlines and scanners are others. The truth is a quadrature
along straight fibres of the surfaces that the scene is made of, and the ridge is the closed form of docs/model.md. The
outcomes are kept in a CSV under build/trust as they are computed; `--case N` runs one scene and prints its outcome.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

import debulk

Floats = NDArray[np.float64]
Surface = Callable[[Floats, Floats], Floats]

THICK_MM, LIMIT_MM = 0.3, 0.6
NEAR_MM = 0.1  # distance from the limit that counts as near
LAID_MM = 0.03  # ply lower than this lies on the mold
EDGE_MM = 40.0  # a fibre that continues this far over laid ply is held by friction, even if the edge slips
WAY_MM = 25.0  # length of laid ply over which one fold may draw excess (21 mm by docs/model.md), with a margin


def ridge_mm(excess_mm: float) -> float:
    """Return the ridge height of an excess by the closed form, docs/model.md (5.1)."""
    return 0.5 * excess_mm + 0.43 * THICK_MM


# --- molds --------------------------------------------------------------------------------------------------------


def _fourier(rng: np.random.Generator) -> Surface:
    terms = [(rng.normal(0, 1), rng.uniform(0, 6.3), rng.uniform(0, np.pi), rng.uniform(350, 900)) for _ in range(5)]

    def height(x: Floats, y: Floats) -> Floats:
        waves = [
            0.012 * long * a * np.cos(6.2832 / long * (x * np.cos(w) + y * np.sin(w)) + p) for a, p, w, long in terms
        ]
        return np.sum(waves, axis=0)

    return height


def _cone(rng: np.random.Generator) -> Surface:
    away, way, slope = rng.uniform(600, 1500), rng.uniform(0, 6.3), rng.uniform(0.1, 0.5) * rng.choice((-1, 1))
    return lambda x, y: slope * (np.hypot(x - away * np.cos(way), y - away * np.sin(way)) - away)


def _plies_dropped(rng: np.random.Generator) -> Surface:
    """Return the rounded edges of plies below, each a few tenths of a millimetre high, as resin rounds them."""
    edges = [
        (rng.uniform(0, 6.3), rng.uniform(-180, 180), rng.uniform(0.25, 1.2), rng.uniform(6, 20)) for _ in range(4)
    ]
    return lambda x, y: np.sum(
        [h * 0.5 * (1 + np.tanh(2 * (x * np.cos(w) + y * np.sin(w) - c) / s)) for w, c, h, s in edges], axis=0
    )


def _joggle(rng: np.random.Generator) -> Surface:
    way, deep, long = rng.uniform(0, 6.3), rng.uniform(2, 8), rng.uniform(40, 90)

    def height(x: Floats, y: Floats) -> Floats:
        u = np.clip((x * np.cos(way) + y * np.sin(way)) / long + 0.5, 0, 1)
        return deep * u**3 * (10 - 15 * u + 6 * u * u)

    return height


def _sandwich(rng: np.random.Generator) -> Surface:
    """Return a core with a chamfer all round and rounded edges."""
    half, deep, slope, soft = rng.uniform(60, 120, 2), rng.uniform(6, 15), rng.uniform(0.2, 0.45), rng.uniform(8, 20)

    def height(x: Floats, y: Floats) -> Floats:
        out = np.logaddexp(np.logaddexp((x - half[0]) / soft, (-x - half[0]) / soft), (y - half[1]) / soft)
        down = soft * slope * np.logaddexp(0, np.logaddexp(out, (-y - half[1]) / soft))
        return -deep + soft * slope * np.logaddexp(0, (deep - down) / (soft * slope))

    return height


def _spline(rng: np.random.Generator) -> Surface:
    """Return a uniform cubic B-spline on a net of random control heights."""
    control, step = rng.uniform(-25, 25, (12, 12)), rng.uniform(200, 300)

    def height(x: Floats, y: Floats) -> Floats:
        u, v = x / step + 5, y / step + 5
        i, j = (np.clip(np.floor(w), 1, 9).astype(int) for w in (u, v))
        bu, bv = _cubic(u - i), _cubic(v - j)
        return sum(bu[a] * bv[b] * control[j + b - 1, i + a - 1] for a in range(4) for b in range(4))

    return height


def _cubic(t: Floats) -> tuple[Floats, ...]:
    return (1 - t) ** 3 / 6, (3 * t**3 - 6 * t * t + 4) / 6, (-3 * t**3 + 3 * t * t + 3 * t + 1) / 6, t**3 / 6


MOLDS = {
    "fourier": _fourier,
    "cone": _cone,
    "plies dropped": _plies_dropped,
    "joggle": _joggle,
    "sandwich": _sandwich,
    "spline": _spline,
    "plate": lambda rng: lambda x, y: 0.0 * x,
}


# --- raised places of the ply -------------------------------------------------------------------------------------


def dome(x0: float, y0: float, a: float, b: float, high: float, turn: float = 0.0, flat: float = 0.0) -> Surface:
    """Return Wendland's function on an ellipse with half axes a and b; a `flat` share of it is a plateau."""

    def gap(x: Floats, y: Floats) -> Floats:
        u, v = x - x0, y - y0
        r = np.hypot((u * np.cos(turn) + v * np.sin(turn)) / a, (v * np.cos(turn) - u * np.sin(turn)) / b)
        r = np.clip((r - flat) / (1 - flat), 0, 1)
        return high * (1 - r) ** 4 * (4 * r + 1)

    return gap


def _sum(*gaps: Surface) -> Surface:
    return lambda x, y: np.sum([gap(x, y) for gap in gaps], axis=0)


def _at(rng: np.random.Generator, size: Floats, share: float = 0.3) -> Floats:
    return rng.uniform(-share, share, 2) * size


def _single(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    a = rng.uniform(25, max(35, 0.25 * size.min()))
    return dome(
        *_at(rng, size), a, a * rng.uniform(0.5, 1.5), 1.0, rng.uniform(0, 3), rng.choice([0.0, 0.3, rng.random() / 2])
    )


def _cluster(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    middle = _at(rng, size)
    return _sum(
        *(
            dome(*(middle + rng.normal(0, 30, 2)), rng.uniform(9, 28), rng.uniform(9, 28), rng.uniform(0.5, 1))
            for _ in range(rng.integers(3, 9))
        )
    )


def _ripple(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    """Return several waves across a fibre, as in a ply pushed together: crests whose troughs lie on the mold."""
    (x0, y0), long, wide = _at(rng, size, 0.15), rng.uniform(18, 45), rng.uniform(20, 70)
    half = 0.5 * long * rng.integers(2, 6)
    sharp = rng.choice([1, 2])

    def gap(x: Floats, y: Floats) -> Floats:
        u = (x - x0) * np.cos(along) + (y - y0) * np.sin(along)
        v = (y - y0) * np.cos(along) - (x - x0) * np.sin(along)
        wave = (0.5 - 0.5 * np.cos(2 * np.pi * (u + half) / long)) ** sharp
        return np.where(np.abs(u) < half, wave, 0.0) * np.clip(1 - (v / wide) ** 2, 0, 1) ** 2

    return gap


def _chain(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    (x0, y0), a, apart = _at(rng, size, 0.1), rng.uniform(18, 40), rng.uniform(0, 15)
    count = int(rng.integers(2, 5))
    steps = (np.arange(count) - 0.5 * (count - 1)) * (2 * 0.85 * a + apart)
    return _sum(
        *(
            dome(
                x0 + s * np.cos(along), y0 + s * np.sin(along), a, a * rng.uniform(0.8, 1.3), rng.uniform(0.8, 1), along
            )
            for s in steps
        )
    )


def _pair_of_bumps(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    """Return two or three bumps in a row along a fibre, each just above the cut."""
    (x0, y0), a, apart = _at(rng, size), rng.uniform(10, 18), rng.uniform(0, 12)
    count = int(rng.integers(2, 4))
    return _sum(
        *(
            dome(
                x0 + k * (2 * 0.85 * a + apart) * np.cos(along),
                y0 + k * (2 * 0.85 * a + apart) * np.sin(along),
                a,
                a,
                1,
            )
            for k in range(count)
        )
    )


def _rider(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    (x0, y0), a = _at(rng, size, 0.2), rng.uniform(50, max(60, 0.25 * size.min() + 30))
    off = rng.uniform(-0.5, 0.5, 2) * a
    small = rng.uniform(5, 16)
    return _sum(
        dome(x0, y0, a, a * rng.uniform(0.7, 1.3), 1.0, 0.0, 0.2),
        dome(x0 + off[0], y0 + off[1], small, small, rng.uniform(0.2, 0.8)),
    )


def _at_edge(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    side = rng.integers(2)
    middle = _at(rng, size, 0.25)
    middle[side] = 0.5 * size[side] * rng.choice((-1, 1)) * rng.uniform(0.85, 1.05)
    return dome(*middle, rng.uniform(25, 60), rng.uniform(25, 60), 1.0, 0.0, 0.2)


def _low_wave(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    return dome(*_at(rng, size, 0.1), 0.4 * size[0], 0.4 * size[1], 1.0, 0.0, 0.1)


def _tunnel(rng: np.random.Generator, size: Floats, along: float) -> Surface:
    turn = along + rng.choice([0, 0.7854, 1.5708, rng.uniform(0, 3)])
    return dome(
        *_at(rng, size, 0.1), rng.uniform(80, max(90, 0.4 * size.max() + 20)), rng.uniform(12, 35), 1.0, turn, 0.3
    )


PLIES = {
    "single": _single,
    "cluster": _cluster,
    "ripple": _ripple,
    "chain": _chain,
    "bumps": _pair_of_bumps,
    "rider": _rider,
    "edge": _at_edge,
    "low wave": _low_wave,
    "tunnel": _tunnel,
}


# --- outlines -----------------------------------------------------------------------------------------------------


def outline_of(kind: str, size: Floats) -> Floats:
    w, h = 0.5 * size
    if kind == "L":
        return np.array([(-w, -h), (w, -h), (w, 0.2 * h), (0.3 * w, 0.2 * h), (0.3 * w, h), (-w, h)])
    if kind == "ellipse":
        turn = np.linspace(0, 2 * np.pi, 120, endpoint=False)
        return np.stack([w * np.cos(turn), h * np.sin(turn)], axis=1)
    if kind == "hole":  # a hole cut out of the ply, joined to its outline by a slit
        turn = np.linspace(-0.5 * np.pi + 0.02, 1.5 * np.pi - 0.02, 80)
        hole = 25 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.array([(-w, -h), (-0.5, -h), *hole[::-1], (0.5, -h), (w, -h), (w, h), (-w, h)])
    return np.array([(-w, -h), (w, -h), (w, h), (-w, h)])


class Plane:
    """A polygon, drawn in pixels of a quarter of a millimetre."""

    def __init__(self, polygon: Floats) -> None:
        self.low = polygon.min(axis=0) - 2
        nx, ny = np.ceil((polygon.max(axis=0) + 2 - self.low) * 4).astype(int)
        picture = Image.new("1", (int(nx), int(ny)))
        ImageDraw.Draw(picture).polygon([tuple(p) for p in (polygon - self.low) * 4], fill=1)
        self.on = np.array(picture)

    def __call__(self, x: Floats, y: Floats) -> NDArray[np.bool_]:
        i, j = (((v - low) * 4).astype(int) for v, low in zip((x, y), self.low, strict=True))
        fits = (i >= 0) & (j >= 0) & (i < self.on.shape[1]) & (j < self.on.shape[0])
        out = np.zeros(x.shape, bool)
        out[fits] = self.on[j[fits], i[fits]]
        return out


# --- the scene ----------------------------------------------------------------------------------------------------


@dataclass
class Scene:
    """A scene: its surfaces, the data that the inspection is given, and the kinds of its parts."""

    mold_kind: str
    ply_kinds: str
    outline_kind: str
    scanner: str
    angle_deg: float
    mold: Surface
    gap: Surface
    outline: Floats
    on: Plane
    scan: NDArray[np.float32]
    reference: NDArray[np.float32]
    pose: Floats | None


def make(number: int, seed: int) -> Scene:
    """Make a scene; the same number and seed make the same scene."""
    rng = np.random.default_rng([77, seed, number])
    kinds = list(MOLDS)
    mold_kind = kinds[rng.integers(len(kinds))]
    mold = MOLDS[mold_kind](rng)
    outline_kind = str(rng.choice(["rectangle", "rectangle", "ellipse", "L", "hole", "strip"]))
    size = rng.uniform(260, 460, 2)
    if outline_kind == "strip":
        size[int(rng.integers(2))] = 60.0
    outline = outline_of(outline_kind, size)
    on = Plane(outline)
    angle_deg = float(rng.choice([0.0, 45.0, rng.uniform(-90, 90)]))
    along = np.radians(angle_deg + rng.choice([0, 90]))
    likely = np.where(np.array(list(PLIES)) == "low wave", 0.3, 1.0)
    names = [str(n) for n in rng.choice(list(PLIES), rng.integers(1, 4), p=likely / likely.sum())]
    creases = rng.random() < 0.5
    gaps: list[Surface] = []
    for k, name in enumerate(names):
        shape = PLIES[name](rng, size, along)
        target = rng.uniform(0.68, 1.2) if creases and k == 0 else rng.uniform(0.2, 0.48)
        gaps.append(scaled(shape, target, mold, on, size, angle_deg))
    gap = _sum(*gaps)
    scan, reference, pose, scanner = scanned(rng, mold, gap, on, size)
    return Scene(
        mold_kind, "+".join(names), outline_kind, scanner, angle_deg, mold, gap, outline, on, scan, reference, pose
    )


def scaled(shape: Surface, target_mm: float, mold: Surface, on: Plane, size: Floats, angle_deg: float) -> Surface:
    """Scale a shape so that the worst fibre over it makes a ridge of this height; the shape is at most 7 mm high."""
    low, high = 0.0, 7.0
    for _ in range(9):
        middle = 0.5 * (low + high)
        worst = max((r.excess_mm for r in runs(mold, _times(shape, middle), on, size, angle_deg, 4.0)), default=0.0)
        low, high = (middle, high) if ridge_mm(worst) < target_mm else (low, middle)
    return _times(shape, low)


def _times(shape: Surface, factor: float) -> Surface:
    return lambda x, y: factor * shape(x, y)


def scanned(
    rng: np.random.Generator, mold: Surface, gap: Surface, on: Plane, size: Floats
) -> tuple[NDArray[np.float32], NDArray[np.float32], Floats | None, str]:
    scanner = str(rng.choice(["pinhole", "oblong pixels", "lines", "loose points"], p=[0.55, 0.15, 0.15, 0.15]))
    pitch = rng.uniform(0.55, 0.95)
    pitches = pitch * np.array([1.0, rng.uniform(1.2, 1.5) if scanner == "oblong pixels" else 1.0])
    away = rng.uniform(900, 2400)
    roll = rng.uniform(-3, 3) if rng.random() < 0.3 else 0.0
    seen = np.full(2, np.hypot(*size)) if roll else size
    nx, ny = np.ceil((seen * 1.15 + 90) / pitches).astype(int)
    turn = _turned(np.array([0, 0, roll]) + rng.normal(0, 0.05, 3))
    eye = turn @ np.array([0, 0, away]) + mold(*np.zeros((2, 1)))[0] * np.array([0, 0, 1])
    columns, rows = np.meshgrid(np.arange(nx) - 0.5 * (nx - 1), np.arange(ny) - 0.5 * (ny - 1))
    flat = np.stack([columns * pitches[0], -rows * pitches[1], np.full(rows.shape, -away)], axis=-1)
    if scanner == "lines":  # parallel rays
        start = eye + (flat * [1, 1, 0]) @ turn.T
        rays = np.broadcast_to(turn @ [0, 0, -1.0], start.shape)
    else:
        rays = flat @ turn.T
        rays = rays / np.linalg.norm(rays, axis=-1)[..., None]
        start = np.broadcast_to(eye, rays.shape)
    noise = rng.uniform(0.01, 0.045)

    def top(x: Floats, y: Floats) -> Floats:
        return mold(x, y) + np.where(on(x, y), THICK_MM + gap(x, y), 0.0)

    clouds = []
    for surface in (top, mold):
        far = -start[..., 2] / rays[..., 2]
        for _ in range(9):
            p = start + far[..., None] * rays
            far = far + (surface(p[..., 0], p[..., 1]) - p[..., 2]) / rays[..., 2]
        grain = noise * (far / away) ** 2 * rng.standard_normal(far.shape)
        stray = rng.random(far.shape) < 2e-4
        grain[stray] += rng.uniform(-30, 30, int(stray.sum()))
        p = start + (far + grain)[..., None] * rays
        p[rng.random(far.shape) < 1e-3] = np.nan
        if rng.random() < 0.3:
            p[rng.integers(ny)] = np.nan
        clouds.append(p)
    # The scanner's frame: its z along the view.
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn @ np.diag([1.0, -1.0, -1.0]), eye
    clouds = [(p - pose[:3, 3]) @ pose[:3, :3] for p in clouds]
    if scanner == "loose points":
        clouds = [p.reshape(-1, 3)[np.isfinite(p).all(axis=-1).ravel()] for p in clouds]
        clouds = [p[rng.permutation(len(p))] for p in clouds]
    return clouds[0].astype(np.float32), clouds[1].astype(np.float32), pose, scanner


def _turned(by: Floats) -> Floats:
    out = np.eye(3)
    for k, a in enumerate(by):
        one, (i, j) = np.eye(3), [n for n in range(3) if n != k]
        one[i, i], one[j, j], one[i, j], one[j, i] = np.cos(a), np.cos(a), -np.sin(a), np.sin(a)
        out = out @ one
    return out


# --- the truth ----------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """A piece of a straight fibre that stands off the mold."""

    excess_mm: float  # by how much it is longer than the mold below
    held: bool  # true: it is held at both ends, far from the edge of the ply
    high_mm: float
    at_mm: tuple[float, float]
    line: int
    ends_mm: tuple[float, float]  # along the line


def runs(
    mold: Surface, gap: Surface, on: Plane, size: Floats, angle_deg: float, apart_mm: float = 2.0
) -> Iterator[Run]:
    """Yield all pieces of fibres of both directions that stand off the mold."""
    reach, step = 0.5 * float(np.hypot(*size)) + 5, 0.5
    s = np.arange(-reach, reach, step)
    for direction, a in enumerate(np.radians((angle_deg, angle_deg + 90))):
        across = np.arange(-reach, reach, apart_mm)
        x = s * np.cos(a) - across[:, None] * np.sin(a)
        y = s * np.sin(a) + across[:, None] * np.cos(a)
        off, below, ply = gap(x, y), mold(x, y), on(x, y)
        longer = np.hypot(np.diff(below + off, axis=1), step) - np.hypot(np.diff(below, axis=1), step)
        for k in np.flatnonzero((ply & (off > LAID_MM)).any(axis=1)):
            up = ply[k] & (off[k] > LAID_MM)
            change = np.flatnonzero(np.diff(np.concatenate([[0], up.view(np.int8), [0]])))
            for first, last in change.reshape(-1, 2):
                margin = round(EDGE_MM / step)
                held = first >= margin and last + margin < len(s) and ply[k, first - margin : last + margin].all()
                top = first + int(np.argmax(off[k, first:last]))
                yield Run(
                    float(longer[k, max(first - 1, 0) : last].sum()),
                    bool(held),
                    float(off[k, top]),
                    (float(x[k, top]), float(y[k, top])),
                    1000 * direction + int(k),
                    (float(s[first]), float(s[last - 1])),
                )


def drawn_together_mm(found: list[Run]) -> float:
    """Return the largest excess of a row of pieces of one fibre with at most WAY_MM of laid ply in all between them."""
    most = 0.0
    for k, first in enumerate(found):
        whole, flat, before = max(first.excess_mm, 0.0), 0.0, first
        most = max(most, whole)
        for following in found[k + 1 :]:
            if following.line != first.line:
                break
            flat += following.ends_mm[0] - before.ends_mm[1]
            if flat > WAY_MM:
                break
            whole, before = whole + max(following.excess_mm, 0.0), following
            most = max(most, whole)
    return most


# --- the outcome --------------------------------------------------------------------------------------------------


@dataclass
class Outcome:
    """The verdict on a scene, and the truth about it."""

    number: int
    mold: str
    plies: str
    outline: str
    scanner: str
    said: str
    held_mm: float  # ridge of the worst piece that is held
    together_mm: float  # ridge of the worst row of pieces, held or not
    short_mm: float  # largest length by which a piece is too short
    loose: float  # share of the ply that stands more than 0.1 mm off the mold
    where: str
    reason: str
    seconds: float

    @property
    def false_cease(self) -> bool:
        """Return whether the scene passed although a held fibre has too much excess."""
        return self.said == "cease" and self.held_mm > LIMIT_MM

    @property
    def shared_cease(self) -> bool:
        """Return whether the scene passed although a row of pieces together has too much excess."""
        return self.said == "cease" and self.together_mm > LIMIT_MM + 0.02 and not self.false_cease

    @property
    def error(self) -> bool:
        """Return whether there is no verdict."""
        return self.said not in ("cease", "crease", "undecided", "invalid")

    @property
    def good(self) -> bool:
        """Return whether nothing comes near the limit, and most of the ply is laid."""
        return self.together_mm < LIMIT_MM - NEAR_MM and self.loose < 0.2

    @property
    def false_alarm(self) -> bool:
        """Return whether the scene is good but was said to crease or was refused."""
        return self.good and self.said not in ("cease", "undecided")


def look(number: int, seed: int) -> Outcome:
    """Make a scene, inspect it, and compare the verdict with the truth."""
    scene = make(number, seed)
    size = np.ptp(scene.outline, axis=0)
    found = list(runs(scene.mold, scene.gap, scene.on, size, scene.angle_deg))
    held = max((r for r in found if r.held), key=lambda r: r.excess_mm, default=None)
    corners = np.meshgrid(*(np.arange(-s / 2, s / 2, 2.0) for s in size))
    gaps = scene.gap(*corners)[scene.on(*corners)]
    outcome = Outcome(
        number,
        scene.mold_kind,
        scene.ply_kinds,
        scene.outline_kind,
        scene.scanner,
        "",
        round(ridge_mm(max(held.excess_mm if held else 0.0, 0.0)), 3),
        round(ridge_mm(drawn_together_mm(found)), 3),
        round(-min((r.excess_mm for r in found), default=0.0), 3),
        round(float((gaps > 0.1).mean()), 3),
        f"({held.at_mm[0]:.0f}, {held.at_mm[1]:.0f}) {held.high_mm:.2f}" if held else "",
        "",
        0.0,
    )
    began = time.process_time()
    try:
        report = debulk.inspect(
            scene.scan,
            scene.reference,
            None,
            scene.outline,
            (scene.angle_deg, scene.angle_deg + 90),
            scene.pose,
        )
        outcome.said, outcome.reason = report.verdict.value, report.reason
    except Exception as error:
        outcome.said, outcome.reason = type(error).__name__, str(error)
    outcome.seconds = round(time.process_time() - began, 2)
    return outcome


def text(outcomes: list[Outcome], seed: int) -> str:
    """Return the text: counts first, then every scene with a wrong outcome."""
    good, creasing = [o for o in outcomes if o.good], [o for o in outcomes if o.held_mm > LIMIT_MM]
    head = (
        f"{len(outcomes)} scenes of a stranger's make (seed {seed}, debulk {debulk.__version__}); creasing is a true "
        f"ridge above {LIMIT_MM:g} mm of a held fibre, good what stays {NEAR_MM:g} mm below with most of the ply laid"
    )
    counts = [
        f"false CEASE (passed, though a held fibre creases)        {sum(o.false_cease for o in outcomes):4} of "
        f"{len(creasing)}",
        f"shared CEASE (passed, though a row together creases)     {sum(o.shared_cease for o in outcomes):4}",
        f"false alarms (good, and said to crease or INVALID)       {sum(o.false_alarm for o in outcomes):4} of "
        f"{len(good)}",
        f"errors                                                   {sum(o.error for o in outcomes):4}",
    ]
    said = [
        f"{name:9} " + (", ".join(f"{n} {what}" for what, n in sorted(Counter(o.said for o in group).items())) or "-")
        for name, group in (("creasing", creasing), ("good", good), ("all", outcomes))
    ]
    lists = [
        f"{name:13}{o.number:4} {o.plies} on {o.mold}, {o.outline}, {o.scanner}: ridge {o.held_mm:.2f}, in a row "
        f"{o.together_mm:.2f}, loose {o.loose:.2f}, at {o.where}; {o.said}: {o.reason}"[:300]
        for name, group in (
            ("FALSE CEASE", [o for o in outcomes if o.false_cease]),
            ("SHARED CEASE", [o for o in outcomes if o.shared_cease]),
            ("FALSE ALARM", [o for o in outcomes if o.false_alarm]),
            ("ERROR", [o for o in outcomes if o.error]),
        )
        for o in group
    ]
    return "\n".join([head, "", *counts, "", *said, *(["", *lists] if lists else [])]) + "\n"


def main() -> None:
    """Run the scenes, print the text, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", type=int, help="do only this scene, and print what became of it")
    parser.add_argument("--csv", type=Path, default=Path("build/trust/stranger.csv"))
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    if args.case is not None:
        for name, value in asdict(look(args.case, args.seed)).items():
            print(f"{name:>12} {value}")
        return
    args.csv.parent.mkdir(parents=True, exist_ok=True)
    outcomes = []
    with args.csv.open("w", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Outcome)], lineterminator="\n")
        writer.writeheader()
        for number in range(args.scenes):
            outcomes.append(look(number, args.seed))
            writer.writerow(asdict(outcomes[-1]))
            file.flush()
    said_of_all = text(outcomes, args.seed)
    print(said_of_all, end="")
    if args.out:
        args.out.write_text(said_of_all)


if __name__ == "__main__":
    main()
