"""What an inspection was made of: enough to name the part, the time and the machine, and to do it again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.results.record import Record, Values

__all__ = ["ArrayTrace", "Trace"]

_Pose = Annotated[NDArray[np.float64], (4, 4)]


@dataclass(frozen=True, kw_only=True)
class ArrayTrace:
    """An array that is too large to be kept, by its fingerprint.

    Attributes
    ----------
    shape
        Of the array.
    sha256
        SHA-256, hexadecimal, of its values row by row: a cloud's as float32, little-endian, mm, before mask and pose;
        a mask's as one byte per pixel, 0 or 1. None: not computed.
    """

    shape: tuple[int, ...]
    sha256: str | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace(Record):
    """What an inspection was made of, beside the recipe and the ply's outline, which the report has itself.

    Attributes
    ----------
    time_utc
        When the inspection began, ISO 8601, UTC.
    scan, reference
        The clouds; None where the inspector was made from one that was prepared before clouds were traced.
    fibre_angles_deg, fibre_angles_map
        (2,) the angles of the whole ply, or a Grid of values (ny, nx, 2), NaN where nothing is known; the other: None.
    mold_from_scanner
        (4, 4), x_mold = T x_scanner; None: the clouds were in the mold's frame.
    camera
        (3,) f, cx, cy in pixels as given; None: fitted to the reference.
    fitted_camera
        (3,) what was used in either case; None where the reference is no image of a pinhole camera.
    mask
        The image of clamps and tools; None: none.
    deadline_s
        Seconds that the inspection was given; None: no limit.
    context
        What the caller wants to be kept: number of the part and the ply, batch, operator, and the like.
    versions
        Of debulk, Python, NumPy, the libraries that the core was built with, the compiler and its options.
    host
        Name and processor of the machine, its system, the instructions that the core chose, and the threads used.
    """

    time_utc: str
    scan: ArrayTrace | None = None
    reference: ArrayTrace | None = None
    fibre_angles_deg: Values | None = None
    fibre_angles_map: Grid | None = None
    mold_from_scanner: _Pose | None = None
    camera: Values | None = None
    fitted_camera: Values | None = None
    mask: ArrayTrace | None = None
    deadline_s: float | None = None
    context: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    host: dict[str, str] = field(default_factory=dict)
