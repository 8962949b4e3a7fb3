"""The scenes of the open benchmark: plies with air pockets on molds, drawn by number, and their clouds.

Three families of pockets: `bells` are those of the referee, `ellipses` those of `lab.third`, and `varied` those of
`lab.varied`, made small enough for fine nets. All are lifted along the mold's normal and seen by `lab.third.camera`.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "referee"))

from pockets import Shape, foot_distance

from lab.third import outlines
from lab.third.camera import Camera, Patch
from lab.third.molds import MOLDS
from lab.third.ply import Bell, Ply, truth
from lab.varied.placing import SHAPES
from lab.varied.polygons import distance

Floats = NDArray[np.float64]
Rng = np.random.Generator
Gap = Callable[[Floats, Floats], Floats]

SCENES, SEED = 200, 36
PIXELS, PITCH_MM = (400, 300), 0.75
LIMIT_MM = 0.60  # of a ridge; it is exceeded by a fold that gathers more than `limit_excess_mm`
KINDS = ("round", "elliptic", "long", "kidney")
VARIED = ("gaussians", "wrinkle", "lobes", "crescent", "superposed")
COUNTS = (0, 1, 1, 1, 1, 1, 2, 2, 3, 4)  # of pockets, each as likely
MARGIN_MM = 28.0  # of laid ply round each pocket: more than one fold draws from (docs/model.md, section 6)
MISSED = 0.005  # share of the pixels without a point


@dataclass(frozen=True)
class Lift(Bell):
    """A pocket of any shape round (x, y); `a` and `b` are the radius of a circle that contains its foot."""

    kind: str
    shape: Gap  # of height 1

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Return the distance from the mold, along the mold's normal at these places."""
        return self.high * self.shape(x - self.x, y - self.y)


@dataclass(frozen=True)
class Scene:
    """A ply with its pockets, and the camera above it."""

    number: int
    family: str
    mold: str
    fibre_deg: float  # the first family of fibres; the second lies across it
    ply: Ply  # its `bells` are `Lift`s
    camera: Camera


def limit_excess_mm(thickness_mm: float) -> float:
    """Return the excess of a fold whose ridge is as high as the limit, by h = dL/2 + (2 - pi/2) t."""
    return 2 * (LIMIT_MM - (2 - np.pi / 2) * thickness_mm)


def _bell(rng: Rng) -> tuple[str, float, Gap]:
    kind = str(rng.choice(KINDS))
    radius, aspect, bend = rng.uniform(14, 19), 1.0, 0.0
    if kind == "elliptic":
        aspect = rng.uniform(1.2, 1.7)
    if kind in ("long", "kidney"):
        radius, aspect = rng.uniform(11, 13.5), rng.uniform(1.9, 2.4)
        bend = radius * rng.uniform(1.5, 2.5) if kind == "kidney" else 0.0
    shape = Shape("", kind, radius, aspect, rng.uniform(0, 180), (0.0, 90.0), 0.0, bend_mm=bend)
    return kind, radius * aspect + 1, lambda x, y: np.cos(np.pi / 2 * np.minimum(foot_distance(shape, x, y), 1)) ** 2


def _ellipse(rng: Rng) -> tuple[str, float, Gap]:
    a, power = rng.uniform(11, 18), float(rng.choice([1.0, 1.0, 2.0]))
    bell = Bell(0.0, 0.0, a, min(a * rng.uniform(1, 2), 27.0), rng.uniform(0, np.pi), 1.0, power)
    return "steep" if power > 1 else "smooth", bell.b + 1, bell.gap


def _varied(rng: Rng) -> tuple[str, float, Gap]:
    kind = str(rng.choice(VARIED))
    group = SHAPES[kind](rng)
    reach = rng.uniform(28, 36) if kind == "wrinkle" else rng.uniform(18, 29)
    scale = max(float(np.hypot(*b.centre_mm)) + b.radius_mm for b in group) / reach

    def raw(x: Floats, y: Floats) -> Floats:
        return np.asarray(np.sum([b.gap(scale * x, scale * y) for b in group], axis=0))

    top = float(raw(*np.meshgrid(*2 * (np.linspace(-reach, reach, 201),))).max())
    return kind, reach + 1, lambda x, y: raw(x, y) / top


