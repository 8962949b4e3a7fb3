"""Layups of a stranger, who read README.md and docs alone: parts, scanners and exports that no other family has.

A part is a mold and a lift of the ply's lower side above it; its truth is the arc of straight fibres over the ply less
that over the mold. A chain makes scan, reference and what an inspector is given. No class may let a ply pass that
creases; a class is right if a ply that ceases has to be judged by it.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import cv2
import numpy as np
from scipy.fft import dctn, idctn
from scipy.interpolate import RBFInterpolator
from scipy.ndimage import distance_transform_edt, median_filter

import debulk

W, H, BORDER_MM, T_MM, LIMIT_MM = 280.0, 220.0, 45.0, 0.3, 0.6  # of the ply, and of the mold round it
FLAT_MM = (2 - np.pi / 2) * T_MM  # ridge by the formula without an excess
VERDICTS = ("CEASE", "CREASE", "UNDECIDED", "INVALID", "refused", "crashed")


def bump(x, y, high, cx, cy, a, b, turn, kind):
    """A bump on an ellipse with the half widths a and b: a bell, a cap with a kink at its foot, a flat top, a tent."""
    c, s = np.cos(turn), np.sin(turn)
    r2 = np.minimum(((c * (x - cx) + s * (y - cy)) / a) ** 2 + ((c * (y - cy) - s * (x - cx)) / b) ** 2, 1.0)
    r = np.sqrt(r2)
    shapes = {"bell": np.cos(np.pi / 2 * r) ** 2, "cap": 1 - r2, "top": (1 - r2**2) ** 2, "tent": (1 - r) ** 2}
    return high * shapes[kind]


@dataclass
class Part:
    """A mold and a ply W by H on it, whose lower side stands off it by `lift`."""

    mold: Callable
    bumps: list = field(default_factory=list)
    rest: Callable = lambda x, y: 0 * x
    window: tuple[float, float, float] = (0.0, 0.0, 0.0)  # centre and radius of a hole cut into the ply
    angles: tuple[float, float] = (0.0, 90.0)
    bridged: bool = False  # so short over a hollow that a bridge above the limit stays
    factor: float = 1.0
    outline = np.array([(0.0, 0.0), (W, 0.0), (W, H), (0.0, H)])

    def covers(self, x, y):
        cx, cy, r = self.window
        return (x >= 0) & (x <= W) & (y >= 0) & (y <= H) & (np.hypot(x - cx, y - cy) >= r)

    def lift(self, x, y):
        return self.factor * sum((bump(x, y, *b) for b in self.bumps), 0 * x) + self.rest(x, y)

    def ply(self, x, y):
        """The ply's upper side, a thickness off the lower one along its normal; the mold where no ply is."""
        low = lambda u, v: self.mold(u, v) + self.lift(u, v)  # noqa: E731
        gx, gy = (low(x + 0.05, y) - low(x - 0.05, y)) / 0.1, (low(x, y + 0.05) - low(x, y - 0.05)) / 0.1
        return np.where(self.covers(x, y), low(x, y) + T_MM * np.sqrt(1 + gx**2 + gy**2), self.mold(x, y))

    def ridges(self):
        """What one fold of held fibres has at least, and what any fibre could have at most, as ridges in mm."""
        least, most, step = 0.0, 0.0, 0.25
        along = np.arange(-190.0, 190.0, step)
        for angle in np.radians(self.angles):
            c, s = np.cos(angle), np.sin(angle)
            for v in np.arange(-180.0, 180.0, 1.5):
                x, y = W / 2 + c * along - s * v, H / 2 + s * along + c * v
                on, g, m = self.covers(x, y), self.lift(x, y), self.mold(x, y)
                e = np.where(on[1:] & on[:-1], np.hypot(step, np.diff(m + g)) - np.hypot(step, np.diff(m)), 0.0)
                ends = np.flatnonzero(np.diff(np.concatenate([[0], on, [0]])))
                for first, last in zip(ends[::2], ends[1::2], strict=True):
                    off = np.flatnonzero(g[first:last] > 0.02) + first
                    for joined_mm in (15.0, 35.0) if len(off) else ():  # flat ply that one fold surely, or maybe, draws
                        for run in np.split(off, np.flatnonzero(np.diff(off) * step > joined_mm) + 1):
                            ridge = e[max(run[0] - 4, first) : run[-1] + 4].sum() / 2 + FLAT_MM
                            most = max(most, ridge)
                            if joined_mm == 15.0 and min(run[0] - first, last - 1 - run[-1]) * step >= 25.0:
                                least = max(least, ridge)
        return least, most


# Parts


def some(rng, a=(9, 32), n=None):
    """Bumps that keep off the ply's edge."""
    for _ in range(n or rng.integers(1, 4)):
        half = rng.uniform(*a)
        at = rng.uniform(50 + half, W - 50 - half), rng.uniform(50 + half, H - 50 - half)
        kind = str(rng.choice(["bell", "cap", "top"]))
        yield half / 10, *at, half, half * rng.uniform(1, 2), rng.uniform(0, np.pi), kind


def any_mold(rng):
    r = rng.uniform(350, 1500)
    return [
        lambda x, y: 0 * x,
        lambda x, y: np.sqrt(r**2 - (x - 140) ** 2) - r,
        lambda x, y: np.sqrt(r**2 - (x - 140) ** 2 - (y - 110) ** 2) - r,
        lambda x, y: (x - 140) * (y - 110) / r,
        lambda x, y: 12 * np.sin(x / 80) + 8 * np.cos(y / 70),
    ][rng.integers(5)]


def plain(rng, **given):
    return Part(**({"mold": any_mold(rng), "bumps": list(some(rng))} | given))


