"""Scenes by number: what lies on a mold, what an inspector is given, and the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lab.third import filters, outlines
from lab.third.camera import Camera, Patch
from lab.third.molds import MOLDS
from lab.third.ply import Bell, Ply, Truth, truth

__all__ = ["CLASSES", "RIGHT", "Scene", "scene"]

Floats = NDArray[np.float64]
PIXELS, PITCH_MM = (316, 250), 0.7
THICKNESSES_MM = (0.13, 0.18, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6)
RIGHT = ("flat", "ceases", "creases", "at the edge")
# Of a hundred scenes.
CLASSES = {"flat": 18, "ceases": 12, "creases": 12, "at the edge": 8,
           **{f"outline: {kind}": 2 for kind in outlines.WRONG},
           "image filtered": 12, "list filtered": 10, "hole filled": 3, "two frames": 4, "reference": 5}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """What an inspector is given, and the truth.

    Attributes
    ----------
    kind, mold, what
        The class, the kind of mold, and details in words.
    scan, reference
        (H, W, 3) or (N, 3), scanner's frame, mm.
    outline
        (M, 2), as it is given; None: none.
    fibre_deg
        Direction of the first family of fibres; the second lies across it.
    """

    kind: str
    mold: str
    what: str
    scan: NDArray[np.float32]
    reference: NDArray[np.float32]
    outline: Floats | None
    fibre_deg: float
    mold_from_scanner: Floats
    thickness_mm: float
    truth: Truth


def scene(number: int, kind: str | None = None) -> Scene:
    """Return the scene of this number, of its own class or of a given one."""
    rng = np.random.default_rng([33, number])
    names, shares = list(CLASSES), np.array(list(CLASSES.values()), dtype=float)
    drawn = str(rng.choice(names, p=shares / shares.sum()))
    kind = kind or drawn
    mold_name = str(rng.choice(list(MOLDS)))
    mold = MOLDS[mold_name](rng)
    thickness = float(rng.choice(THICKNESSES_MM))
    edge = outlines.of_ply(rng, rng.uniform(150, 172), rng.uniform(112, 130))
    fibre_deg = float(rng.choice([0.0, 45.0, rng.uniform(0, 90)]))
    ply = Ply(mold, thickness, edge, ())
    if kind != "flat":
        ply = _with_pocket(ply, fibre_deg, kind, rng)
    camera = Camera.above(rng, PIXELS, PITCH_MM)
    half = np.array(PIXELS) * PITCH_MM * 0.56 + 8
    bare = Patch(Ply(mold, 0.0, edge, ()).lower, half)
    top = (Patch(ply.upper, half), ply)
    scan, reference = camera.scan(bare, top, rng), camera.scan(bare, None, rng)
    given: Floats | None = edge
    what = ""
    if kind in RIGHT:
        what = str(rng.choice(["image", "image", "list", "no outline"]))
        if what == "list":
            scan, reference = filters.as_list(scan, rng), filters.as_list(reference, rng)
        if what == "no outline":
            given = None
    elif kind.startswith("outline: "):
        given = outlines.wrong(kind.removeprefix("outline: "), edge, rng)
    elif kind in ("image filtered", "list filtered"):
        image = kind == "image filtered"
        what = str(rng.choice(list(filters.IMAGES if image else filters.LISTS)))
        both = rng.random() < 0.5 or "every" in what

        def by(cloud: NDArray[np.float32]) -> NDArray[np.float32]:
            return filters.IMAGES[what](cloud) if image else filters.LISTS[what](cloud, rng)

        plain = (lambda cloud: cloud) if image else (lambda cloud: filters.as_list(cloud, rng))
        scan, reference = by(scan), (by if both else plain)(reference)
        if rng.random() < 0.4:
            given, what = None, f"{what}, no outline"
        what += ", the reference too" if both else ""
    elif kind == "hole filled":
        scan, what = _filled(scan, camera, ply), "image"
        if rng.random() < 0.5:
            scan, reference, what = filters.as_list(scan, rng), filters.as_list(reference, rng), "list"
    elif kind == "two frames":
        scan = (0.5 * (scan.astype(np.float64) + camera.scan(bare, None, rng))).astype(np.float32)
    elif kind == "reference":
        share = rng.uniform(0.5, 1.0)
        humped = replace(ply, thickness_mm=0.0, bells=tuple(replace(b, high=share * b.high) for b in ply.bells))
        reference = camera.scan(Patch(humped.lower, half), None, rng)
        what = f"holds {100 * share:.0f} % of it"
    return Scene(kind, mold_name, what, scan, reference, given, fibre_deg, camera.mold_from_scanner, thickness,
                 truth(ply, fibre_deg))  # fmt: skip


def _with_pocket(ply: Ply, fibre_deg: float, kind: str, rng: np.random.Generator) -> Ply:
    """Return a ply with a pocket whose fibres make a ridge of a wanted height if they are held."""
    least = (2 - np.pi / 2) * ply.thickness_mm
    wanted = rng.uniform(least + 0.05, 0.45) if kind == "ceases" else rng.uniform(0.68, 1.4)
    if kind == "at the edge":
        wanted = rng.uniform(least + 0.05, 1.4)
    half = 0.5 * np.ptp(ply.outline, axis=0)
    a = float(np.exp(rng.uniform(np.log(8), np.log(26))))
    b = float(min(a * rng.uniform(1, 2.2), 30.0))
    middle = rng.uniform(-1, 1, 2) * np.maximum(half - 30 - b, 3)
    if kind == "at the edge":
        side = rng.integers(4)
        middle[side % 2] = (half[side % 2] - rng.uniform(-0.3, 1.0) * a) * (1 if side < 2 else -1)
    elif kind.startswith("outline: ") and rng.random() < 0.5:
        middle = rng.uniform(-1, 1, 2) * np.maximum(half - 27 - a, 3)
    x, y = middle.tolist()
    bell = Bell(x, y, a, b, rng.uniform(0, np.pi), 1.0, float(rng.choice([1.0, 1.0, 2.0])))
    whole = replace(ply, outline=10 * ply.outline)  # the whole bell makes the ridge, also where the edge cuts it
    low, high = 0.0, min(7.0, 0.45 * a)
    for _ in range(9):
        middle_high = 0.5 * (low + high)
        ridge = truth(replace(whole, bells=(replace(bell, high=middle_high),)), fibre_deg, 1.0).any_mm
        low, high = (middle_high, high) if ridge < wanted else (low, middle_high)
    return replace(ply, bells=(replace(bell, high=high),))


def _filled(scan: NDArray[np.float32], camera: Camera, ply: Ply) -> NDArray[np.float32]:
    """Return a scan in which the pocket was a hole that its software filled."""
    bell = ply.bells[0]
    pose = camera.mold_from_scanner
    at = scan.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    round_it = replace(bell, a=bell.a + 2, b=bell.b + 2, high=1.0, power=1.0).gap(at[:, 0], at[:, 1]) > 0
    return filters.filled_linearly(scan, round_it.reshape(scan.shape[:2]))
