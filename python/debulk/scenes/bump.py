"""One bell under the ply: h(ρ) = H cos²(πρ/2) over an ellipse, with its exact dimensions at the cut height."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from debulk.arrays import Floats
from debulk.scenes.outline import disc_area_inside, disc_outline_inside

Kind = Literal["pocket", "below AreaTol", "below PeakTol", "below CutHeight"]


@dataclass(frozen=True, eq=False)
class Bell:
    """A bell of height ``height_mm`` over the rest of the ply; ``radii_mm`` = (long, short) half axes of its foot."""

    centre_mm: tuple[float, float]
    radii_mm: tuple[float, float]
    angle_deg: float
    height_mm: float

    def to_unit(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Convert mold XY to the frame in which the foot is the unit circle."""
        c, s = np.cos(np.deg2rad(self.angle_deg)), np.sin(np.deg2rad(self.angle_deg))
        dx, dy = x - self.centre_mm[0], y - self.centre_mm[1]
        return (c * dx + s * dy) / self.radii_mm[0], (c * dy - s * dx) / self.radii_mm[1]

    def from_unit(self, points: Floats) -> Floats:
        """Convert (N, 2) points of the unit-circle frame to mold XY."""
        c, s = np.cos(np.deg2rad(self.angle_deg)), np.sin(np.deg2rad(self.angle_deg))
        p, q = points[:, 0] * self.radii_mm[0], points[:, 1] * self.radii_mm[1]
        return np.stack([self.centre_mm[0] + c * p - s * q, self.centre_mm[1] + s * p + c * q], axis=1)

    def rise(self, x: Floats, y: Floats) -> Floats:
        """Height of the bell over the rest of the ply, mm."""
        u, v = self.to_unit(x, y)
        rho = np.minimum(np.hypot(u, v), 1.0)
        return np.asarray(0.5 * self.height_mm * (1.0 + np.cos(np.pi * rho)))

    def rise_and_slopes(self, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Height in mm, slopes along x and y, and ρ (1 on and outside the foot)."""
        c, s = np.cos(np.deg2rad(self.angle_deg)), np.sin(np.deg2rad(self.angle_deg))
        u, v = self.to_unit(x, y)
        rho = np.minimum(np.hypot(u, v), 1.0)
        angle = np.pi * rho
        rise = 0.5 * self.height_mm * (1.0 + np.cos(angle))
        pull = np.sin(angle)
        pull /= np.maximum(rho, 1e-12)
        pull *= -0.5 * np.pi * self.height_mm
        du, dv = pull * u / self.radii_mm[0], pull * v / self.radii_mm[1]
        return rise, c * du - s * dv, s * du + c * dv, rho

    def foot(self, points: int) -> Floats:
        """(points, 2) points on the ellipse of the foot, mold XY, counter-clockwise."""
        angles = 2 * np.pi * np.arange(points) / points
        return self.from_unit(np.stack([np.cos(angles), np.sin(angles)], axis=1))

    def reach(self, direction_rad: float) -> float:
        """Distance that the foot extends from its centre along a direction in mold XY, mm."""
        turned = direction_rad - np.deg2rad(self.angle_deg)
        return float(np.hypot(self.radii_mm[0] * np.cos(turned), self.radii_mm[1] * np.sin(turned)))


@dataclass(frozen=True, eq=False)
class Bump:
    """The truth about a pocket or a decoy. Heights are above the reference, along z, including the ply's thickness."""

    kind: Kind
    """"pocket", or the tolerance below which a decoy stays."""
    centre_mm: tuple[float, float]
    """Mold XY of the top."""
    radii_mm: tuple[float, float]
    """Long and short half axes of the foot, before the ply's edge cuts it."""
    angle_deg: float
    """Direction of the long axis, counter-clockwise from mold +x."""
    peak_mm: float
    """Greatest height above the reference."""
    area_mm2: float
    """XY area where the height exceeds the cut height, inside the ply; 0 for a bump below it."""
    volume_mm3: float
    """Integral of the height above the reference over that area."""
    outline_mm: Floats = field(repr=False)
    """(K, 2) contour at the cut height, clipped by the ply's outline, counter-clockwise; (0, 2) if it stays below."""
    foot_outline_mm: Floats = field(repr=False)
    """(K, 2) edge of the bell itself, clipped by the ply's outline, counter-clockwise."""
    touches_ply_edge: bool
    """Whether the ply's edge cuts the bump."""
    straight_excess_mm: float
    """Length of the whole bell's profile over its short axis minus the straight distance, on a flat floor."""
    bell: Bell = field(repr=False)
    """Shape of the bump."""


def cut_radius(height_mm: float, level_mm: float) -> float:
    """Return the ρ at which a bell has fallen to a level, both above the rest of the ply; 0 if it never reaches it."""
    if height_mm <= level_mm:
        return 0.0
    return float(2.0 / np.pi * np.arccos(np.sqrt(level_mm / height_mm)))


def radii_for_area(area_mm2: float, aspect: float, rho: float) -> tuple[float, float]:
    """Half axes (long, short) of the foot whose level set at ρ has this area."""
    short = float(np.sqrt(area_mm2 / (np.pi * aspect)) / rho)
    return aspect * short, short


def straight_excess(height_mm: float, short_mm: float) -> float:
    """Arc length minus base of y = H cos²(πx/2R), -R < x < R; π²H²/(8R) for a shallow one.

    It is the mean of a smooth periodic function over a period, for which equally spaced samples converge faster than
    any power.
    """
    x = (np.arange(512) + 0.5) / 256.0 - 1.0
    slope = 0.5 * np.pi * height_mm / short_mm * np.sin(np.pi * x)
    return float(2.0 * short_mm * np.mean(slope**2 / (1.0 + np.sqrt(1.0 + slope**2))))


def clipped_area(bell: Bell, ply_outline: Floats, rho: float) -> float:
    """XY area of {ρ' < ρ} inside the ply, mm²."""
    unit = np.stack(bell.to_unit(ply_outline[:, 0], ply_outline[:, 1]), axis=1)
    return bell.radii_mm[0] * bell.radii_mm[1] * disc_area_inside(unit, rho)


def measure(kind: Kind, bell: Bell, ply_outline: Floats, thickness_mm: float, cut_height_mm: float) -> Bump:
    """Determine the truth about a bell on this ply."""
    unit = np.stack(bell.to_unit(ply_outline[:, 0], ply_outline[:, 1]), axis=1)
    scale = bell.radii_mm[0] * bell.radii_mm[1]
    rho = cut_radius(bell.height_mm, cut_height_mm - thickness_mm)
    touches = bool(abs(disc_area_inside(unit, 1.0) - np.pi) > 1e-9)
    # Integration by layers: ∫ h dA = h(ρc) A(ρc) - ∫ h'(ρ) A(ρ) dρ, with h' = -(π H / 2) sin(πρ) and A exact.
    node, weight = np.polynomial.legendre.leggauss(4)
    panels = 64
    radii = ((np.arange(panels)[:, None] + 0.5 * (node + 1.0)) * (rho / panels)).reshape(-1)
    weights = np.tile(0.5 * weight * (rho / panels), panels)
    discs = np.pi * np.array([rho, *radii]) ** 2
    if touches:
        discs = np.array([disc_area_inside(unit, r) if r > 0 else 0.0 for r in (rho, *radii)])
    area, areas = scale * float(discs[0]), scale * discs[1:]
    layers = float(np.sum(weights * 0.5 * np.pi * bell.height_mm * np.sin(np.pi * radii) * areas))
    return Bump(
        kind=kind,
        centre_mm=bell.centre_mm,
        radii_mm=bell.radii_mm,
        angle_deg=bell.angle_deg,
        peak_mm=bell.height_mm + thickness_mm,
        area_mm2=area,
        volume_mm3=cut_height_mm * area + layers,
        outline_mm=bell.from_unit(disc_outline_inside(unit, rho, 720)) if rho > 0 else np.empty((0, 2)),
        foot_outline_mm=bell.from_unit(disc_outline_inside(unit, 1.0, 720)),
        touches_ply_edge=touches,
        straight_excess_mm=straight_excess(bell.height_mm, bell.radii_mm[1]),
        bell=bell,
    )
