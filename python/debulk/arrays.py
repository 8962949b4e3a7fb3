"""Types and checks of arrays from users: a check returns the form that the core takes, or an error names the array."""

from __future__ import annotations

import logging
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.arguments import of_type

log = logging.getLogger("debulk")
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Whole = NDArray[np.int64]
Cloud = NDArray[np.float32]
Singles = NDArray[np.float32]
_EXACT = 1e-9  # a rotation that is orthonormal to this is left as it is
_HARMLESS = 1e-4  # 0.1 mm over a metre: less than an outline is known to
_FEWEST_DECIMALS = 3
_FLOAT32 = 6e-8  # rounding of a number up to 1
LARGEST_MM = 1e5
"""No corner of a ply lies farther from the origin than this, mm."""
_GROUP = 32  # number of sides in a group
_CHUNK = 256  # number of groups that are compared with the others at a time


def numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...], expected: str, *, nan: bool = False) -> Floats:
    """Return numbers as finite float64 of a given shape, in which None stands for any length; NaN only where allowed.

    `name` is the argument's, and `expected` its shape and meaning in words, for the error.

    Examples
    --------
    >>> numbers([1, 2, 3], "xy", (2,), "two coordinates in mm")
    Traceback (most recent call last):
    ...
    debulk._core.InputError: xy: expected two coordinates in mm, but got shape (3,)
    """
    if isinstance(value, np.ma.MaskedArray):
        raise InputError(
            f"{name}: expected {expected}, but got a masked array; fill in what is masked, or leave it out"
        )
    try:
        array: NDArray[Any] = np.asarray(value)
    except ValueError:  # lists of different lengths
        raise InputError(f"{name}: expected {expected}, but got {type(value).__name__}") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: expected {expected}, but got {came(value, array)}")
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if not fits:
        raise InputError(f"{name}: expected {expected}, but got {came(value, array)}")
    floats = array.astype(np.float64, copy=False)
    if nan and np.isinf(floats).any():
        raise InputError(f"{name}: expected {expected}, none infinite, but got infinity")
    if not nan and not np.isfinite(floats).all():
        raise InputError(f"{name}: expected {expected}, all finite, but got NaN or infinity")
    return floats


def same_named(kind: type, compiled: Any, *others: str) -> dict[str, Any]:
    """Return the fields of a dataclass from a compiled record whose attributes have the same names, but for others."""
    return {entry.name: getattr(compiled, entry.name) for entry in fields(kind) if entry.name not in others}


def pair(value: ArrayLike, name: str) -> Floats:
    """Return (2,) finite numbers, such as a place in the XY plane."""
    return numbers(value, name, (2,), "two numbers")


def corners(value: ArrayLike, name: str) -> Floats:
    """Return (N, 2) finite corners of a polygon."""
    return numbers(value, name, (None, 2), "an (N, 2) array of corners in mm")


def camera(value: ArrayLike) -> Floats:
    """Return the (f, cx, cy) of a pinhole camera, in pixels, with a positive f."""
    parameters = numbers(value, "camera", (3,), "(f, cx, cy) in pixels")
    if not parameters[0] > 0:
        raise InputError(f"camera: expected a positive focal length f in pixels, but got {parameters[0]:g}")
    return parameters


def outline(value: ArrayLike, name: str) -> Floats:
    """Return (M, 2) corners of a polygon that encloses an area and does not cross itself, as a copy.

    A corner that repeats the one before it is left out, and so is a last corner that repeats the first. Refused are
    fewer than 3 corners, no area, a corner farther than 100 m from the origin, and a side that crosses another or
    occurs twice.
    """
    given = numbers(value, name, (None, 2), "an (M, 2) array of corners in mm")
    repeats = (given == np.roll(given, -1, axis=0)).all(axis=1)  # the corner equals the one after it
    polygon: Floats = given[~np.roll(repeats, 1) | (np.arange(len(given)) == 0)]
    if len(polygon) > 1 and np.array_equal(polygon[0], polygon[-1]):
        polygon = polygon[:-1].copy()
    if len(polygon) < 3:
        raise InputError(f"{name}: expected at least 3 corners, but got {len(polygon)}")
    farthest = float(np.abs(polygon).max())
    if farthest > LARGEST_MM:
        raise InputError(
            f"{name}: expected corners within {LARGEST_MM / 1000:g} m of the mold frame's origin, but got one at "
            f"{farthest:.4g} mm: check its unit and frame"
        )
    crosses = crossing(polygon, np.roll(polygon, -1, axis=0))
    if crosses is not None:
        first, second, (x, y) = crosses
        raise InputError(
            f"{name}: expected an outline that does not cross itself, but its sides {first + 1} and {second + 1} cross "
            f"near ({x:.4g}, {y:.4g}) mm; list the corners in their order round the ply"
        )
    sides = np.concatenate([polygon, np.roll(polygon, -1, axis=0)], axis=1)
    _, first_of = np.unique(sides, axis=0, return_index=True)
    if len(first_of) < len(sides):
        again = int(np.setdiff1d(np.arange(len(sides)), first_of)[0])
        raise InputError(
            f"{name}: expected an outline that goes round the ply once, but its side {again + 1}, from "
            f"({polygon[again, 0]:.4g}, {polygon[again, 1]:.4g}) mm, was there before: give each corner once"
        )
    x, y = polygon.T
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    if area < 1e-6 * float(np.prod(np.ptp(polygon, axis=0))):
        raise InputError(
            f"{name}: expected an outline round an area, but its {len(polygon)} corners go there and back over "
            f"{np.ptp(x):.4g} by {np.ptp(y):.4g} mm and enclose {area:.2g} mm²: give each corner once, in order"
        )
    if area < 1.0:
        raise InputError(
            f"{name}: expected an outline round an area in mm, but got {len(polygon)} corners round {area:g} mm²: "
            "is it in metres?"
        )
    return polygon


