"""Mistakes in setting up an inspection: pose, units, outline, mask, recipe, wrong clouds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lab.varied.given import AnyLayup, Change, Cloud, Floats, Given, Mistake, moved, shift, turn

Rng = np.random.Generator


def _plain(**changes: Callable[[Given], object]) -> Change:
    """Make a change that contains nothing random, with new values computed from the given ones."""
    return lambda given, rng, layup: replace(given, **{k: f(given) for k, f in changes.items()})  # type: ignore[arg-type]


def _scaled(factor: float, what: tuple[str, ...]) -> Change:
    def change(given: Given, rng: Rng, layup: AnyLayup) -> Given:
        return replace(given, **{name: (getattr(given, name) * factor).astype(np.float32) for name in what})

    return change


def _pose_in_other_unit(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Give clouds and pose in metres, but the outline in mm."""
    assert given.mold_from_scanner is not None
    pose = given.mold_from_scanner.copy()
    pose[:3, 3] /= 1000
    scan, reference = ((c / 1000).astype(np.float32) for c in (given.scan, given.reference))
    return replace(given, scan=scan, reference=reference, mold_from_scanner=pose)


def _forgotten_but_outline_seen(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Leave out pose and outline, with everything in the scanner's frame."""
    return replace(given, mold_from_scanner=None, ply_outline=None)


def _outline(change: Callable[[Floats, Rng], Floats]) -> Change:
    def applied(given: Given, rng: Rng, layup: AnyLayup) -> Given:
        assert given.ply_outline is not None
        return replace(given, ply_outline=change(given.ply_outline.copy(), rng))

    return applied


def _shifted(corners: Floats, rng: Rng) -> Floats:
    way, size = rng.uniform(0, 2 * np.pi), np.exp(rng.uniform(np.log(5), np.log(200)))
    moved_by: Floats = corners + size * np.array([np.cos(way), np.sin(way)])
    return moved_by


def _crossing(corners: Floats, rng: Rng) -> Floats:
    """Reverse the order of half of the corners, which gives a bow-tie."""
    corners = np.roll(corners, int(rng.integers(len(corners))), axis=0)
    half = len(corners) // 2
    return np.concatenate([corners[:half][::-1], corners[half:]])


def _mirrored(corners: Floats, rng: Rng) -> Floats:
    return np.column_stack([-corners[:, 0], corners[:, 1]])


def _mask_inverted(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Hide everything but the clamp or, without a clamp, everything but a corner."""
    mask = given.mask
    if mask is None:
        mask = np.zeros((given.scan.shape[0], given.scan.shape[1]), dtype=bool)
        mask[: len(mask) // 6, : mask.shape[1] // 6] = True
    return replace(given, mask=~mask)


def _thickness(factor: float) -> Change:
    def change(given: Given, rng: Rng, layup: AnyLayup) -> Given:
        thickness = float(getattr(layup, "truth").thickness_mm) * factor  # noqa: B009
        return replace(given, recipe={"material": {"thickness_mm": thickness}})

    return change


def _next_layer(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Take a reference from after this ply, or from one ply too early, which is off by a thickness."""
    plies = int(rng.choice([-1, 1]))
    reference = _lifted(given, given.reference, plies * float(getattr(layup, "truth").thickness_mm))  # noqa: B009
    return replace(given, reference=reference, note=f"{plies:+d} ply")


def _lifted(given: Given, cloud: Cloud, height_mm: float) -> Cloud:
    """Move points along their rays by a height, as a scan of a thicker laminate would show them."""
    pose = np.eye(4) if given.mold_from_scanner is None else given.mold_from_scanner
    depth = cloud[..., 2].astype(np.float64)
    fall = sum(pose[2, i] * cloud[..., i].astype(np.float64) / depth for i in range(3))
    factor = 1 + height_mm / (fall * depth)
    lifted: Cloud = (cloud * factor[..., None]).astype(np.float32)
    return lifted


def _stale(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Take the scan of another layup on the same mold: this one's rise, turned by half a turn in the image."""
    rise = np.linalg.norm(given.scan.astype(np.float64), axis=-1) / np.linalg.norm(
        given.reference.astype(np.float64), axis=-1
    )
    return replace(given, scan=(given.reference * rise[::-1, ::-1, None]).astype(np.float32))


def _settled(metres: float) -> Change:
    def change(given: Given, rng: Rng, layup: AnyLayup) -> Given:
        up = given.motion_of_scanner(shift(z=1000 * metres))
        return replace(given, scan=moved(given.scan, up).astype(np.float32))

    return change


def _offset(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size = float(np.exp(rng.uniform(np.log(0.1), np.log(20))) * rng.choice([-1, 1]))
    up = given.motion_of_scanner(shift(z=size))
    return replace(given, scan=moved(given.scan, up).astype(np.float32), note=f"{size:+.2f} mm")


def _tilt(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size, way = float(np.exp(rng.uniform(np.log(0.02), np.log(1)))), rng.uniform(0, 2 * np.pi)
    middle = np.nanmean(given.in_mold(given.reference)[::16, ::16].reshape(-1, 3), axis=0)
    motion = given.motion_of_scanner(turn((np.cos(way), np.sin(way), 0.0), size, middle))
    return replace(given, scan=moved(given.scan, motion).astype(np.float32), note=f"{size:.3f} deg")


def _lateral(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size, way = float(np.exp(rng.uniform(0, np.log(30)))), rng.uniform(0, 2 * np.pi)
    motion = given.motion_of_scanner(shift(size * np.cos(way), size * np.sin(way)))
    return replace(given, scan=moved(given.scan, motion).astype(np.float32), note=f"{size:.1f} mm")


def _turned(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size = float(np.exp(rng.uniform(np.log(0.1), np.log(10))) * rng.choice([-1, 1]))
    middle = np.nanmean(given.in_mold(given.reference)[::16, ::16].reshape(-1, 3), axis=0)
    motion = given.motion_of_scanner(turn((0.0, 0.0, 1.0), size, middle))
    return replace(given, scan=moved(given.scan, motion).astype(np.float32), note=f"{size:+.2f} deg")


def _inverted(given: Given) -> object:
    assert given.mold_from_scanner is not None
    return np.linalg.inv(given.mold_from_scanner)


SETUP: tuple[Mistake, ...] = (
    Mistake("pose forgotten", True, _plain(mold_from_scanner=lambda given: None)),
    Mistake("pose and outline forgotten", False, _forgotten_but_outline_seen),
    Mistake("pose inverted", True, _plain(mold_from_scanner=_inverted)),
    Mistake("empty mold", True, _plain(scan=lambda given: given.reference)),
    Mistake(
        "scan and reference swapped",
        True,
        _plain(scan=lambda given: given.reference, reference=lambda given: given.scan),
    ),
    Mistake("offset", False, _offset),
    Mistake("a metre up", True, _settled(1.0)),
    Mistake("a metre down", True, _settled(-1.0)),
    Mistake("tilt", False, _tilt),
    Mistake("lateral shift", False, _lateral),
    Mistake("turned about z", False, _turned),
    Mistake("all in metres", True, _pose_in_other_unit),
    Mistake("scan in metres", True, _scaled(1e-3, ("scan",))),
    Mistake("clouds in metres", True, _scaled(1e-3, ("scan", "reference"))),
    Mistake("clouds in inches", True, _scaled(1 / 25.4, ("scan", "reference"))),
    Mistake("outline in metres", True, _outline(lambda c, rng: c / 1000)),
    Mistake("outline in inches", True, _outline(lambda c, rng: c / 25.4)),
    Mistake("outline mirrored", False, _outline(_mirrored)),
    Mistake("outline shifted", False, _outline(_shifted)),
    Mistake("outline crossing itself", False, _outline(_crossing)),
    Mistake("outline far away", True, _outline(lambda c, rng: c + rng.choice([3e3, 1e6, 1e9]))),
    Mistake("mask inverted", True, _mask_inverted),
    Mistake("thickness times ten", True, _thickness(10.0)),
    Mistake("thickness a tenth", False, _thickness(0.1)),
    Mistake("reference of another ply", False, _next_layer),
    Mistake("stale scan", False, _stale),
)
"""Mistakes in the set-up."""
