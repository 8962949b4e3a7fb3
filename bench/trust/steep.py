"""Plies over steep spars, with and without air over the radius: python bench/trust/steep.py [--out FILE].

A spar lies along y on a table: a round crest of radius R, straight flanks of slope θ, and hollow fillets. The ply
keeps its thickness t along the normal. In some scenes it stands off the crest in the middle of its length: over the
whole arc, with the most in the middle of it. A camera above looks at mold and ply. The true excess of the middle
section is the length of the ply's lower side less that of the mold, by quadrature on the exact curves.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import debulk

Floats = NDArray[np.float64]
Surface = Callable[[Floats, Floats], Floats]

FILLET_MM, FLANK_MM, TABLE_MM, BARE_MM = 25.0, 20.0, 70.0, 30.0  # of each side; the ply ends BARE_MM before the scan
PLY_HALF_LENGTH_MM = 110.0
LIFT_MM = (10.0, 50.0)  # distances from the middle of the length between which a lift fades out
CAMERA_MM, PITCH_MM, NOISE_MM = 1500.0, 0.55, 0.02  # noise: along the ray, of a surface seen at right angles
STEP_MM = 0.05
RADII_MM, SLOPES_DEG, THICKNESSES_MM = (15.0, 20.0, 40.0, 80.0), (51.0, 58.0, 62.0), (0.13, 0.6)
RIDGES_MM = (0.0, 1.15)  # of the lifts; 0: the ply lies on the spar


@dataclass(frozen=True)
class Spar:
    """The section of a spar, by its arc length from the middle of the crest."""

    radius_mm: float
    slope_deg: float

    def curve(self) -> tuple[Floats, Floats, Floats]:
        """Return arc lengths (N,), slope angles (N,) and points (N, 2), x and z, the crest's middle at the origin."""
        arc, fillet = (r * np.radians(self.slope_deg) for r in (self.radius_mm, FILLET_MM))
        half = arc + FLANK_MM + fillet + TABLE_MM + 20
        s = np.arange(-np.ceil(half / STEP_MM), np.ceil(half / STEP_MM) + 1) * STEP_MM
        along = np.abs(s)
        down = np.clip(along / arc, 0, 1) - np.clip((along - arc - FLANK_MM) / fillet, 0, 1)
        angle = -np.sign(s) * np.radians(self.slope_deg) * down
        x, z = (
            np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * STEP_MM)]) for v in (np.cos(angle), np.sin(angle))
        )
        middle = len(s) // 2
        return s, angle, np.stack([x - x[middle], z - z[middle]], axis=1)

    def lower_side(self, lift_mm: float) -> Floats:
        """Return the ply's lower side (N, 2) in a section in which it stands off the middle of the crest by a lift."""
        s, angle, points = self.curve()
        arc = self.radius_mm * np.radians(self.slope_deg)
        off = lift_mm * np.maximum(0.0, 1 - (s / (1.2 * arc)) ** 2) ** 2
        return points + off[:, None] * np.stack([-np.sin(angle), np.cos(angle)], axis=1)

    def excess_mm(self, lift_mm: float) -> float:
        """Return by how much the lower side of a lifted ply is longer than the mold."""
        return _length(self.lower_side(lift_mm)) - _length(self.lower_side(0.0))

    def lift_of(self, ridge_mm: float, thickness_mm: float) -> float:
        """Return the lift whose excess makes this ridge (docs/model.md, section 9)."""
        wanted = 2 * (ridge_mm - (2 - np.pi / 2) * thickness_mm)
        low, high = 0.0, 12.0
        for _ in range(30):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.excess_mm(middle) < wanted else (low, middle)
        return high

    def half_width_mm(self) -> float:
        """Return the distance from the middle to where the table begins."""
        angle = np.radians(self.slope_deg)
        return (self.radius_mm + FILLET_MM) * np.sin(angle) + FLANK_MM * np.cos(angle)