def small(rng):
    return plain(rng, bumps=list(some(rng, (7, 11), 1)))


def tents(rng):
    """Over a crumb: a tip sharper than the ply can bend to."""
    return plain(rng, bumps=[(*one[:-1], "tent") for one in some(rng, (8, 20), 1)])


def bridge(rng):
    """A female corner that the ply rounds more widely than it is, and friction over both flanks holds the ply."""
    narrow, wide, k = rng.uniform(8, 14), rng.uniform(26, 34), np.tan(np.radians(rng.uniform(22, 32)))
    vee = lambda x, b: k * np.maximum(np.abs(x - 140), 0.5 * np.minimum((x - 140) ** 2 / b + b, 2 * b))  # noqa: E731
    rest = lambda x, y: np.maximum(vee(x, wide) - vee(x, narrow), 0)  # noqa: E731
    return Part(mold=lambda x, y: vee(x, narrow) + 0 * y, rest=rest, bridged=True)


def chamfer(rng):
    """A core below: a rounded ramp of 15 to 32 degrees."""
    k, rise, r = np.tan(np.radians(rng.uniform(15, 32))), rng.uniform(6, 20), rng.uniform(6, 20)
    soft = lambda u: (u + np.sqrt(u**2 + r**2)) / 2  # noqa: E731
    return plain(rng, mold=lambda x, y: k * (soft(x - 110) - soft(x - 110 - rise / k)) + 0 * y)


def drop_off(rng):
    """The edge of one to three plies below, down which this ply makes a ramp."""
    at, high, wide, low = rng.uniform(80, 220), 0.25 * rng.integers(1, 4), rng.uniform(2, 5), any_mold(rng)
    step = lambda x, y, long: low(x, y) + high * np.clip(1 + (x + 0.2 * y - at - 20) / long, 0, 1)  # noqa: E731
    rest = lambda x, y: np.maximum(step(x, y, wide * high) - step(x, y, 0.2), 0)  # noqa: E731
    return plain(rng, mold=lambda x, y: step(x, y, 0.2), rest=rest)


def fabric(rng):
    low, a, p, q = any_mold(rng), rng.uniform(0.01, 0.05), *rng.uniform(2.5, 6, 2)
    weave = lambda x, y, p: a * np.sin(2 * np.pi * x / p) * np.sin(2 * np.pi * y / p)  # noqa: E731
    return plain(rng, mold=lambda x, y: low(x, y) + weave(x, y, p), rest=lambda x, y: np.maximum(weave(x, y, q), 0))


