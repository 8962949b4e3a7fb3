"""What an inspection was made of: enough to identify part, time and machine, and to repeat the inspection."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.results.record import Record, Stored, Values

_Pose = Annotated[NDArray[np.float64], Stored(np.float64, 4, 4)]


def now_utc() -> str:
    """Return the current time in ISO 8601, with milliseconds and Z for UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


@dataclass(frozen=True, kw_only=True)
class ArrayTrace:
    """The fingerprint of an array that is too large to be stored."""

    shape: tuple[int, ...]
    """Shape of the array."""
    sha256: str | None = None
    """SHA-256, hexadecimal, of its values row by row. For a cloud these are float32, little-endian, mm, before mask and
    pose, less the shift of a far cloud that the report's warnings state; for a mask, one byte per pixel, 0 or 1. None:
    not computed."""
    xxh3: str | None = None
    """XXH3 of 128 bits, hexadecimal, of the same values: tells another array from this one, but not one that somebody
    has forged to have the same hash. None: not computed."""

    @property
    def kind(self) -> Literal["sha256", "xxh3"] | None:
        """Which hash was computed; None if none was."""
        return "sha256" if self.sha256 else "xxh3" if self.xxh3 else None

    @property
    def fingerprint(self) -> tuple[str, str] | None:
        """Name and value of the hash; None if none was computed."""
        kind = self.kind
        return None if kind is None else ("SHA-256" if kind == "sha256" else "XXH3", getattr(self, kind))


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace(Record):
    """What an inspection was made of, apart from recipe and ply outline, which are in the report itself."""

    time_utc: str
    """When the inspection began, ISO 8601, UTC."""
    scan: ArrayTrace | None = None
    reference: ArrayTrace | None = None
    """`scan`, `reference`: the clouds; None if the inspector's data were prepared before clouds were traced."""
    fibre_angles_deg: Values | None = None
    fibre_angles_map: Grid | None = None
    """`fibre_angles_deg`, `fibre_angles_map`: (2,) angles of the whole ply, or a Grid of values (ny, nx, 2), NaN where
    nothing is known; the other one is None."""
    nominal_angles_map: Grid | None = None
    """How the ply was meant to lie, on the same grid as the measured angles; None: not given."""
    mold_from_scanner: _Pose | None = None
    """(4, 4), x_mold = T x_scanner; None: the clouds were in the mold's frame."""
    camera: Values | None = None
    """(3,) f, cx, cy in pixels as given; None: fitted to the reference."""
    fitted_camera: Values | None = None
    """(3,) camera that was used in either case; None if the reference is no image of a pinhole camera."""
    mask: ArrayTrace | None = None
    """Image of clamps and tools; None means no mask."""
    deadline_s: float | None = None
    """Time limit of the inspection in seconds; None means no limit."""
    context: dict[str, Any] = field(default_factory=dict)
    """What the caller wants to be stored: number of the part and the ply, batch, operator, and the like."""
    versions: dict[str, str] = field(default_factory=dict)
    """Versions of debulk, Python, NumPy and the core's libraries, and the compiler with its options."""
    host: dict[str, str] = field(default_factory=dict)
    """Name and processor of the machine, its system, the instruction set that the core chose, and the threads used."""