def points_xy(value: ArrayLike, name: str) -> tuple[Floats, bool]:
    """Return (M, 2) points, NaN allowed, and whether a single point, (2,), was passed."""
    one = np.ndim(value) == 1
    shape: tuple[int | None, ...] = (2,) if one else (None, 2)
    points = numbers(value, name, shape, "an (M, 2) array of points or one (2,)", nan=True)
    return np.atleast_2d(points), one


def positive(value: float, name: str) -> float:
    """Return a positive finite length."""
    number = float(numbers(value, name, (), "a positive length in mm"))
    if not number > 0:
        raise InputError(f"{name}: expected a positive length in mm, but got {value!r}")
    return number


def rigid(value: ArrayLike, name: str) -> Floats:
    """Return a (4, 4) rotation and translation, as a copy; refuse one that scales, shears or mirrors.

    A rotation whose numbers were rounded is replaced by the nearest one, in the sense of least squares. It is taken as
    rounded if it is orthonormal within 1e-4, or if rounding explains all that is wrong with it: rounding to d decimals
    moves nine numbers by at most half a unit of the last decimal each, and so the matrix by at most 1.5e-d from the
    rotation that was meant. At least three decimals are needed.

    The nearest rotation neither scales nor shears, but it may still be turned against the one that was meant, by up to
    1.1e-d radians: with three decimals by 1.1 mm at a distance of 1 m. Reference and scan are moved by the same pose,
    so no height between them changes by more than a millionth. What moves is the place of the pockets against the
    outline, and the fibres turn by up to 0.06 degrees. At a distance of 2.4 m that is 2.6 mm, which is below the 6 mm
    from which an outline beside the ply's edge is refused; two decimals would make it 26 mm.

    Warns
    -----
    The logger "debulk" says by how much a matrix that is off by more than 1e-4 scales and shears.
    """
    motion = numbers(value, name, (4, 4), "a (4, 4) matrix").copy()
    if not np.allclose(motion[3], [0, 0, 0, 1]):
        last = " ".join(f"{v:g}" for v in motion[3])
        by_columns = np.allclose(motion[:, 3], [0, 0, 0, 1])
        remedy = ": it stands by columns, with the translation in the last line; transpose it" if by_columns else ""
        raise InputError(f"{name}: expected a rigid motion with the last line 0 0 0 1, got {last}{remedy}")
    given = motion[:3, :3].copy()
    if np.abs(given).max() > 1e6 or np.linalg.det(given) <= 0:
        what = "mirrors" if np.linalg.det(given) < 0 else "scales, shears or mirrors"
        raise InputError(f"{name}: expected a rotation in the upper left 3 x 3, got one that {what}")
    off = float(np.abs(given @ given.T - np.eye(3)).max())
    if off <= _EXACT:
        return motion
    left, scales, right = np.linalg.svd(given)
    motion[:3, :3] = left @ right
    away = float(np.linalg.norm(given - motion[:3, :3]))
    digits = next((d for d in (_decimals(given), _significant(given)) if d and away <= 1.5 * 10.0**-d), None)
    few = digits is not None and digits < _FEWEST_DECIMALS
    if off <= _HARMLESS and not few:
        return motion
    across = given.T @ given
    lengths = np.sqrt(np.diag(across))
    scale = float(np.abs(scales - 1).max())
    shear = float(np.abs(across / np.outer(lengths, lengths) - np.eye(3)).max())
    across_mm = round(1000 * shear, 6)
    does = f"over 1 m it changes lengths by up to {1000 * scale:.2g} mm and right angles by {across_mm:.2g} mm"
    if digits is None:
        raise InputError(
            f"{name}: expected a rotation in the upper left 3 x 3, got one that scales or shears: {does}, more than "
            "rounding explains; give a rigid motion"
        )
    turned = f"turned by up to {1100 * 10.0**-digits:.2g} mm per metre of distance"
    if few:
        raise InputError(
            f"{name}: the rotation in the upper left 3 x 3 has only {digits} decimals: {does}, and it may be {turned}; "
            "write 6 decimals or more"
        )
    log.warning(
        "%s: its rotation has only %d decimals: %s; the nearest rotation is used, which may be %s: write 6 decimals or "
        "more", name, digits, does, turned,
    )  # fmt: skip
    return motion