def washboard(rng):
    pitch, wide = rng.uniform(9, 22), rng.uniform(50, 110)
    each = [(1.0, 100 + i * pitch, 110.0, pitch / 2, 45.0, 0.0, "bell") for i in range(int(wide // pitch) + 1)]
    return plain(rng, bumps=each)


def overlaps(rng):
    """Tapes that overlap by 1.5 to 4 mm."""
    wide, lap = rng.uniform(30, 70), rng.uniform(1.5, 4)
    return plain(rng, rest=lambda x, y: T_MM * np.clip(lap / 2 + 1 - np.abs((y + wide / 2) % wide - wide / 2), 0, 1))


def joggle(rng):
    at, rise, run = rng.uniform(90, 190), rng.uniform(1, 5), rng.uniform(3, 10)
    return plain(rng, mold=lambda x, y: rise * (np.tanh((x + 0.1 * y - at) / run * 2) + 1) / 2)


def beads(rng):
    """Not right: in a hollow a bump makes fibres too short, which bridge, and the truth knows no such bridge."""
    pitch, high = rng.uniform(45, 90), rng.uniform(2, 6)
    return plain(rng, mold=lambda x, y: high * np.sin(2 * np.pi * x / pitch) + 0 * y)


def in_a_row(rng):
    """Five narrow bumps along one fibre, 8 mm of ply between them."""
    a, b = rng.uniform(5, 8), rng.uniform(10, 20)
    return plain(rng, bumps=[(1.0, 90 + i * (2 * a + 8), 110.0, a, b, 0.0, "bell") for i in range(5)])


def diagonal(rng):
    a, turn = rng.uniform(6, 14), rng.choice([-1, 1]) * np.pi / 4
    return plain(rng, bumps=[(1.0, 140.0, 110.0, a, 4 * a, turn, "bell")])


def dented(rng):
    a, low = rng.uniform(18, 35), -rng.uniform(0.4, 0.9)
    dent = (low, 140 + rng.uniform(-6, 6), 110.0, a / 2, a / 2, 0.0, "bell")
    return plain(rng, bumps=[(1.0, 140.0, 110.0, a, a, 0.0, "cap"), dent])


def pyramid(rng):
    """Three plane faces that meet in a point."""
    part, a, turn = (
        plain(rng, bumps=[(0.0, 140.0, 110.0, 1.0, 1.0, 0.0, "bell")]),
        rng.uniform(12, 30),
        rng.uniform(0, 2),
    )
    across = [(np.cos(t), np.sin(t)) for t in turn + 2 * np.pi / 3 * np.arange(3)]
    faces = lambda x, y: [1 - 2 * (c * (x - 140) + s * (y - 110)) / a for c, s in across]  # noqa: E731
    part.lift = lambda x, y: part.factor * a / 12 * np.maximum(np.minimum.reduce(faces(x, y)), 0)
    return part


def dimples(rng):
    """A field of bumps, each below the tolerances, three rows of them on common fibres."""
    pitch, n = rng.uniform(10, 22), int(rng.integers(4, 12))
    at = [(140 + (i - n / 2) * pitch, 110 + j * pitch) for i in range(n) for j in (-1, 0, 1)]
    return plain(rng, bumps=[(1.0, *xy, pitch * 0.4, pitch * 0.4, 0.0, "bell") for xy in at])


def engraved(rng):
    """Lines engraved into the mold, which the ply spans."""
    low, pitch, wide, deep = any_mold(rng), rng.uniform(15, 60), rng.uniform(0.5, 2.5), rng.uniform(0.1, 0.6)
    off = lambda x, y: (x + 0.3 * y) % pitch / wide * 2 - pitch / wide  # noqa: E731
    groove = lambda x, y: deep * np.maximum(1 - off(x, y) ** 2, 0)  # noqa: E731
    return plain(rng, mold=lambda x, y: low(x, y) - groove(x, y), rest=groove)


def pins(rng):
    """Sunk marks of ejector pins, which the ply spans."""
    low, r, deep = any_mold(rng), rng.uniform(3, 7), rng.uniform(0.05, 0.25)
    at = rng.uniform((30, 30), (250, 190), (4, 2))
    disc = lambda x, y: deep * np.clip(5 * (r - np.min([np.hypot(x - a, y - b) for a, b in at], axis=0)), 0, 1)  # noqa: E731
    return plain(rng, mold=lambda x, y: low(x, y) - disc(x, y), rest=disc)


def long_bump(rng):
    a = rng.uniform(6, 12)
    return plain(rng, bumps=[(1.0, 140.0, 110.0, a, rng.uniform(2, 4) * a, rng.choice([0, np.pi / 2]), "cap")])


# Chains


def shot(rng, part, which, dx=0.9, dy=0.9, noise=0.02, line=0.0, jitter=0.0):
    """(H, W, 3) points of a scanner that looks straight down; `line`: noise that a line of points shares."""
    x, y = np.meshgrid(np.arange(-BORDER_MM, W + BORDER_MM, dx), np.arange(-BORDER_MM, H + BORDER_MM, dy))
    x, y = x + jitter * dx * rng.uniform(-0.5, 0.5, x.shape), y + jitter * dy * rng.uniform(-0.5, 0.5, x.shape)
    z = getattr(part, which)(x, y) + rng.normal(0, noise, x.shape) + line * rng.normal(0, 1, (len(x), 1))
    return np.stack([x, y, z], axis=-1)


def scans(rng, part, change=None, both=True, image=None, **how):
    """Scan and reference as images or as lists of points, the scan or both of them changed."""
    scan, reference = (shot(rng, part, which, **how) for which in ("ply", "mold"))
    if change:
        scan, reference = change(rng, scan), change(rng, reference) if both else reference
    if image if image is not None else rng.random() < 0.5:
        return scan, reference, {"mold_from_scanner": np.eye(4)}
    return scan.reshape(-1, 3), reference.reshape(-1, 3), {}


def raised(cloud, by):
    return np.concatenate([cloud[..., :2], cloud[..., 2:] + np.asarray(by)[..., None]], axis=-1)


def blurred(z, cells):
    k = np.exp(-0.5 * (np.arange(-20, 21) / cells) ** 2)
    for axis in (0, 1):
        ones = np.apply_along_axis(np.convolve, axis, np.ones_like(z), k, mode="same")
        z = np.apply_along_axis(np.convolve, axis, z, k, mode="same") / ones
    return z


def smoothed(rng, cloud, thin=1):
    n, z = int(rng.integers(1, thin + 1)), blurred(cloud[..., 2], rng.uniform(1.5, 4.5) / 0.9)
    return np.dstack([cloud[..., :2], z])[::n, ::n]


def rounded(rng, cloud):
    step = rng.choice([0.1, 0.25, 0.5])
    return np.dstack([cloud[..., :2], np.round(cloud[..., 2] / step) * step])


def clipped(rng, cloud):
    """The depth range ends below the tops: they get its last value, or are not seen."""
    z = cloud[..., 2]
    return np.dstack([cloud[..., :2], np.where(z > z.max() - 2.0, rng.choice([z.max() - 2.0, np.nan]), z)])


def steep_lost(rng, cloud):
    gy, gx = np.gradient(blurred(cloud[..., 2], 1.5), 0.9)
    return np.where((np.hypot(gx, gy) > rng.uniform(0.15, 0.4))[..., None], np.nan, cloud)


def marked(rng, cloud):
    """A number in place of what was not seen."""
    x, y = rng.uniform(0, W), rng.uniform(0, H)
    hole = np.hypot(cloud[..., 0] - x, cloud[..., 1] - y) < rng.uniform(2, 6)
    return np.where(hole[..., None], rng.choice([0.0, -9999.0, 1e10, np.nan]), cloud)


def voxels(rng, cloud):
    p = cloud.reshape(-1, 3)
    cell = np.unique(np.floor(p / rng.uniform(1.5, 3.5)).astype(int), axis=0, return_inverse=True)[1].ravel()
    return np.column_stack([np.bincount(cell, p[:, k]) / np.bincount(cell) for k in range(3)])


def bagged(rng, cloud):
    """A bag lies on what is high and spans what is between: a closing by a square."""
    z, reach = cloud[..., 2], int(rng.uniform(5, 25))
    for choose in (np.maximum, np.minimum):
        for axis in (0, 1):
            z = choose.reduce([np.roll(z, s, axis) for s in range(-reach, reach + 1)])
    return np.dstack([cloud[..., :2], z + rng.choice([0, 0.03, 0.06]) + rng.normal(0, 0.02, z.shape)])


def filmed(rng, cloud):
    strip = np.abs(cloud[..., 0] - rng.uniform(20, 200)) < rng.uniform(8, 40)
    return raised(cloud, np.where(strip, rng.uniform(0.05, 0.12), 0.0))


def seam(rng, cloud):
    return raised(
        cloud, np.where(cloud[..., 0] > rng.uniform(60, 220), rng.choice([-1, 1]) * rng.uniform(0.05, 0.2), 0)
    )


def two_scanners(rng, cloud):
    """Two scanners that overlap, one of them out of place by some tenths of a millimetre."""
    p, x = cloud.reshape(-1, 3), cloud[..., 0].ravel()
    return np.concatenate([p[x < 175], p[x > 105] + rng.uniform(-0.3, 0.3, 3) + rng.normal(0, 0.01, (sum(x > 105), 3))])


def as_built(rng, part):
    """The reference is the drawing, and the mold was built some hundredths or tenths off."""
    scan, reference, how = scans(rng, part)
    wave = np.sin(scan[..., 0] * 2 * np.pi / rng.uniform(100, 400)) * np.cos(scan[..., 1] / rng.uniform(20, 60))
    return raised(scan, rng.choice([0.02, 0.05, 0.1, 0.3]) * wave), reference, how


def moved(rng, part):
    """All lies in the frame of a robot, whose z points up or down to the mold, up to a kilometre away."""
    scan, reference, _ = scans(rng, part, image=True)
    away, pose = rng.choice([-1, 1], 3) * rng.choice([300.0, 1e4, 1e6]) * [1, 0.7, 0.01], np.eye(4)
    away[2] = rng.choice([-300.0, 300.0])
    pose[:3, 3] = -away
    return scan + away, reference + away, {"mold_from_scanner": pose}


def averaged(rng, part):
    """Frames from before and after the ply was laid, averaged: all heights above the mold are too small."""
    scan, reference, how = scans(rng, part)
    low = part.mold(scan[..., 0], scan[..., 1])
    return raised(scan, rng.uniform(-0.3, -0.1) * (scan[..., 2] - low)), reference, how


def flattened(rng, cloud):
    """The scanner's z is calibrated too short."""
    return cloud * [1, 1, 0.8]


def stretched(rng, part):
    """Scan and reference were taken at other temperatures, or the scale of one axis has drifted."""
    scan, reference, how = scans(rng, part)
    scale = rng.choice([[1.0005] * 3, [1.002, 1, 1], [1, 0.998, 1], [1, 1, 1.01]])
    return (scan - [140, 110, 0]) * scale + [140, 110, 0], reference, how


def turned_over(rng, part):
    """The scan's x runs the other way, or its x and y are swapped."""
    scan, reference, how = scans(rng, part, image=False)
    return [scan * [-1, 1, 1] + [W, 0, 0], scan[:, [1, 0, 2]]][rng.integers(2)], reference, how


def shadowed(rng, cloud):
    """A robot's arm stood in a part of the frames that were averaged: where it was, its height is mixed in, or all."""
    off = np.abs(cloud[..., 0] - rng.uniform(20, 260) + rng.uniform(-0.5, 0.5) * cloud[..., 1])
    z = rng.choice([np.nan, 0.05, 0.3]) * 200 if rng.random() < 0.7 else 0.3
    return raised(cloud, np.where(off < rng.uniform(4, 15), z, 0.0))


def shaken(rng, cloud):
    """The mean of frames between which the scanner swung by some pixels."""
    z, reach = cloud[..., 2], int(rng.integers(3, 9))
    return np.dstack([cloud[..., :2], np.mean([np.roll(z, k, 1) for k in range(-reach, reach + 1)], axis=0)])


def splined(rng, cloud):
    """The vendor fills the hole in which a pocket's top was, by a thin plate through the hole's rim."""
    top = np.array(np.unravel_index(np.argmax(cloud[..., 2] - blurred(cloud[..., 2], 18)), cloud.shape[:2]))
    far = np.hypot(*(np.indices(cloud.shape[:2]) - top[:, None, None])) * 0.9
    out, radius = cloud.copy(), rng.uniform(6, 20)
    hole, rim = far < radius, (far >= radius) & (far < radius + 2)
    fill = RBFInterpolator(cloud[rim][:, :2], cloud[rim][:, 2], neighbors=60, kernel="thin_plate_spline")
    out[hole, 2] = fill(cloud[hole][:, :2])
    return out


def meshed(rng, cloud):
    """Points at random on the triangles of a mesh that was decimated."""
    n = int(rng.integers(2, 5))
    ends = cloud[::n, ::n]
    i, j = (rng.uniform(0, size - 1.001, cloud.shape[0] * cloud.shape[1]) for size in ends.shape[:2])
    a, b = i.astype(int), j.astype(int)
    u, v = (i - a)[:, None], (j - b)[:, None]
    flip = u + v > 1
    corner = np.where(flip, ends[a + 1, b + 1], ends[a, b])
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    along = np.where(flip, ends[a, b + 1], ends[a + 1, b]), np.where(flip, ends[a + 1, b], ends[a, b + 1])
    return corner + u * (along[0] - corner) + v * (along[1] - corner)


def in_unit(rng, part):
    """The scan, or both clouds, in metres, micrometres or inches."""
    scan, reference, how = scans(rng, part)
    unit = rng.choice([1e-3, 1e3, 1 / 25.4])
    return scan * unit, reference * (unit if rng.random() < 0.5 else 1), how


def messy(rng, cloud):
    """A list in another order, with doubles, without a point here and there, and with rows that are not a number."""
    p = cloud.reshape(-1, 3)[rng.random(cloud.size // 3) < rng.uniform(0.7, 1)]
    p = np.concatenate([p, p[rng.random(len(p)) < rng.uniform(0, 0.5)], np.full((500, 3), np.nan)])
    return p[[np.argsort(p[:, 2]), np.argsort(p[:, 0]), rng.permutation(len(p))][rng.integers(3)]].astype(np.float64)


def thinner_reference(rng, part):
    """The reference is exported every few points, the scan whole."""
    scan, reference, how = scans(rng, part, image=True)
    n = int(rng.integers(2, 4))
    return scan, reference[::n, ::n], how


def bilateral(rng, cloud):
    z = cv2.bilateralFilter(cloud[..., 2].astype(np.float32), 5, rng.uniform(0.5, 2), rng.uniform(1, 3))
    return np.dstack([cloud[..., :2], z])


def at_border(rng, part):
    """The image ends at the top of a pocket, the ply goes on, and its outline is not given."""
    scan, reference, how = scans(rng, part)
    part.outline, end = None, part.bumps[0][1] + rng.uniform(-4, 4)
    if scan.ndim == 3:
        return scan[:, scan[0, :, 0] < end], reference[:, scan[0, :, 0] < end], how
    return scan[scan[:, 0] < end], reference[reference[:, 0] < end], how


def half_outlined(rng, part):
    """The outline ends between two pockets, or beside the only one."""
    part.outline = np.minimum(part.outline, [part.bumps[0][1] - part.bumps[0][3] - rng.uniform(2, 12), H])
    return scans(rng, part)


def top_of(cloud):
    """The place of what stands out most."""
    rest = cloud[..., 2] - blurred(cloud[..., 2], 18)
    return cloud[np.unravel_index(np.argmax(rest), rest.shape)]


def slipped(rng, cloud):
    """The phase of a rectangle over a pocket was unwrapped by one fringe too few."""
    x, y, _ = top_of(cloud)
    a, b = rng.uniform(8, 40, 2)
    inside = (np.abs(cloud[..., 0] - x) < a) & (np.abs(cloud[..., 1] - y) < b)
    return raised(cloud, np.where(inside, -rng.uniform(0.5, 6), 0.0))


def rippled(rng, cloud):
    """The ply moved while the patterns were shown: waves of a multiple of the fringes' frequency."""
    return raised(cloud, rng.uniform(0.02, 0.15) * np.sin(2 * np.pi * cloud[..., 0] / rng.uniform(3, 20)))


def strips(rng, cloud):
    """Strips that were taken one after the other, while the scanner drifted."""
    number = np.floor((cloud[..., 1] + BORDER_MM + 1) / rng.uniform(20, 60)).astype(int)
    drift = np.cumsum(rng.normal(0, rng.uniform(0.01, 0.06), number.max() + 1))
    return raised(cloud, (drift - drift.mean())[number])


def half_precision(rng, part):
    """Exported as float16, near by or a metre off."""
    scan, reference, _ = scans(rng, part, image=True)
    pose, far = np.eye(4), np.array([0.0, 0.0, rng.choice([0.0, -400.0, -1000.0])])
    pose[:3, 3] = -far
    return (scan + far).astype(np.float16).astype(np.float32), reference + far, {"mold_from_scanner": pose}


def reordered(rng, part):
    """The image's rows are swapped in pairs, begin in the middle, or come by halves."""
    scan, reference, how = scans(rng, part, image=True)
    n = np.arange(len(scan))
    return (
        scan[[np.minimum(n ^ 1, len(scan) - 1), np.roll(n, 80), np.argsort(n % 2, kind="stable")][rng.integers(3)]],
        reference,
        how,
    )


def despiked(rng, cloud):
    """What stands out from a median over 11 to 41 points is taken for outliers: deleted, or set to the median."""
    z = cloud[..., 2]
    middle = median_filter(z, int(rng.integers(11, 41)))
    return np.dstack(
        [cloud[..., :2], np.where(np.abs(z - middle) > rng.uniform(0.2, 0.8), rng.choice([np.nan, 1]) * middle, z)]
    )


def noised_again(rng, cloud):
    """What stands out from a median is set to it, with new noise as strong as what is left around (Hampel)."""
    z = cloud[..., 2]
    off = z - median_filter(z, int(rng.choice([9, 15, 21, 31])))
    noise = 1.4826 * np.median(np.abs(off))
    filled = z - off + rng.normal(0, noise, z.shape)
    return np.dstack([cloud[..., :2], np.where(np.abs(off) > rng.uniform(2, 4) * noise, filled, z)])


def replaced(rng, cloud):
    """What stands out is taken out, and set to what is around: mean, plane, inpainted by two ways, nearest, opened."""
    z = cloud[..., 2].astype(np.float32)
    wide, least, how = int(rng.integers(21, 41)), rng.uniform(0.2, 0.8), rng.integers(6)
    marks = (z - median_filter(z, wide) > least).astype(np.uint8)
    marks = cv2.dilate(marks, np.ones((2 * int(rng.integers(0, 3)) + 1,) * 2, np.uint8))
    low, scale = float(z.min()), 255 / float(np.ptp(z))
    grey = np.round((z - low) * scale).astype(np.uint8)
    if how in (2, 3):
        full = cv2.inpaint(grey, marks, 5, (cv2.INPAINT_NS, cv2.INPAINT_TELEA)[how - 2]) / scale + low
    elif how == 4:
        full = z[tuple(distance_transform_edt(marks, return_distances=False, return_indices=True))]
    elif how == 5:
        full = cv2.morphologyEx(z, cv2.MORPH_OPEN, np.ones((wide, wide), np.uint8))
    else:
        full = z.copy()
        count, labels = cv2.connectedComponents(marks)
        for number in range(1, count):
            own = (labels == number).astype(np.uint8)
            rim = cv2.dilate(own, np.ones((5, 5), np.uint8)) > own
            terms = np.column_stack([cloud[rim][:, :2], np.ones(rim.sum())])[:, 2 if how == 0 else 0 :]
            plane = np.linalg.lstsq(terms, z[rim], rcond=None)[0]
            inside = np.column_stack([cloud[own > 0][:, :2], np.ones(own.sum())])[:, 2 if how == 0 else 0 :]
            full[own > 0] = inside @ plane
    return np.dstack([cloud[..., :2], np.where(marks > 0, full, z)])


def shining(rng, part, **how):
    """A bump shines: of its points most are lost, and the others scatter."""
    scan, reference, how = scans(rng, part, **how)
    _, *at, a, b, turn, _ = part.bumps[0]
    wide, scatter_mm = rng.uniform(0.8, 1.2), rng.uniform(1, 2)
    shines = bump(scan[..., 0], scan[..., 1], 1.0, *at, wide * a, wide * b, turn, "cap") > 0
    scan = raised(scan, shines * rng.normal(0, scatter_mm, shines.shape))
    return np.where((shines & (rng.random(shines.shape) < 0.7))[..., None], np.nan, scan), reference, how


def compressed(rng, cloud):
    """Coded as a video is: the cosines of 8 by 8 pixels are rounded, high ones more coarsely."""
    h, w = (n // 8 * 8 for n in cloud.shape[:2])
    steps = rng.uniform(0.1, 0.6) * (1 + np.add.outer(np.arange(8), np.arange(8)) * rng.uniform(0, 0.7))
    blocks = dctn(cloud[:h, :w, 2].reshape(h // 8, 8, w // 8, 8), axes=(1, 3), norm="ortho")
    each = steps[None, :, None, :]
    z = idctn(np.round(blocks / each) * each, axes=(1, 3), norm="ortho")
    return np.dstack([cloud[:h, :w, :2], z.reshape(h, w)])


def levelled(rng, part):
    """Each row or column is moved to the level of the others by its mean or median height."""
    scan, reference, how = scans(rng, part, image=True)
    above, mean = scan[..., 2] - part.mold(scan[..., 0], scan[..., 1]), [np.mean, np.median][rng.integers(2)]
    return raised(scan, mean(above) - mean(above, axis=int(rng.integers(2)), keepdims=True)), reference, how


def grained(rng, cloud):
    """Smoothed, with white noise added to it afterwards."""
    return smoothed(rng, cloud) + rng.normal(0, 0.02, cloud.shape) * [0, 0, 1]


def without_outline(chain):
    def given(rng, part):
        part.outline = None
        return chain(rng, part)

    return given


def flying(rng, cloud):
    """Pixels that fly, half of them by runs of up to six in a row."""
    share, long = np.exp(rng.uniform(np.log(1e-4), np.log(5e-3))), int(rng.integers(1, 7))
    begins = rng.random(cloud.shape[:2]) < share / long
    far = rng.choice([-1, 1], begins.shape) * rng.uniform(1, 20, begins.shape) * begins
    return raised(cloud, sum(np.roll(far, k, 1) for k in range(long)) + (far != 0) * rng.normal(0, 1, far.shape))


def bent_scale(rng, part):
    """The scale along z falls with the height: the thickness of the ply is right, and a pocket is too flat."""
    scan, reference, how = scans(rng, part)
    high = np.maximum(scan[..., 2] - part.mold(scan[..., 0], scan[..., 1]) - T_MM, 0)
    return raised(scan, high / (1 + high / rng.uniform(3, 12)) - high), reference, how


def fitted(rng, part):
    """The export fits the scan to the mold by a smooth field, and takes a part of what is broad off."""
    scan, reference, how = scans(rng, part, image=True)
    high = scan[..., 2] - part.mold(scan[..., 0], scan[..., 1]) - T_MM
    broad = blurred(np.where(part.covers(scan[..., 0], scan[..., 1]), high, 0), rng.uniform(6, 19))
    return raised(scan, -rng.uniform(0.15, 0.6) * broad), reference, how


def streaked(rng, cloud):
    """Specular streaks along rows or columns of which nothing was seen, one of them over a pocket."""
    axis, out = rng.integers(2), cloud.copy()
    for at in (top_of(cloud)[axis] + rng.uniform(-4, 4), *rng.uniform(0, (W, H)[axis], rng.integers(3))):
        out[np.abs(cloud[..., axis] - at) < rng.uniform(0.5, 4)] = np.nan
    return out


def streaks_filled(rng, cloud):
    """The same, and the vendor draws straight lines across what was not seen."""
    out = streaked(rng, cloud)
    for z in out[..., 2] if np.isnan(out[..., 2]).all(axis=0).any() else out[..., 2].T:
        gone = np.isnan(z)
        z[gone] = np.interp(np.flatnonzero(gone), np.flatnonzero(~gone), z[~gone])
    return np.dstack([cloud[..., :2], out[..., 2]])


def cabled(rng, cloud):
    """A cable lies over a pocket."""
    (x, y, _), d, turn = top_of(cloud), rng.uniform(2, 6), rng.uniform(0, np.pi)
    off = np.cos(turn) * (cloud[..., 0] - x - rng.uniform(-6, 6)) + np.sin(turn) * (cloud[..., 1] - y)
    top = blurred(cloud[..., 2], 6) + d / 2 + np.sqrt(np.maximum(d * d / 4 - off**2, 0))
    return np.dstack([cloud[..., :2], np.where(np.abs(off) < d / 2, top, cloud[..., 2])])


def blended(rng, cloud):
    """Two views, one of them out of place by a plane, blended over a band that runs across a pocket."""
    off = cloud[..., 0] - top_of(cloud)[0] - rng.uniform(-10, 10)
    plane = rng.normal(0, 0.05) + rng.normal(0, 5e-4) * off + rng.normal(0, 5e-4) * (cloud[..., 1] - H / 2)
    return raised(cloud, np.clip(off / rng.uniform(1, 30) + 0.5, 0, 1) * plane)


def upsampled(rng, cloud):
    """Enlarged by a factor of two to four, linearly, by cubic splines or by Lanczos's windows."""
    small, how = np.ascontiguousarray(cloud[:: (n := int(rng.integers(2, 5))), ::n]), rng.integers(3)
    way = (cv2.INTER_LINEAR, cv2.INTER_CUBIC, cv2.INTER_LANCZOS4)[how]
    return cv2.resize(small, (small.shape[1] * n, small.shape[0] * n), interpolation=way)


def stickers(rng, cloud):
    """Markers of 0.1 mm, whose black rings are not seen."""
    out = cloud.copy()
    for x, y, r in rng.uniform((20, 20, 3), (W - 20, H - 20, 7), (5, 3)):
        d = np.hypot(cloud[..., 0] - x, cloud[..., 1] - y)
        out = raised(out, np.where(d < r, 0.1, 0))
        out[(d > 0.4 * r) & (d < 0.8 * r)] = np.nan
    return out


def shadows(rng, cloud):
    """The light comes from a side, and what lies in a shadow is not seen."""
    z, fall = cloud[..., 2], 0.9 * np.tan(np.radians(rng.uniform(8, 45))) * np.arange(cloud.shape[1])
    edge = np.maximum.accumulate(z + fall, axis=1) - fall
    return np.where((z >= edge - 0.09)[..., None], cloud, np.nan)


def stale(rng, part):
    """The buffer was not cleared: some rows over a pocket, or some points, are those of the scan before."""
    scan, reference, how = scans(rng, part, image=True)
    (_, x, y, _, b, *_), n = part.bumps[0], int(rng.integers(2, 5))
    some = rng.random(scan.shape[:2]) < 1 / n if rng.random() < 0.5 else (np.arange(len(scan)) % n == 0)[:, None]
    near = np.hypot(scan[..., 0] - x, scan[..., 1] - y) < rng.uniform(0.5, 1.5) * b
    scan = np.where((some & near)[..., None], reference, scan)
    return (scan, reference, how) if rng.random() < 0.5 else (scan.reshape(-1, 3), reference.reshape(-1, 3), {})


def before_debulk(rng, part):
    """The reference was scanned before the ply below was debulked: it has the pocket already, or most of it."""
    scan, reference, how = scans(rng, part)
    return scan, raised(reference, rng.uniform(0.3, 1.0) * part.lift(reference[..., 0], reference[..., 1])), how


CLASSES: dict[str, tuple[Callable, Callable, bool]] = {  # part, chain, whether the class is right
    "plain": (plain, scans, True),
    "small bumps": (small, scans, True),
    "tents": (tents, scans, True),
    "small bumps, 2 mm": (small, partial(scans, dx=2.0, dy=2.0, jitter=0.3), True),
    "fibres turned": (lambda rng: plain(rng, angles=(30.0, 75.0)), scans, True),
    "bridge in a corner": (bridge, scans, True),
    "core chamfer": (chamfer, scans, True),
    "drop-offs": (drop_off, scans, True),
    "fabric": (fabric, scans, True),
    "washboard": (washboard, scans, True),
    "overlaps": (overlaps, scans, False),
    "hole in the ply": (lambda rng: plain(rng, window=(190, 120, rng.uniform(8, 25))), scans, False),
    "lines 2 mm apart": (plain, partial(scans, dx=0.2, dy=2.0, line=0.02), True),
    "lines 3 to 9 mm apart": (plain, lambda rng, part: scans(rng, part, dx=0.2, dy=rng.uniform(3, 9)), False),
    "rolling stripes": (plain, partial(scans, dx=0.4, dy=1.8, line=0.06), False),
    "smoothed, thinned": (small, partial(scans, change=partial(smoothed, thin=3)), False),
    "smoothed, no noise": (small, partial(scans, change=smoothed, noise=0.002), False),
    "rounded": (plain, partial(scans, change=rounded), False),
    "clipped": (plain, partial(scans, change=clipped, both=False), False),
    "flanks lost": (plain, partial(scans, change=steep_lost, both=False), False),
    "marks": (plain, partial(scans, change=marked, both=False), False),
    "voxel mean": (plain, partial(scans, change=voxels, image=False), False),
    "bag on": (plain, partial(scans, change=bagged, both=False), False),
    "film left on": (plain, partial(scans, change=filmed, both=False), False),
    "seam": (plain, partial(scans, change=seam, both=False), False),
    "two scanners": (plain, partial(scans, change=two_scanners, image=False), False),
    "reference drawn": (plain, as_built, False),
    "robot's frame": (plain, moved, True),
    "frames averaged": (plain, averaged, False),
    "z too short": (plain, partial(scans, change=flattened), False),
    "scales differ": (plain, stretched, False),
    "mirrored, swapped": (plain, turned_over, False),
    "arm in the picture": (plain, partial(scans, change=shadowed, both=False), False),
    "shaken": (small, partial(scans, change=shaken), False),
    "hole splined": (plain, partial(scans, change=splined, both=False), False),
    "mesh resampled": (small, partial(scans, change=meshed, image=False), False),
    "other units": (plain, in_unit, False),
    "messy list": (plain, partial(scans, change=messy, image=False), True),
    "reference thinned": (plain, thinner_reference, True),
    "bilateral, 2 mm": (small, partial(scans, change=bilateral, dx=2.0, dy=2.0), False),
    "pocket at the border": (plain, at_border, False),
    "half outlined": (plain, half_outlined, False),
    "joggle": (joggle, scans, True),
    "beads": (beads, scans, False),
    "five in a row": (in_a_row, scans, True),
    "diagonal": (diagonal, scans, True),
    "dented": (dented, scans, True),
    "pyramid": (pyramid, scans, True),
    "fringe slipped": (plain, partial(scans, change=slipped, both=False), False),
    "rippled": (plain, partial(scans, change=rippled, both=False), False),
    "strips that drift": (plain, partial(scans, change=strips, both=False), False),
    "float16": (plain, half_precision, False),
    "rows reordered": (plain, reordered, False),
    "despiked": (small, partial(scans, change=despiked, both=False), False),
    "replaced": (small, partial(scans, change=replaced, both=False), False),
    "noised again": (small, partial(scans, change=noised_again, both=False), False),
    "shining": (small, shining, False),
    "shining, 2 mm": (small, partial(shining, dx=2.0, dy=2.0), False),
    "compressed": (small, partial(scans, change=compressed), False),
    "rows levelled": (plain, levelled, False),
    "no outline": (plain, without_outline(scans), True),
    "averaged, no outline": (plain, without_outline(averaged), False),
    "grained, no outline": (small, without_outline(partial(scans, change=grained, image=True)), False),
    "before debulk": (plain, before_debulk, False),
    "dimples": (dimples, scans, True),
    "engraved lines": (engraved, scans, True),
    "ejector pins": (pins, scans, True),
    "long bump": (long_bump, scans, True),
    "flat, flying, 2 mm": (lambda rng: plain(rng, bumps=[]), partial(scans, change=flying, dx=2.0, dy=2.0), True),
    "flying, 1.5 mm": (plain, partial(scans, change=flying, dx=1.5, dy=1.5), True),
    "streaks": (long_bump, partial(scans, change=streaked, both=False), False),
    "streaks filled": (long_bump, partial(scans, change=streaks_filled, both=False), False),
    "cable on it": (plain, partial(scans, change=cabled, both=False), False),
    "views blended": (plain, partial(scans, change=blended, both=False), False),
    "upsampled": (small, partial(scans, change=upsampled), False),
    "stickers": (plain, partial(scans, change=stickers, both=False), False),
    "shadows": (plain, partial(scans, change=shadows, both=False), False),
    "buffer not cleared": (plain, stale, False),
    "scale bent": (plain, bent_scale, False),
    "fitted to the mold": (plain, fitted, False),
}


def inspected(rng, part, chain) -> tuple[str, str]:
    """The verdict, or that the input was refused, and the reason with all warnings."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            scan, reference, how = chain(rng, part)
            inspector = debulk.Inspector(None, reference, part.outline, part.angles, **how)
            report = inspector.inspect(scan)
            verdict, reason = report.verdict.name, report.reason
        except debulk.InputError as error:
            verdict, reason = "refused", str(error)
        except Exception as error:
            verdict, reason = "crashed", repr(error)
    return verdict, " | ".join([reason, *(f"{w.category.__name__}: {w.message}" for w in said)])


def scene(name: str, seed: int) -> tuple[str, str, str]:
    """Truth, verdict and a line of one scene."""
    rng = np.random.default_rng([seed, *name.encode()])
    make, chain, right = CLASSES[name]
    part, creases = make(rng), rng.random() < (0.6 if right else 0.9)
    share = rng.uniform(1.25, 2.0) if creases else rng.uniform(0.25, 0.75)
    for _ in range(5 if part.bumps else 0):
        now = part.ridges()[int(not creases)]
        part.factor *= np.sqrt(share * (LIMIT_MM - FLAT_MM) / max(now - FLAT_MM, 0.01))
    least, most = part.ridges()
    truth = "creases" if part.bridged or least > 1.1 * LIMIT_MM else "ceases" if most < 0.85 * LIMIT_MM else "near"
    verdict, reason = inspected(rng, part, chain)
    return truth, verdict, f"{name} {seed}: {truth}, {least:.2f} to {most:.2f} mm: {verdict}: {reason}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=4, help="of each class")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="part of the names of the classes")
    asked = parser.parse_args()
    counts: Counter[tuple[str, str, str]] = Counter()
    for name in (name for name in CLASSES if asked.only in name):
        for k in range(asked.scenes):
            truth, verdict, line = scene(name, 1000 * asked.seed + k)
            counts[name, truth, verdict] += 1
            odd = truth == "ceases" and CLASSES[name][2] and verdict not in ("CEASE", "UNDECIDED")
            if odd or verdict == "crashed" or (truth, verdict) == ("creases", "CEASE"):
                print(line, flush=True)
    print(f"\ndebulk {debulk.__version__}, seed {asked.seed}, {counts.total()} scenes")
    false = sum(n for (_, truth, verdict), n in counts.items() if (truth, verdict) == ("creases", "CEASE"))
    creasing = sum(n for (_, truth, _), n in counts.items() if truth == "creases")
    print(f"false CEASE: {false} of {creasing} that crease; {time.process_time():.0f} s of processor time\n")
    print(f"{'class':24}{'truth':9}" + "".join(f"{v:>10}" for v in VERDICTS))
    for name, truth in dict.fromkeys((name, truth) for name, truth, _ in counts):
        row = "".join(f"{counts[name, truth, v] or '-':>10}" for v in VERDICTS)
        print(f"{name:24}{truth:9}{row}{'' if CLASSES[name][2] else '   spoiled'}")


if __name__ == "__main__":
    main()
