"""The referee's pockets: 60 of virtual layups that nothing else uses, and 60 synthetic ones; the same on every machine.

In each half, 30 pockets have a largest fibre excess within 40 % of the limit's (a ridge of 0.60 mm by
h = dL/2 + 0.43 t); the others are farther from it. The excess is that of the laid net at the recipe's default size.
layups.txt lists the layups' pockets by seed and number, so that the set does not change if the inspector finds one more
or one less. The pockets are made once and kept in build/referee/pockets, one file per pocket.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np
from tables import HERE

from debulk import Inspector, net, pocket, ridge, scenes, surface

THICKNESS_MM = 0.3
LIMIT_MM = 0.60
LIMIT_EXCESS_MM = 2 * (LIMIT_MM - (2 - np.pi / 2) * THICKNESS_MM)  # 0.943: the excess that makes a ridge of the limit
NEAR = (0.6, 1.4)  # "near the limit", in units of its excess
LARGEST_FOOT_MM2 = 5000.0  # larger ones need more nodes than a fine net can be solved with
FOLDER = Path("build/referee/pockets")
_GRID_MM = 1.0


@dataclass(frozen=True, eq=False)
class Pocket:
    """One pocket: everything from which its nets are laid, as in `debulk.inspection.minima.laid_pocket.lay_net`."""

    name: str
    family: str  # "layup", or the shape of a synthetic pocket
    ply_mm: np.ndarray  # (ny, nx) heights of the ply's lower side
    mold_mm: np.ndarray  # (ny, nx)
    origin_mm: np.ndarray  # (2,)
    grid_mm: float
    centre_mm: np.ndarray  # (2,)
    angles_deg: np.ndarray  # (2,)
    outline_mm: np.ndarray  # (K, 2) the foot
    rms_outline_mm: np.ndarray  # (K, 2) the outline at the cut; for a synthetic pocket that of the foot
    ply_outline_mm: np.ndarray  # (K, 2); (0, 2) if it is unknown
    foot_area_mm2: float
    at_edge: bool
    mold_tol_mm: float

    @cached_property
    def reference(self) -> surface.Reference:
        """Return the mold."""
        return surface.Reference(self.mold_mm, self.origin_mm, self.grid_mm)

    @cached_property
    def surface(self) -> surface.Reference:
        """Return the ply as it lies before the vacuum is drawn."""
        return surface.Reference(self.ply_mm, self.origin_mm, self.grid_mm)

    def lay(self, spacing_mm: float | None = None, node_target: int = 100) -> net.Net:
        """Lay the net at a spacing, or at the recipe's default size."""
        return net.fibre_net(
            self.surface,
            self.reference,
            self.centre_mm,
            self.angles_deg,
            spacing_mm,
            outline_mm=self.outline_mm,
            ply_outline=self.ply_outline_mm if len(self.ply_outline_mm) else None,
            mold_tol_mm=self.mold_tol_mm,
            rms_outline_mm=self.rms_outline_mm,
            node_target=node_target,
        )

    def save(self, folder: Path) -> None:
        """Save the pocket; a file is either complete or absent."""
        path = folder / f"{self.name}.npz"
        part = path.with_suffix(".part.npz")
        np.savez_compressed(part, **{f.name: getattr(self, f.name) for f in fields(self)})
        os.replace(part, path)

    @classmethod
    def load(cls, path: Path) -> Pocket:
        """Read a saved pocket."""
        with np.load(path) as kept:
            values = {f.name: kept[f.name] for f in fields(cls)}
        return cls(**{k: v.item() if v.ndim == 0 else v for k, v in values.items()})


def excess(made: Pocket) -> float:
    """Return the largest excess of a fibre of the net at the default size, mm."""
    laid = made.lay()
    return ridge.largest_fibre_excess(laid.nodes_mm, laid.neighbours, made.reference)


def all_pockets(folder: Path = FOLDER) -> list[Pocket]:
    """Return the whole set in a fixed order; it is made if it does not exist yet."""
    index = folder / "index.txt"
    if not index.exists():
        folder.mkdir(parents=True, exist_ok=True)
        names = []
        for makers in (synthetic_pockets(), layup_pockets()):
            for made in makers:
                made.save(folder)
                names.append(made.name)
        index.write_text("\n".join(names) + "\n", encoding="utf-8")
    return [Pocket.load(folder / f"{name}.npz") for name in index.read_text(encoding="utf-8").split()]


