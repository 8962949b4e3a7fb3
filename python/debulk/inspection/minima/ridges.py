"""The geometry of a pocket's ridges: from the excess length if the rim is held, else from the minima."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from debulk import _core, section
from debulk.arrays import Floats
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.inspection.minima.net_crests import net_crests
from debulk.inspection.minima.starts import Settled
from debulk.inspection.ply import polyline
from debulk.pocket import Foot
from debulk.recipe import Recipe
from debulk.results.report import ExcessReport
from debulk.results.ridge import RidgeGeometry
from debulk.surface import Reference

# Half the width of the band that contains the highest ridge of nine in ten minima from other starts
# (bench/study/places.txt), in radii of a disc of the foot's area: first the band about the ridge by the excess, then
# the band about the ridge of a minimum at the ply's edge, where the highest ridge may stand anywhere in the pocket.
HELD_SPREAD, EDGE_SPREAD = 0.21, 1.35
_ENOUGH = 8  # minima: the farthest of so many sets the width of the band; the next one lies within it in 8 of 9 cases


def of_excess(laid: LaidPocket, known: ExcessReport, foot: Foot) -> tuple[RidgeGeometry, ...]:
    """Return the one ridge that the excess makes in a pocket whose rim is held; empty if none stands.

    No minimum is needed. The minima of a coarse net show several smaller ridges in its place, which differ from start
    to start and share the excess of the same fibres.
    """
    if not known.height_mm > 0:
        return ()
    crest = _core.ridge.excess_crest(laid.net._core.net, laid.reference)
    if crest is None or len(crest.line_mm) < 2:
        return ()
    return (
        _geometry(
            _on_mold(crest.line_mm, laid.reference),
            _on_mold(crest.mirrored_mm, laid.reference) if len(crest.mirrored_mm) else None,
            _fibres(laid, laid.net.nodes_mm, [crest.peak]),
            known.length_mm,
            known.height_mm,
            HELD_SPREAD * _radius_mm(foot.area_mm2),
            laid.recipe,
        ),
    )


def of_minima(laid: LaidPocket, settled: Settled, foot: Foot) -> tuple[RidgeGeometry, ...]:
    """Return the ridges of the best minimum as its net shows them, highest first.

    The band of places contains the highest ridges of all certified minima. If there are few minima, it is at least as
    wide as the band that was measured on many.
    """
    nodes_mm = settled.solution.nodes_mm
    crests = net_crests(settled.best, laid.net.neighbours, nodes_mm)
    if not crests:
        return ()
    line_mm = crests[0].points_mm[:, :2]
    spread_mm = 0.0
    if len(settled.every) < _ENOUGH:
        somewhere_mm = float(polyline.distance_mm(line_mm, foot.outline_mm).max())  # in the pocket
        spread_mm = min(EDGE_SPREAD * _radius_mm(foot.area_mm2), somewhere_mm)
    for solution, found in zip(settled.counted, settled.every, strict=True):
        if found.sections:
            peak = max(found.sections, key=lambda one: one.height_mm).peak
            spread_mm = max(spread_mm, float(polyline.distance_mm(line_mm, solution.nodes_mm[peak, :2])))
    return tuple(
        _geometry(
            _on_mold(crest.points_mm[:, :2], laid.reference),
            None,
            _fibres(laid, nodes_mm, crest.nodes),
            crest.section.ply_length_mm - crest.section.mold_length_mm,
            crest.section.height_mm,
            spread_mm,
            laid.recipe,
        )
        for crest in crests
    )


def _geometry(
    line_mm: Floats,
    mirrored_mm: Floats | None,
    fibres: Sequence[Floats],
    excess_mm: float,
    height_mm: float,
    spread_mm: float,
    recipe: Recipe,
) -> RidgeGeometry:
    along = polyline.axis(line_mm)
    side = section.elastic_fold(excess_mm, recipe)
    return RidgeGeometry(
        polyline_mm=line_mm,
        direction_deg=polyline.direction_deg(along),
        mirrored_mm=mirrored_mm,
        mirrored_deg=None if mirrored_mm is None else polyline.direction_deg(polyline.axis(mirrored_mm)),
        fibre_angle_deg=min(_angle_deg(along, fibre) for fibre in fibres),
        length_mm=polyline.length_mm(line_mm),
        excess_mm=excess_mm,
        height_mm=height_mm,
        elastic_mm=side.height_mm,
        half_width_mm=side.foot_width_mm / 2,
        slope_deg=side.slope_deg,
        height_over_thickness=height_mm / recipe.material.thickness_mm,
        height_over_half_width=side.height_mm / (side.foot_width_mm / 2),
        place_spread_mm=spread_mm,
    )


def _on_mold(line_mm: Floats, reference: Reference) -> Floats:
    """Return the (K, 3) points of the mold below a line."""
    return np.column_stack([line_mm, reference.height(line_mm)])


def _fibres(laid: LaidPocket, nodes_mm: Floats, crest: Sequence[int]) -> list[Floats]:
    """Return the vector along the fibres at the nodes of a crest, for each fibre direction that has any."""
    ways = []
    for ahead, back in ((0, 1), (2, 3)):
        links = laid.net.neighbours[list(crest)]
        joined = [np.where(links[:, side] >= 0, links[:, side], crest) for side in (ahead, back)]
        ways.append((nodes_mm[joined[0]] - nodes_mm[joined[1]]).sum(axis=0))
    return [way for way in ways if way.any()]


def _angle_deg(a: Floats, b: Floats) -> float:
    """Return the angle between two lines, 0 to 90 degrees."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    cross = np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])  # np.cross takes twenty times as long
    return math.degrees(math.atan2(float(np.linalg.norm(cross)), abs(float(a @ b))))


def _radius_mm(area_mm2: float) -> float:
    """Return the radius of a disc of this area."""
    return math.sqrt(area_mm2 / math.pi)
