"""Cases of the stress table: a mold, a bump, a net, a ply, from one row of parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import numpy as np

from debulk import net, sheet, surface
from debulk.recipe import Recipe

MOLDS = ("plane", "cylinder", "concave cylinder", "sphere", "concave sphere", "saddle", "step")
EDGES = ("held", "half free", "all free")


@dataclass(frozen=True)
class Case:
    """One row of the table. The defaults are the middle of the range and the paper's ply."""

    pressure_mpa: float = 0.1
    young_mpa: float = 360.0
    shear_mpa: float = 40.0
    thickness_mm: float = 0.3
    friction: float = 0.4
    spacing_mm: float = 8.0
    nodes: int = 100
    bump: float = 0.6  # height of the bump, in spacings
    mold: str = "plane"
    tilt_deg: float = 0.0
    curvature: float = 0.0  # of a curved mold: 0, flat, to 1, the smallest radius (60 mm, or 1.2 times the pocket's)
    edge: str = "held"
    angle_deg: float = 10.0  # of the fibres
    offset_mm: float = 0.0
    movable: int = -1  # number of inner nodes that are not fixed; -1: as laid

    @property
    def reach_mm(self) -> float:
        """Return the radius, seen from above, of the pocket that `nodes` cover on the tilted mold."""
        return self.spacing_mm * np.sqrt(self.nodes * np.cos(np.radians(self.tilt_deg)) / np.pi)

    def text(self) -> str:
        """Return the differences from the default as text."""
        default = Case()
        changed = [f.name for f in fields(self) if getattr(self, f.name) != getattr(default, f.name)]
        return ", ".join(f"{name} {_short(getattr(self, name))}" for name in changed) or "the paper's ply"


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def mold_height(case: Case, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the height of the mold, mm."""
    tilt = np.tan(np.radians(case.tilt_deg))
    flat = tilt * (0.8 * x + 0.6 * y)
    # A ply on a sphere of radius R out to r has the slope r / sqrt(R^2 - r^2) there, which must not exceed 60 degrees.
    radius = max(60.0, 1.2 * case.reach_mm) / max(case.curvature, 1e-6)
    if case.mold == "plane":
        return flat
    if case.mold == "step":  # smooth, one spacing high and two wide
        return flat + case.spacing_mm * np.tanh(x / (2 * case.spacing_mm))
    across = {"cylinder": x**2, "sphere": x**2 + y**2}.get(case.mold.removeprefix("concave "))
    if across is None:  # saddle
        return flat + (x**2 - y**2) / (2 * radius)
    # A circle to 0.9 of its radius and a parabola from there on, so that it is defined everywhere.
    edge = 0.9 * radius
    inner = np.minimum(across, edge**2)
    drop = radius - np.sqrt(radius**2 - inner) + (across - inner) / (2 * np.sqrt(radius**2 - edge**2))
    return flat + (drop if case.mold.startswith("concave") else -drop)


def build(case: Case) -> sheet.Sheet:
    """Return the sheet of a case; raises InputError if the case is refused already here."""
    reach, step = case.reach_mm, case.spacing_mm / 4
    half = int(np.ceil((1.3 * reach + 4 * case.spacing_mm) / step))
    x = step * np.arange(-half, half + 1)
    xx, yy = np.meshgrid(x, x)
    mold = mold_height(case, xx, yy)
    bell = case.bump * case.spacing_mm * np.cos(np.pi / 2 * np.minimum(np.hypot(xx, yy) / reach, 1)) ** 2
    origin = np.array([x[0], x[0]]) + case.offset_mm
    reference = surface.Reference(mold, origin, step)
    ply = surface.Reference(mold + bell, origin, step)
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    outline = reach * np.column_stack([np.cos(turn), np.sin(turn)]) + case.offset_mm
    centre = np.array([0.1, -0.2]) * case.spacing_mm + case.offset_mm
    angles = (case.angle_deg, 90 + case.angle_deg)
    laid = net.fibre_net(
        ply,
        reference,
        centre,
        angles,
        spacing_mm=case.spacing_mm,
        outline_mm=outline,
        mold_tol_mm=1e-3 * case.spacing_mm,
    )
    kinds = laid.kinds.copy()
    edge = kinds == 1
    if case.edge == "half free":
        kinds[edge & (laid.nodes_mm[:, 0] > centre[0])] = 2
    elif case.edge == "all free":
        kinds[edge] = 2
    if case.movable >= 0:
        kinds[np.flatnonzero(kinds == 0)[case.movable :]] = 1
    return sheet.Sheet(laid.nodes_mm, laid.neighbours, kinds, case.spacing_mm, laid.area_mm2, reference, recipe(case))


def recipe(case: Case) -> SimpleNamespace:
    """Return material and loads in a wider range than a recipe allows."""
    plain = Recipe()
    material = {
        "thickness_mm": case.thickness_mm, "young_mpa": case.young_mpa, "shear_mpa": case.shear_mpa,
        "friction": case.friction,
    }  # fmt: skip
    loads = {**plain.loads.model_dump(), "pressure_mpa": case.pressure_mpa}
    return SimpleNamespace(
        material=SimpleNamespace(**{**plain.material.model_dump(), **material}), loads=SimpleNamespace(**loads)
    )


def one_at_a_time() -> Iterator[tuple[str, Case]]:
    """Yield cases that vary each parameter through its range, with the others at their default."""
    paper = Case()
    decades = [0.0, *(10.0**k for k in range(-4, 5))]
    yield from (("pressure", replace(paper, pressure_mpa=p)) for p in (0, 1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3, 1.0))
    yield from (("young", replace(paper, young_mpa=360 * d)) for d in decades)
    yield from (("shear", replace(paper, shear_mpa=40 * d)) for d in decades)
    yield from (("thickness", replace(paper, thickness_mm=t)) for t in (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0))
    for mu in (0.0, 0.01, 0.1, 0.4, 1.0, 10.0, 100.0):
        yield "friction", replace(paper, friction=mu, edge="half free")
        yield "friction, all free", replace(paper, friction=mu, edge="all free")
    yield from (("spacing", replace(paper, spacing_mm=d)) for d in (0.3, 1.0, 2.5, 8.0, 20.0, 50.0))
    yield from (("nodes", replace(paper, nodes=n)) for n in (30, 50, 100, 200, 400, 700, 1000))
    yield from (("bump", replace(paper, bump=b)) for b in (0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 2.0, 3.0, 4.0, 5.0))
    yield from (("bump on 400 nodes", replace(paper, bump=b, nodes=400)) for b in (0.0, 0.01, 0.1, 1.0, 3.0, 5.0))
    yield from (("tilt", replace(paper, tilt_deg=a)) for a in (0.0, 15.0, 30.0, 45.0, 60.0, 70.0))
    for mold in MOLDS[1:]:
        yield from ((mold, replace(paper, mold=mold, curvature=k, spacing_mm=5.0)) for k in (0.1, 0.3, 0.6, 1.0))
    yield from (("movable", replace(paper, movable=k)) for k in (0, 1, 2, 3, 4, 5, 8))
    yield from (("offset", replace(paper, offset_mm=o)) for o in (0.0, 1e3, 1e5, 1e7))
    # Fibres that are pinned at both ends and as long as their chord: a flat net.
    yield from (
        ("pinned at the chord", replace(paper, bump=0.0, angle_deg=a, edge=e)) for a in (0.0, 45.0) for e in EDGES
    )
    # Near shear locking: a steep bump on a coarse net.
    yield from (("shear locking", replace(paper, bump=b, nodes=60)) for b in (2.5, 3.0, 3.5, 4.0, 4.5))


def latin_hypercube(count: int, seed: int = 0) -> list[Case]:
    """Return combinations over all ranges: each parameter's range has `count` parts, and each part occurs once."""
    rng = np.random.default_rng(seed)

    def column() -> np.ndarray:
        return (rng.permutation(count) + rng.random(count)) / count

    def log(u: np.ndarray, low: float, high: float) -> np.ndarray:
        return low * (high / low) ** u

    def or_zero(u: np.ndarray, low: float, high: float) -> np.ndarray:  # one value in twenty is 0
        return np.where(u < 0.05, 0.0, log((u - 0.05) / 0.95, low, high))

    columns = {
        "pressure_mpa": or_zero(column(), 1e-4, 1.0),
        "young_mpa": or_zero(column(), 360e-4, 360e4),
        "shear_mpa": or_zero(column(), 40e-4, 40e4),
        "thickness_mm": log(column(), 0.05, 2.0),
        "friction": or_zero(column(), 0.01, 100.0),
        "spacing_mm": log(column(), 0.3, 50.0),
        "nodes": log(column(), 30, 1000).astype(int),
        "bump": or_zero(column(), 0.01, 5.0),
        "mold": np.array(MOLDS)[(column() * len(MOLDS)).astype(int)],
        "tilt_deg": np.where((u := column()) < 0.3, 0.0, 70 * (u - 0.3) / 0.7),
        "curvature": column(),
        "edge": np.array(EDGES)[np.searchsorted([0.6, 0.9], column())],
        "angle_deg": 90 * column(),
        "offset_mm": or_zero(column(), 1.0, 1e7),
    }
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*(c.tolist() for c in columns.values()), strict=True)]
    # Only a plane is tilted up to 70 degrees; a curved mold is tilted by at most 20.
    return [
        Case(**{**row, "tilt_deg": row["tilt_deg"] if row["mold"] == "plane" else 2 / 7 * row["tilt_deg"]})
        for row in rows
    ]