def spread(pockets: list[Pocket]) -> list[Pocket]:
    """Order pockets so that the first few are small and all round the limit: the smallest of each range in turn."""
    ranges: dict[int, list[Pocket]] = {}
    for made in sorted(pockets, key=lambda p: p.foot_area_mm2):
        ratio = excess(made) / LIMIT_EXCESS_MM
        ranges.setdefault(int(np.digitize(ratio, (0.6, 0.8, 0.95, 1.05, 1.2, 1.4))), []).append(made)
    rounds = max(map(len, ranges.values()))
    return [ranges[k][i] for i in range(rounds) for k in sorted(ranges) if i < len(ranges[k])]


# Pockets of virtual layups, found in scans with noise as the inspector finds them.


def layup_pockets() -> Iterator[Pocket]:
    """Yield the pockets of layups.txt, from seed 300 on.

    They were taken in order: far from the limit at most eight of each row of the layups' table, and near it at most
    fourteen of each fifth of the limit's excess, so that no kind dominates.
    """
    names = (HERE / "layups.txt").read_text(encoding="utf-8").split()
    for seed, wanted in groupby(names, key=lambda name: int(name[1:4])):
        found = {made.name: made for made in _of_layup(seed)}
        for name in wanted:
            if name not in found:
                raise LookupError(f"{name} of layups.txt: these sources find only {', '.join(found)} in that layup")
            yield found[name]


def _of_layup(seed: int) -> Iterator[Pocket]:
    """Yield the pockets of one layup.

    The cut height for which a layup sizes its pockets varies: smaller feet under the same peaks hold more excess.
    """
    cut = float(np.random.default_rng(seed).uniform(1.2, 2.2))
    layup = scenes.layup(seed=seed, pixels=(1280, 960), cut_height_mm=cut)
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    for one in inspector.find(layup.scan).pockets:
        found, foot = one.pocket, one.foot
        if foot.area_mm2 > LARGEST_FOOT_MM2:
            continue
        patch = pocket.patch(one.segmentation, one.feet, found.id, inspector.ply.reference)
        made = Pocket(
            name=f"L{seed}_{found.id}",
            family="layup",
            ply_mm=patch.surface.values,
            mold_mm=patch.reference.values,
            origin_mm=np.asarray(patch.surface.origin_mm),
            grid_mm=patch.surface.spacing_mm,
            centre_mm=found.centroid_mm,
            angles_deg=np.asarray(inspector.ply.fibre_angles_deg),
            outline_mm=patch.outline_mm,
            rms_outline_mm=found.outline_mm,
            ply_outline_mm=np.asarray(layup.ply_outline),
            foot_area_mm2=foot.area_mm2,
            at_edge=found.touches_ply_edge,
            mold_tol_mm=1.25 * one.feet.mold_tol_mm,
        )
        yield made


# Synthetic pockets: bells h = H cos^2(pi d / 2) over a foot of some shape, without noise.


@dataclass(frozen=True)
class Shape:
    """A bell on a mold, whose height follows from the excess."""

    name: str
    family: str
    radius_mm: float  # of the foot, across
    aspect: float  # long over short
    turn_deg: float  # of the long axis against mold +x
    angles_deg: tuple[float, float]
    excess_mm: float
    mold: str = "plane"
    mold_radius_mm: float = 400.0
    bend_mm: float = 0.0  # radius to which the long axis is bent (kidney shape)
    edge: float = 0.0  # distance of the ply's edge from the centre on the +x side, in radii; 0: no edge


