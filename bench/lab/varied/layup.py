"""Make a varied layup: choose at random, render, add faults, and record the truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from lab.varied import faults, molds, placing
from lab.varied.bumps import Bump
from lab.varied.ply import Ply
from lab.varied.polygons import random_ply
from lab.varied.rendering import Clamp, Stage
from lab.varied.scanning import VariedLayup, scanned
from lab.varied.seeing import random_camera
from lab.varied.truth import PEAK_TOL_MM

Floats = NDArray[np.float64]

SEVERITIES = ("benign", "one", "any")


def varied_layup(
    seed: int = 0,
    pixels: tuple[int, int] = (1280, 960),
    *,
    mold: str | None = None,
    pockets: Sequence[str] | int | None = None,
    severity: str | None = None,
    noise: Sequence[str] | None = None,
    holes_mm: Sequence[float] | int | None = None,
    clamp: bool | None = None,
    borders: int | None = None,
    thickness_mm: float = 0.3,
    cut_height_mm: float = 2.0,
) -> VariedLayup:
    """Make a virtual layup of the second family: other molds, pockets, noise and holes than `layup`, by other code.

    The two families share nothing but their attributes, so that anything fitted to one can be tried on the other.
    Everything that is not chosen is drawn at random. The ply's outline, the scanner's pose and its focal length always
    are.

    Parameters
    ----------
    seed
        Seed, not negative. The same seed and arguments give the same bits.
    pixels
        Width and height of the image, at least 64 each.
    mold
        "saddle", "dome", "flanks" (up to 45 degrees), "step", "ribs" (and grooves), "waves" or "cliff" (a part smaller
        than the image, above a table). Default: any of them.
    pockets
        Kinds of pockets: "gaussians", "wrinkle", "lobes", "crescent", "ring", "superposed", "merging", "edge",
        "corner", "edge to edge", "small" (below the tolerance on area), "thin" (a wrinkle 4 to 12 mm wide); or a number
        of the usual ones. Those for which there is no room are left out. Default: 2 to 10, seldom with one of the last
        three.
    severity
        "benign": little excess length in each; "one": the first has more than any limit allows; "any": each has from
        0.1 to 6 mm. Default: any of these three.
    noise
        Kinds of noise: "correlated", "range" (grows with depth), "quantised", "banding", "highlights", "flying"; white
        noise is always added. Default: each with a probability of a third.
    holes_mm
        Widths of drop-outs at random places of the scan, or a number of them of 2 to 100 mm. Default: none to 6 of 2 to
        15 mm.
    clamp
        Whether a clamp lies on the ply's edge. Default: with a probability of one in eight.
    borders
        Number of loose borders of the ply, 0.3 to 3 mm high and 60 to 260 mm wide. Default: one in five layups has one.
    thickness_mm
        Thickness of the ply, along z.
    cut_height_mm
        Height above the mold at which the truth's areas are taken.

    Returns
    -------
    VariedLayup
        Scan and reference, each with its own faults, pose, camera, outline, fibre angles, mask and truth.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range.

    Examples
    --------
    >>> scene = varied_layup(seed=1, pixels=(64, 64), mold="saddle", pockets=["ring", "crescent"])
    >>> scene.scan.shape, scene.truth.mold_kind
    ((64, 64, 3), 'saddle')
    >>> sorted({kind for pocket in scene.truth.pockets for kind in pocket.kinds})
    ['crescent', 'ring']
    """
    _check(seed, pixels, mold, pockets, severity, noise)
    # Each part has its own generator, so that a choice by the caller does not change what is drawn for the others.
    draw = [np.random.default_rng([seed, part]) for part in range(7)]
    outline = random_ply(draw[0])
    angles = ((0.0, 90.0), (45.0, -45.0), (30.0, 120.0), (0.0, 90.0))[int(draw[0].integers(4))]
    kind = str(draw[1].choice(list(molds.KINDS)))
    ground = molds.make_mold(draw[1], kind if mold is None else mold, outline)
    bumps = _bumps(draw[2], pockets, severity, outline, angles, cut_height_mm - thickness_mm + PEAK_TOL_MM + 0.2)
    loose = int(draw[3].random() < 0.2) if borders is None else borders
    bumps += [placing.random_border(draw[3], outline) for _ in range(loose)]
    ply = Ply(ground, outline, thickness_mm, tuple(bumps))
    around = outline if ground.part_outline is None else ground.part_outline
    crest = float(ground.smooth_height(*around.T).max())
    camera = random_camera(draw[4], pixels, around, crest)
    has_clamp = bool(draw[5].random() < 1 / 8) if clamp is None else clamp
    bar = _clamp(draw[5], ply) if has_clamp else None
    eye = camera.centre + camera.rotation[:, 0] * draw[4].uniform(300, 1000)
    stage = Stage(camera, eye, ply, bar)
    return scanned(
        draw[6],
        stage,
        angles,
        faults.random_noise(draw[6], None if noise is None else tuple(noise)),
        holes_mm,
        cut_height_mm,
    )


def _check(
    seed: int,
    pixels: tuple[int, int],
    mold: str | None,
    pockets: Sequence[str] | int | None,
    severity: str | None,
    noise: Sequence[str] | None,
) -> None:
    if not isinstance(seed, int) or seed < 0:
        raise InputError(f"seed: expected an integer from 0, but got {seed!r}")
    if len(pixels) != 2 or min(pixels) < 64:
        raise InputError(f"pixels: expected width and height of at least 64, but got {pixels!r}")
    kinds = () if pockets is None or isinstance(pockets, int) else tuple(pockets)
    for name, given, known in (
        ("mold", () if mold is None else (mold,), tuple(molds.KINDS)),
        ("pockets", kinds, tuple(placing.SHAPES)),
        ("severity", () if severity is None else (severity,), SEVERITIES),
        ("noise", () if noise is None else tuple(noise), faults.KINDS),
    ):
        for value in given:
            if value not in known:
                raise InputError(f"{name}: expected one of {', '.join(known)}, but got {value!r}")


def _bumps(
    rng: np.random.Generator,
    pockets: Sequence[str] | int | None,
    severity: str | None,
    outline: Floats,
    angles: tuple[float, float],
    low_mm: float,
) -> list[Bump]:
    """Choose, scale and place the pockets."""
    style = str(rng.choice(SEVERITIES)) if severity is None else severity
    count = int(rng.integers(2, 11)) if pockets is None else pockets if isinstance(pockets, int) else 0
    kinds = [str(k) for k in rng.choice(placing.USUAL, count)] if count or pockets is None else list(pockets)  # type: ignore[arg-type]
    if pockets is None and rng.random() < 0.15:
        kinds.insert(0, str(rng.choice(["edge to edge", "small", "thin"])))
    bumps: list[Bump] = []
    for number, kind in enumerate(kinds):
        group = placing.SHAPES[kind](rng)
        wanted = float(np.exp(rng.uniform(np.log(0.1), np.log(6.0))))
        if style == "benign" or (style == "one" and number > 0):
            wanted = float(rng.uniform(0.1, 0.6))
        elif style == "one":
            wanted = float(rng.uniform(1.4, 5.0))
        group = placing.with_excess(group, wanted, angles, low_mm)
        placed = placing.place(rng, kind, group, outline, bumps)
        if placed is not None:
            bumps += placed
    return bumps


def _clamp(rng: np.random.Generator, ply: Ply) -> Clamp:
    """Lay a bar across the ply's edge, reaching 10 to 60 mm onto the ply."""
    k = int(rng.integers(len(ply.outline)))
    a, b = ply.outline[k], ply.outline[(k + 1) % len(ply.outline)]
    along = (b - a) / np.hypot(*(b - a))
    inward = np.array([-along[1], along[0]])
    half = rng.uniform(20, 60)
    middle = a + (b - a) * rng.uniform(0.15, 0.85) + inward * (rng.uniform(10, 60) - half)
    line = middle + np.linspace(-half, half, 50)[:, None] * inward
    top = float((ply.mold.smooth_height(*line.T) + ply.gap(*line.T)).max()) + rng.uniform(10, 30)
    angle = float(np.arctan2(inward[1], inward[0]))
    return Clamp((float(middle[0]), float(middle[1])), angle, float(half), float(rng.uniform(8, 30)), float(top))
