"""The geometry of the ridge that the excess length of a pocket makes whose rim is held."""

from __future__ import annotations

import math

import numpy as np

from debulk import _core, section
from debulk.arrays import Floats
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.inspection.ply import polyline
from debulk.net import Net
from debulk.pocket import Foot
from debulk.results.report import ExcessReport
from debulk.results.ridge import RidgeGeometry
from debulk.surface import Reference

# Half the width of the band that contains the highest ridge of nine in ten minima from other starts, in radii of a disc
# of the foot's area (bench/study/places.txt).
HELD_SPREAD = 0.21


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
    line_mm = _on_mold(crest.line_mm, laid.reference)
    mirrored_mm = _on_mold(crest.mirrored_mm, laid.reference) if len(crest.mirrored_mm) else None
    along = polyline.axis(line_mm)
    side = section.elastic_fold(known.length_mm, laid.recipe)
    return (
        RidgeGeometry(
            polyline_mm=line_mm,
            direction_deg=polyline.direction_deg(along),
            mirrored_mm=mirrored_mm,
            mirrored_deg=None if mirrored_mm is None else polyline.direction_deg(polyline.axis(mirrored_mm)),
            fibre_angle_deg=min(_angle_deg(along, fibre) for fibre in _fibres(laid.net, crest.peak)),
            length_mm=polyline.length_mm(line_mm),
            excess_mm=known.length_mm,
            height_mm=known.height_mm,
            elastic_mm=side.height_mm,
            half_width_mm=side.foot_width_mm / 2,
            slope_deg=side.slope_deg,
            height_over_thickness=known.height_mm / laid.recipe.material.thickness_mm,
            height_over_half_width=side.height_mm / (side.foot_width_mm / 2),
            place_spread_mm=HELD_SPREAD * math.sqrt(foot.area_mm2 / math.pi),
        ),
    )


def _on_mold(line_mm: Floats, reference: Reference) -> Floats:
    """Return the (K, 3) points of the mold below a line."""
    return np.column_stack([line_mm, reference.height(line_mm)])


def _fibres(net: Net, peak: int) -> list[Floats]:
    """Return the vector along the fibres at a node, for each fibre direction that it has."""
    ends = [
        [net.nodes_mm[link if link >= 0 else peak] for link in net.neighbours[peak, way : way + 2]] for way in (0, 2)
    ]
    return [ahead - back for ahead, back in ends if (ahead != back).any()]


def _angle_deg(a: Floats, b: Floats) -> float:
    """Return the angle between two lines, 0 to 90 degrees."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    cross = np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])  # np.cross takes twenty times as long
    return math.degrees(math.atan2(float(np.linalg.norm(cross)), abs(float(a @ b))))
