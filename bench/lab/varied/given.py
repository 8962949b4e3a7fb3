"""The input of an inspector, and mistakes as changes of that input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Cloud = NDArray[np.float32]


class AnyLayup(Protocol):
    """The attributes that layups of both families have."""

    @property
    def scan(self) -> Cloud:
        """(H, W, 3), scanner's frame."""

    @property
    def reference(self) -> Cloud:
        """(H, W, 3), scanner's frame."""

    @property
    def mold_from_scanner(self) -> Floats:
        """(4, 4) motion."""

    @property
    def camera(self) -> tuple[float, float, float]:
        """(f, cx, cy) in pixels."""

    @property
    def ply_outline(self) -> Floats:
        """(M, 2) mold XY."""


@dataclass(frozen=True)
class Given:
    """Arguments of `debulk.inspect`, with the recipe as a mapping of sections; and what was changed, in words."""

    scan: Cloud
    reference: Cloud
    ply_outline: Floats | None
    fibre_angles_deg: tuple[float, float]
    mold_from_scanner: Floats | None
    camera: tuple[float, float, float] | None = None
    mask: NDArray[np.bool_] | None = None
    recipe: dict[str, dict[str, Any]] = field(default_factory=dict)
    note: str = ""

    def in_mold(self, cloud: Cloud) -> Floats:
        """Points of a cloud in the mold's frame, float64."""
        return moved(cloud, np.eye(4) if self.mold_from_scanner is None else self.mold_from_scanner)

    def motion_of_scanner(self, in_mold: Floats) -> Floats:
        """Return a motion of the mold's frame as one of the scanner's."""
        pose = np.eye(4) if self.mold_from_scanner is None else self.mold_from_scanner
        back: Floats = np.linalg.inv(pose) @ in_mold @ pose
        return back


def given_right(layup: AnyLayup) -> Given:
    """Return the input with everything as it should be."""
    return Given(
        scan=layup.scan,
        reference=layup.reference,
        ply_outline=layup.ply_outline,
        fibre_angles_deg=getattr(layup, "fibre_angles_deg", (0.0, 90.0)),
        mold_from_scanner=layup.mold_from_scanner,
        mask=getattr(layup, "mask", None),
    )


Change = Callable[[Given, np.random.Generator, AnyLayup], Given]


@dataclass(frozen=True)
class Mistake:
    """A mistake with a random size, place or direction.

    Attributes
    ----------
    name
        Name, to which the reason in a report may be compared.
    blind
        Whether the mistake makes the inspection worthless, so that no layup may pass with it, not even a good one.
    change
        Function that applies it.
    """

    name: str
    blind: bool
    change: Change

    def apply(self, layup: AnyLayup, seed: int, *, given: Given | None = None) -> Given:
        """Return the inspector's input with the mistake; the same seed gives the same mistake.

        Parameters
        ----------
        layup
            A layup of either family.
        seed
            Seed of everything random in the mistake.
        given
            Input as changed by another mistake. Default: everything right.
        """
        rng = np.random.default_rng([seed, 77])
        return self.change(given_right(layup) if given is None else given, rng, layup)


def moved(cloud: Cloud | Floats, motion: Floats) -> Floats:
    """Apply a (4, 4) motion to (..., 3) points, coordinate by coordinate: the same bits on any number of threads."""
    points = np.asarray(cloud, dtype=np.float64)
    return np.stack([sum(motion[k, i] * points[..., i] for i in range(3)) + motion[k, 3] for k in range(3)], axis=-1)


def shift(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Floats:
    """Return a motion that only shifts."""
    motion = np.eye(4)
    motion[:3, 3] = x, y, z
    return motion


def turn(axis: tuple[float, float, float], degrees: float, about: Floats) -> Floats:
    """Return a motion that turns about an axis through a point."""
    k = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    a = np.deg2rad(degrees)
    motion = np.eye(4)
    motion[:3, :3] += np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross
    motion[:3, 3] = about - motion[:3, :3] @ about
    return motion