def _decimals(values: Floats) -> int:
    """Return how many decimals the numbers have, up to 6; those of a float32 as they were before its own rounding."""
    return next((d for d in range(7) if np.abs(values.round(d) - values).max() <= _FLOAT32), 17)


def _significant(values: Floats) -> int:
    """Return how many significant digits the numbers have, up to 6."""
    off = [[abs(float(f"{v:.{d - 1}e}") - v) for v in values.flat] for d in range(1, 7)]
    return next((d for d, part in enumerate(off, start=1) if max(part) <= _FLOAT32), 17)


def whole(value: float, name: str) -> int:
    """Return a whole number."""
    number = float(numbers(value, name, (), "a whole number"))
    if int(number) != number:
        raise InputError(f"{name}: expected a whole number, but got {value!r}")
    return int(number)


def crossing(polygon: Floats, ends: Floats) -> tuple[int, int, Floats] | None:
    """Find two sides, from (N, 2) corners to their ends, that cross, and where.

    Consecutive sides are taken together in groups, and only groups whose bounding boxes meet are compared, side by
    side. So many short sides take hardly longer than few.
    """
    count = len(polygon)
    low, high = np.minimum(polygon, ends), np.maximum(polygon, ends)
    first = np.arange(0, count, _GROUP)
    one, other = _meeting(np.minimum.reduceat(low, first), np.maximum.reduceat(high, first))
    for begin in range(0, len(one), _CHUNK):
        sides = np.arange(_GROUP)
        i, j = np.broadcast_arrays(
            _GROUP * one[begin : begin + _CHUNK, None, None] + sides[:, None],
            _GROUP * other[begin : begin + _CHUNK, None, None] + sides,
        )
        real = (i < j) & (j < count)
        i, j = i[real], j[real]
        near = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)
        i, j = i[near], j[near]
        a, b, c, d = polygon[i], ends[i], polygon[j], ends[j]
        t = _side(a, b, c), _side(a, b, d), _side(c, d, a), _side(c, d, b)
        crosses = np.flatnonzero((t[0] * t[1] < 0) & (t[2] * t[3] < 0))
        if len(crosses):
            k = crosses[0]
            share = t[2][k] / (t[2][k] - t[3][k])
            return int(i[k]), int(j[k]), a[k] + share * (b[k] - a[k])
    return None


def _meeting(low: Floats, high: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of (G, 2) boxes that meet, including each with itself; the first index is never above the second."""
    pairs = []
    for begin in range(0, len(low), _CHUNK):
        rows = slice(begin, begin + _CHUNK)
        x, y = ((low[rows, k, None] <= high[begin:, k]) & (low[begin:, k] <= high[rows, k, None]) for k in (0, 1))
        i, j = np.nonzero(x & y)
        pairs.append((i[j >= i] + begin, j[j >= i] + begin))
    one, other = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return one, other


def _side(a: Floats, b: Floats, p: Floats) -> Floats:
    """Signed value that shows on which side of the lines from a to b the points p lie."""
    along, to = b - a, p - a
    return np.asarray(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0])


def came(value: Any, array: NDArray[Any]) -> str:
    """Describe what was passed instead of the expected array of numbers: its shape, its type, or its value."""
    if array.ndim == 0:
        return str(value) if array.dtype.kind in "fiu" else of_type(value)
    if array.dtype.kind not in "fiu":
        return f"{of_type(value)} of {_CONTENTS.get(array.dtype.kind, str(array.dtype))}"
    return f"shape {array.shape}"


_CONTENTS = {"O": "objects", "U": "text", "S": "bytes", "b": "bool"}