def mold_height(shape: Shape, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the height of the mold, mm, with curvatures like those of a circle near its crest."""
    square = {
        "plane": 0.0 * x,
        "cylinder": -(x**2),
        "sphere": -(x**2 + y**2),
        "saddle": x**2 - y**2,
        "concave": x**2 + y**2,
    }[shape.mold]
    return np.asarray(square / (2 * shape.mold_radius_mm))


def foot_distance(shape: Shape, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the relative distance from the middle: 0 in the middle, 1 on the foot."""
    c, s = np.cos(np.radians(shape.turn_deg)), np.sin(np.radians(shape.turn_deg))
    u, v = c * x + s * y, c * y - s * x
    if shape.bend_mm == 0:
        return np.asarray(np.hypot(u / (shape.aspect * shape.radius_mm), v / shape.radius_mm))
    # The distance to an arc of radius b about (0, -b), whose length follows from the aspect.
    half = (shape.aspect - 1) * shape.radius_mm / shape.bend_mm
    turn = np.clip(np.arctan2(u, v + shape.bend_mm), -half, half)
    near_u, near_v = shape.bend_mm * np.sin(turn), shape.bend_mm * (np.cos(turn) - 1)
    return np.asarray(np.hypot(u - near_u, v - near_v) / shape.radius_mm)


def _outline(shape: Shape) -> np.ndarray:
    """Return (240, 2) the foot's outline, seen from its middle; all feet here are star-shaped from there."""
    t = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    low, high = np.zeros_like(t), np.full_like(t, 3 * shape.aspect * shape.radius_mm)
    for _ in range(60):
        r = (low + high) / 2
        out = foot_distance(shape, r * np.cos(t), r * np.sin(t)) > 1
        low, high = np.where(out, low, r), np.where(out, r, high)
    return np.column_stack([low * np.cos(t), low * np.sin(t)])


def synthetic_pocket(shape: Shape) -> Pocket:
    """Return the pocket of a shape; its height is such that the default net's largest excess is the shape's."""
    outline = _outline(shape)
    ply_outline = np.empty((0, 2))
    if shape.edge:
        far, at = 4 * shape.aspect * shape.radius_mm, shape.edge * shape.radius_mm
        ply_outline = np.array([(-far, -far), (at, -far), (at, far), (-far, far)])
    half = int(np.ceil((np.abs(outline).max() + 25.0) / _GRID_MM))
    x = _GRID_MM * np.arange(-half, half + 1)
    xx, yy = np.meshgrid(x, x)
    mold = mold_height(shape, xx, yy)
    bell = np.cos(np.pi / 2 * np.minimum(foot_distance(shape, xx, yy), 1)) ** 2
    px, py = outline.T
    made = Pocket(
        name=shape.name,
        family=shape.family,
        ply_mm=mold,
        mold_mm=mold,
        origin_mm=np.array([x[0], x[0]]),
        grid_mm=_GRID_MM,
        centre_mm=np.zeros(2),
        angles_deg=np.array(shape.angles_deg),
        outline_mm=outline,
        rms_outline_mm=outline,
        ply_outline_mm=ply_outline,
        foot_area_mm2=0.5 * abs(float(np.sum(px * np.roll(py, -1) - py * np.roll(px, -1)))),
        at_edge=bool(shape.edge),
        mold_tol_mm=0.05,
    )
    height = np.sqrt(8 * shape.radius_mm * shape.excess_mm) / np.pi  # the height of a shallow straight bell
    for _ in range(6):  # the excess of a bell grows with the square of its height
        made = replace(made, ply_mm=mold + height * bell)
        height *= np.sqrt(shape.excess_mm / max(excess(made), 0.05 * shape.excess_mm))
    return made


def shapes() -> list[Shape]:
    """Return 60 shapes: ten of each family, half of each family near the limit."""
    made = []
    for number, family in enumerate(("round", "elliptic", "long", "kidney", "edge", "curved")):
        for k in range(10):
            rng = np.random.default_rng([12, number, k])
            ratio = rng.uniform(*NEAR) if k % 2 == 0 else rng.choice([rng.uniform(0.15, 0.6), rng.uniform(1.4, 3.5)])
            turn = float(rng.uniform(0, 180))
            first = float(rng.uniform(0, 90))
            base = Shape(
                f"S{family}{k}",
                family,
                radius_mm=float(rng.uniform(15, 24)),
                aspect=1.0,
                turn_deg=turn,
                angles_deg=(first, first + 90.0),
                excess_mm=float(ratio * LIMIT_EXCESS_MM),
            )
            if family == "round" and k >= 7:  # so wide that a fold may not gather all of the excess
                base = replace(base, radius_mm=float(rng.uniform(32, 38)))
            if family in ("elliptic", "curved"):
                base = replace(base, aspect=float(rng.uniform(1.2, 1.8)))
            if family == "long":
                base = replace(base, aspect=float(rng.uniform(2.2, 3.2)), radius_mm=float(rng.uniform(13, 18)))
            if family == "kidney":
                radius = float(rng.uniform(13, 17))
                base = replace(base, aspect=2.2, radius_mm=radius, bend_mm=float(rng.uniform(1.5, 2.5)) * radius)
            if family == "edge":
                base = replace(base, aspect=float(rng.uniform(1.0, 1.5)), edge=float(rng.uniform(0.2, 0.8)))
            if family == "curved":
                mold = ("cylinder", "sphere", "saddle", "concave", "sphere")[k % 5]
                base = replace(base, mold=mold, mold_radius_mm=float(rng.uniform(200, 800)))
            made.append(base)
    return made


def synthetic_pockets() -> Iterator[Pocket]:
    """Yield all synthetic pockets."""
    return (synthetic_pocket(shape) for shape in shapes())
