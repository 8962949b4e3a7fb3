"""The level: how high the ply lies between its pockets, and which motion of the scan explains a deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.inspection.clouds.products import paraboloid, product
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.ply_zones import Blocks
from debulk.results.level import Level

_BISQUARE = 4.685  # constant of Tukey's weights: 95 % efficient for normally distributed values
_ROUNDS = 8


@dataclass(frozen=True)
class Limits:
    """Of the level beside those in the recipe; bench/trust/offsets.py moves scans, trust.py has all other mistakes."""

    least_squares: int = 6  # as many as a paraboloid has coefficients
    least_mm: float = 0.005  # smaller deviations count as none
    # Of the ply: if more is off the level, pockets are not the cause; if more of its points are the reference's, bit
    # for bit, it is the reference.
    ply_share: float = 0.5
    same_points: int = 4  # of a square of the ply, and
    same_square: float = 0.1  # of its points: of two scans of one surface up to 0.002 are the same by chance
    bare_share: float = 0.95  # of the points seen: if more of them show the bare mold, there is no ply
    loose_share: float = 0.2  # of the ply between the pockets: most that may be loose borders and low bumps
    low_share: float = 0.01  # of the ply between the pockets: if more of it lies too low, none counts as loose
    explained_share: float = 0.25  # of the wrong squares: what leaves no more of them wrong explains the deviation


LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class Deviation:
    """By how much each square of the ply is off one thickness above the reference, and how much a fit explains."""

    squares: Blocks
    residual_mm: Floats
    """(B,) the deviations of the squares, as `departure` returns them."""
    fits_mm: Floats
    """(3, B) values of the median, and of a robustly fitted plane and paraboloid."""
    plane: Floats
    """(3,) value of the plane in the middle of the ply, and its rise along x and y over half the extent of the ply."""
    bow_mm: float
    """Range of the paraboloid's second-order part."""

    @property
    def slope(self) -> Floats:
        """(2,) slope of the plane, mm per mm."""
        return np.asarray(self.plane[1:] / _half(self.squares.xy_mm, self.squares.side_mm))

    def off(self, tol_mm: float) -> NDArray[np.int64]:
        """Return -1 for each square that lies too low, 1 for each that lies too high, and 0 for the others.

        A square is off if its median is off by more than the tolerance plus twice its standard error, or if the
        paraboloid is off by more than the tolerance there. The paraboloid shows a motion or a bend of the scan that is
        lost in the noise of single squares.
        """
        beyond = np.abs(self.residual_mm) > tol_mm + medians.SURE * self.squares.error_mm
        smooth = np.abs(self.fits_mm[2]) > tol_mm
        sign = np.where(beyond, np.sign(self.residual_mm), np.where(smooth, np.sign(self.fits_mm[2]), 0.0))
        return np.asarray(sign, dtype=np.int64)

    def level_without(self, loose: NDArray[np.int64], tol_mm: float) -> bool:
        """Return whether a paraboloid fitted to the squares that are not loose stays within the tolerance on all.

        The paraboloid of a bent scan rises through the squares that stand up; that of a ply with a loose border does
        not.
        """
        rest = np.ones(len(self.residual_mm), dtype=np.bool_)
        rest[loose] = False
        terms = _terms(self.squares.xy_mm, 0.0)
        if np.count_nonzero(rest) <= 2 * terms.shape[1]:
            return False
        fit = product(terms, _robust(terms[rest], self.residual_mm[rest]))
        return bool(np.max(np.abs(fit)) <= tol_mm)

    def left(self, tol_mm: float, order: int) -> tuple[float, float]:
        """Return the shares of the squares that lie too low and too high after subtracting the fit of that order."""
        rest, limit = self.residual_mm - self.fits_mm[order], tol_mm + medians.SURE * self.squares.error_mm
        return float(np.mean(rest < -limit)), float(np.mean(rest > limit))


def departure(blocks: Blocks, thickness_mm: float, least_mm: float) -> Floats:
    """Return by how much each square is off the ply's thickness above the datum; 0 down to its least thickness."""
    above = blocks.height_mm - thickness_mm
    return np.asarray(above - np.clip(above, least_mm - thickness_mm, 0.0))


def deviation(blocks: Blocks, thickness_mm: float, least_mm: float) -> Deviation:
    """Compute and fit the deviation of at least 6 squares."""
    residual = departure(blocks, thickness_mm, least_mm)
    terms = _terms(blocks.xy_mm, blocks.side_mm)
    constant = np.full(len(residual), np.median(residual))
    plane, paraboloid = _robust(terms[:, :3], residual), _robust(terms, residual)
    fits = np.array([constant, product(terms[:, :3], plane), product(terms, paraboloid)])
    bow = float(np.ptp(product(terms[:, 3:], paraboloid[3:])))
    return Deviation(blocks, residual, fits, plane, bow)


def level_of(found: Deviation, thickness_mm: float, tol_mm: float) -> Level:
    """Convert the figures into the form of the report."""
    residual, squares = found.residual_mm, found.squares
    median = float(np.median(residual))
    sigma = medians.OF_MEDIAN * float(np.median(np.abs(residual - found.fits_mm[2])))
    off = found.off(tol_mm)
    gx, gy = found.slope
    return Level(
        thickness_mm=thickness_mm,
        laid_mm=thickness_mm + median,
        uncertainty_mm=medians.ERROR * sigma / float(np.sqrt(len(residual))),
        low_share=float(np.mean(off < 0)),
        high_share=float(np.mean(off > 0)),
        offset_mm=float(found.plane[0]),
        tilt_deg=float(np.degrees(np.arctan(np.hypot(gx, gy)))),
        tilt_axis_deg=float((np.degrees(np.arctan2(gy, gx)) + 90) % 180),
        bow_mm=found.bow_mm,
        blocks=len(residual),
        block_mm=squares.side_mm,
        judged_share=squares.ply_share,
    )


def _half(xy_mm: Floats, least_mm: float) -> Floats:
    """Return half the extent of the squares' middles, but at least `least_mm`."""
    return np.asarray(np.maximum(0.5 * np.ptp(xy_mm, axis=0), max(least_mm, 1e-9)))


def _terms(xy_mm: Floats, least_mm: float) -> Floats:
    """Return the terms of a paraboloid, (B, 6), in coordinates from -1 to 1."""
    u, v = ((xy_mm - 0.5 * (xy_mm.min(axis=0) + xy_mm.max(axis=0))) / _half(xy_mm, least_mm)).T
    return paraboloid(u, v)


def _robust(terms: Floats, values: Floats) -> Floats:
    """Fit by least squares with Tukey's weights, begun from the median, so that a few outliers count little."""
    factors = np.zeros(terms.shape[1])
    factors[0] = np.median(values)
    left = values - factors[0]
    # The first rounds use weights that fall slowly with the distance, the later ones weights that drop far outliers.
    for k in range(_ROUNDS):
        sigma = max(medians.OF_MEDIAN * float(np.median(np.abs(left))), LIMITS.least_mm)
        if k < _ROUNDS // 2:
            weights = 1 / np.maximum(np.abs(left), sigma)
        else:
            weights = np.maximum(0.0, 1 - (left / (_BISQUARE * sigma)) ** 2) ** 2
        weighted = terms * weights[:, None]
        # A small diagonal term is added, because squares in one line leave the slope across it undetermined.
        normal = product(weighted.T, terms) + 1e-9 * weights.sum() * np.eye(terms.shape[1])
        factors = np.linalg.solve(normal, product(weighted.T, values))
        left = values - product(terms, factors)
    return factors