FAMILIES = {"bells": _bell, "ellipses": _ellipse, "varied": _varied}


def draw(number: int) -> Scene:
    """Return the scene of this number."""
    rng = np.random.default_rng([SEED, number])
    family = list(FAMILIES)[number % len(FAMILIES)]
    name = str(rng.choice(["flat", "cylinder", "saddle", "step"]))
    mold, thickness = MOLDS[name](rng), float(rng.choice([0.25, 0.3, 0.4]))
    ply = Ply(mold, thickness, outlines.of_ply(rng, rng.uniform(255, 275), rng.uniform(185, 205)), ())
    fibre_deg = float(rng.choice([0.0, 45.0, rng.uniform(0, 90)]))
    ceases, placed = bool(rng.random() < 0.5), list[Lift]()
    for _ in range(int(rng.choice(COUNTS))):
        kind, reach, shape = FAMILIES[family](rng)
        near = rng.random() < 0.5
        ratio = rng.uniform(0.75, 1.3) if near else rng.choice([rng.uniform(0.15, 0.75), rng.uniform(1.3, 3)])
        ratio = rng.uniform(0.3, 0.97) if ceases and ratio > 0.97 else ratio
        ratio = 2 - ratio if not ceases and not placed and ratio < 1 else ratio
        for x, y in rng.uniform(-1, 1, (300, 2)) * (140, 105):
            apart = all(np.hypot(x - p.x, y - p.y) > reach + p.a + MARGIN_MM for p in placed)
            if apart and distance(ply.outline, np.array(x), np.array(y)) > reach + MARGIN_MM:
                lift = Lift(float(x), float(y), reach, reach, 0.0, 1.0, 1.0, kind, shape)
                placed.append(_raised(ply, lift, fibre_deg, ratio * limit_excess_mm(thickness)))
                break
    return Scene(
        number, family, name, fibre_deg, replace(ply, bells=tuple(placed)), Camera.above(rng, PIXELS, PITCH_MM)
    )


def excess_mm(ply: Ply, lift: Lift, fibre_deg: float, grid_mm: float = 0.5) -> float:
    """Return the largest excess of a fibre over one pocket, by quadrature."""
    ridge = truth(replace(ply, bells=(lift,)), fibre_deg, grid_mm).any_mm
    return max(0.0, 2 * (ridge - (2 - np.pi / 2) * ply.thickness_mm))


def _raised(ply: Ply, lift: Lift, fibre_deg: float, wanted_mm: float) -> Lift:
    low, high = 0.0, 9.0
    for _ in range(9):
        middle = 0.5 * (low + high)
        less = excess_mm(ply, replace(lift, high=middle), fibre_deg, 1.0) < wanted_mm
        low, high = (middle, high) if less else (low, middle)
    return replace(lift, high=high)


def clouds(scene: Scene) -> dict[str, NDArray[np.float32]]:
    """Return scan and reference, (H, W, 3) in the scanner's frame, NaN where nothing was seen."""
    rng = np.random.default_rng([SEED, scene.number, 1])
    half = np.array(PIXELS) * PITCH_MM * 0.56 + 8
    bare = Patch(replace(scene.ply, thickness_mm=0.0, bells=()).lower, half)
    found = {
        "scan": scene.camera.scan(bare, (Patch(scene.ply.upper, half), scene.ply), rng),
        "reference": scene.camera.scan(bare, None, rng),
    }
    for cloud in found.values():
        cloud[rng.random(cloud.shape[:2]) < MISSED] = np.nan
    return found


def digest(found: dict[str, NDArray[np.float32]]) -> str:
    """Return the SHA-256 of the clouds in whole micrometres, which hides the last bit of another NumPy's sine."""
    total = hashlib.sha256()
    for name in ("scan", "reference"):
        micrometres = np.rint(1e3 * found[name].astype(np.float64))
        total.update(np.nan_to_num(micrometres, nan=-(2.0**31)).astype("<i4").tobytes())
    return total.hexdigest()