def _length(points: Floats) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def upper_side(spar: Spar, thickness_mm: float, lift_mm: float) -> Surface:
    """Return the height of the ply's upper side; with the thickness 0, of the mold."""
    lifts = np.linspace(0.0, lift_mm, 41 if lift_mm else 2)
    curves = []
    for lift in lifts:
        points = spar.lower_side(lift)
        along = np.gradient(points, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        curves.append(points + thickness_mm * np.stack([-along[:, 1], along[:, 0]], axis=1))
    most = min(np.abs(curve[[0, -1], 0]).min() for curve in curves)
    x = np.arange(-most, most, STEP_MM)
    table = np.array([np.interp(x, curve[:, 0], curve[:, 1]) for curve in curves])

    def height(at_x: Floats, at_y: Floats) -> Floats:
        far, near = LIFT_MM[1], LIFT_MM[0]
        share = np.clip((far - np.abs(at_y)) / (far - near), 0, 1)
        row = (share * share * (3 - 2 * share)) * (len(lifts) - 1)
        column = np.clip((at_x - x[0]) / STEP_MM, 0, len(x) - 1.001)
        i, j = column.astype(int), np.minimum(row.astype(int), len(lifts) - 2)
        u, v = column - i, row - j
        return (1 - v) * ((1 - u) * table[j, i] + u * table[j, i + 1]) + v * (
            (1 - u) * table[j + 1, i] + u * table[j + 1, i + 1]
        )

    return height


@dataclass(frozen=True)
class Scene:
    """What an inspector is given, and the truth."""

    scan: Floats
    reference: Floats
    outline: Floats
    mold_from_scanner: Floats
    ridge_mm: float
    lift_mm: float


def scene(spar: Spar, thickness_mm: float, ridge_mm: float, seed: int = 0, aside_mm: float = 0.0) -> Scene:
    """Scan a spar and the ply on it, by a camera above; `aside_mm`: how far it stands beside the spar's middle."""
    rng = np.random.default_rng(seed)
    lift_mm = spar.lift_of(ridge_mm, thickness_mm) if ridge_mm else 0.0
    half = np.array([spar.half_width_mm() + TABLE_MM, PLY_HALF_LENGTH_MM + BARE_MM])
    outline = (half - BARE_MM) * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    mold, ply = upper_side(spar, 0.0, 0.0), upper_side(spar, thickness_mm, lift_mm)

    def top(x: Floats, y: Floats) -> Floats:
        on = (np.abs(x) < outline[2, 0]) & (np.abs(y) < outline[2, 1])
        return np.where(on, ply(x, y), mold(x, y))

    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[:3, 3] = aside_mm, 0.0, CAMERA_MM
    columns, rows = (int(2 * h / PITCH_MM) for h in half)
    u, v = np.meshgrid(
        (np.arange(columns) - columns / 2) * PITCH_MM - aside_mm, (rows / 2 - np.arange(rows)) * PITCH_MM
    )
    rays = np.dstack([u, -v, np.full_like(u, CAMERA_MM)]) / CAMERA_MM  # scanner frame, of depth 1
    scan, reference = (_cast(surface, rays, aside_mm, rng) for surface in (top, mold))
    true_mm = spar.excess_mm(lift_mm) / 2 + (2 - np.pi / 2) * thickness_mm
    return Scene(scan, reference, outline, pose, true_mm if lift_mm else 0.0, lift_mm)


def _cast(surface: Surface, rays: Floats, aside_mm: float, rng: np.random.Generator) -> Floats:
    """Return where the rays meet a surface, (H, W, 3) in the scanner's frame, with noise along each ray."""
    depth = np.full(rays.shape[:2], CAMERA_MM)

    def above(d: Floats) -> Floats:
        x, y, z = aside_mm + d * rays[..., 0], -d * rays[..., 1], CAMERA_MM - d
        return z - surface(x, y)

    low, high = depth - 10.0, depth + 150.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        up = above(middle) > 0
        low, high = np.where(up, middle, low), np.where(up, high, middle)
    depth = 0.5 * (low + high)
    x, y, step = aside_mm + depth * rays[..., 0], -depth * rays[..., 1], 0.2
    normal = np.dstack(
        [
            -(surface(x + step, y) - surface(x - step, y)),
            -(surface(x, y + step) - surface(x, y - step)),
            np.full_like(x, 2 * step),
        ]
    )
    seen_from = np.dstack([-rays[..., 0], rays[..., 1], np.ones_like(x)])
    cosine = (normal * seen_from).sum(axis=2) / np.linalg.norm(normal, axis=2) / np.linalg.norm(seen_from, axis=2)
    depth += rng.normal(0, NOISE_MM, depth.shape) / np.maximum(cosine, 0.1)
    return (depth[..., None] * rays).astype(np.float32)


def inspected(given: Scene, thickness_mm: float) -> debulk.Report:
    """Inspect a scene with the right recipe."""
    recipe = debulk.Recipe(material={"thickness_mm": thickness_mm})
    return debulk.inspect(given.scan, given.reference, recipe, given.outline, mold_from_scanner=given.mold_from_scanner)


def line(radius_mm: float, slope_deg: float, thickness_mm: float, ridge_mm: float, aside_mm: float = 0.0) -> str:
    """Return one row of the table."""
    given = scene(Spar(radius_mm, slope_deg), thickness_mm, ridge_mm, aside_mm=aside_mm)
    figures = f"{radius_mm:5.0f}{slope_deg:5.0f}{thickness_mm:7.2f}{given.lift_mm:7.2f}{given.ridge_mm:7.2f}"
    report = inspected(given, thickness_mm)
    wrong = "FALSE CEASE" if report.passed and given.ridge_mm > 0.7 else ""
    return f"{figures}   {report.verdict.value:10}{wrong:12}{report.reason}"[:230]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", help="one scene: radius,slope,thickness,ridge[,aside of the camera]")
    args = parser.parse_args()
    if args.only:
        print(line(*map(float, args.only.split(","))))
        return
    rows = [line(*one) for one in product(RADII_MM, SLOPES_DEG, THICKNESSES_MM, RIDGES_MM)]
    told = [row.split()[5] for row in rows]
    text = "\n".join(
        [
            f"Plies over spars, debulk {debulk.__version__}: {len(rows)} scenes, "
            + ", ".join(f"{told.count(what)} {what}" for what in ("cease", "crease", "undecided", "invalid"))
            + f"; {sum('FALSE' in row for row in rows)} false CEASE",
            "",
            "R, θ: of the spar; t: of the ply; lift: of the ply over the middle of the crest; ridge: that its excess",
            "makes, limit 0.60 (0: the ply lies on the spar); mm, degrees.",
            "",
            "    R    θ      t   lift  ridge   verdict",
            *rows,
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
