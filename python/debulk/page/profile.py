"""The section of a pocket along the fibre through its highest ridge: mold, ply before, net at the minimum, ridge."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.page.net import HEIGHT, WIDTH, initial_gap
from debulk.page.scales import nice
from debulk.results.report import PocketNet, PocketReport

_LEFT, _RIGHT, _TOP, _BOTTOM = 40.0, 10.0, 18.0, 34.0
_EXAGGERATIONS = (0.2, 0.5, 1, 2, 3, 5, 8, 12, 20, 30, 50, 100)
_SPARE_MM = 0.02  # gaps this far above the consolidated ply are ridges or bridges


class Profile(NamedTuple):
    """The drawing; its markup contains nothing from the report but numbers."""

    nodes: list[int]
    through_ridge: bool
    markup: str
    exaggeration: float
    fibre: int


class _Frame(NamedTuple):
    """Conversion from mm to drawing coordinates."""

    x_scale: float
    y_scale: float
    lowest: float

    def x(self, u: float) -> float:
        return _LEFT + self.x_scale * u

    def y(self, z: float) -> float:
        return HEIGHT - _BOTTOM - self.y_scale * (z - self.lowest)

    def line(self, u: Floats, z: Floats) -> str:
        return "M" + "L".join(f"{self.x(a):.1f} {self.y(b):.1f}" for a, b in zip(u.tolist(), z.tolist(), strict=True))


def profile(pocket: PocketReport, recipe: dict[str, Any]) -> Profile | None:
    """Draw the section, or return None if there is no net to cut.

    All lines are drawn above the mold by the gaps of their nodes; the slope between the mold's ends is subtracted.
    """
    net = pocket.net
    if net is None or len(net.nodes_mm) < 3:
        return None
    nodes, fibre, through_ridge = _section(pocket, net)
    if len(nodes) < 3:
        return None
    before, after = initial_gap(pocket)[nodes], pocket.debulked_gap_mm
    points = net.nodes_mm[nodes] if pocket.debulked_mm is None else pocket.debulked_mm[nodes]
    axis = points[-1, :2] - points[0, :2]
    length = float(np.hypot(*axis))
    if not length > 0:
        return None
    along = (points[:, :2] - points[0, :2]) @ axis / length
    u_before = (net.nodes_mm[nodes, :2] - points[0, :2]) @ axis / length
    mold = points[:, 2] - (before if after is None else after[nodes])
    mold = mold - mold[0] - (mold[-1] - mold[0]) * along / length
    order = np.argsort(along, kind="stable")

    def on_mold(u: Floats) -> Floats:
        return np.asarray(np.interp(u, along[order], mold[order]), dtype=np.float64)

    tops = [on_mold(u_before) + before] + ([] if after is None else [mold + after[nodes]])
    lowest, highest = float(mold.min()), max(float(top.max()) for top in tops)
    span = max(highest - lowest, 0.5)
    x_scale = (WIDTH - _LEFT - _RIGHT) / length
    room = HEIGHT - _TOP - _BOTTOM - 14.0  # leaves some ground under the mold
    exaggeration = max((f for f in _EXAGGERATIONS if f * x_scale * span <= room), default=_EXAGGERATIONS[0])
    y_scale = min(exaggeration * x_scale, room / span)
    exaggeration = y_scale / x_scale
    frame = _Frame(x_scale, y_scale, lowest - 14.0 / y_scale)

    parts = [_axes(frame, length, highest)]
    ground = frame.line(along[order], mold[order])
    floor = HEIGHT - _BOTTOM
    parts.append(f'<path class="ground" d="{ground}L{frame.x(length):.1f} {floor:.1f}L{_LEFT:.1f} {floor:.1f}Z"/>')
    parts.append(_curve("before", frame, u_before, tops[0]))
    if after is not None:
        parts.append(_curve("net-after", frame, along, tops[1]))
        parts += _ridges(pocket, recipe, frame, along, mold, nodes, order)
    return Profile(nodes, through_ridge, "".join(parts), exaggeration, fibre)


def _section(pocket: PocketReport, net: PocketNet) -> tuple[list[int], int, bool]:
    """Nodes of the whole fibre through the highest ridge, or through the node that was highest if there is no ridge."""
    ridge = pocket.ridge_nodes
    if ridge is not None and len(ridge) > 1:
        fibre = 0 if int(ridge[1]) in net.neighbours[ridge[0], :2].tolist() else 1
        return _fibre(net, int(ridge[0]), fibre), fibre, True
    highest = int(np.argmax(initial_gap(pocket)))
    fibres = [_fibre(net, highest, fibre) for fibre in (0, 1)]
    longer = int(len(fibres[1]) > len(fibres[0]))
    return fibres[longer], longer, False


def _fibre(net: PocketNet, node: int, fibre: int) -> list[int]:
    """All nodes of the fibre through a node, from west to east or from south to north."""
    ahead, back = 2 * fibre, 2 * fibre + 1
    ends: list[list[int]] = []
    for side in (back, ahead):
        reached: list[int] = []
        at = int(net.neighbours[node, side])
        while at >= 0 and at != node and len(reached) < len(net.nodes_mm):
            reached.append(at)
            at = int(net.neighbours[at, side])
        ends.append(reached)
    return [*reversed(ends[0]), node, *ends[1]]


def _curve(name: str, frame: _Frame, u: Floats, z: Floats) -> str:
    dots = "".join(f"M{frame.x(a):.1f} {frame.y(b):.1f}h0" for a, b in zip(u.tolist(), z.tolist(), strict=True))
    return f'<path class="{name}" d="{frame.line(u, z)}"/><path class="{name} dots" d="{dots}"/>'


def _ridges(
    pocket: PocketReport,
    recipe: dict[str, Any],
    frame: _Frame,
    along: Floats,
    mold: Floats,
    nodes: list[int],
    order: NDArray[np.intp],
) -> list[str]:
    """Draw the consolidated ply on the mold, with the ridges that remain and the limit on their height."""
    post, material = pocket.post_processed_gap_mm, recipe.get("material", {})
    if post is None:
        return []
    thickness = float(material.get("thickness_mm", 0.3))
    laid = thickness / float(material.get("bulk_factor", 1.2))
    parts = [f'<path class="laid" d="{frame.line(along[order], mold[order] + laid)}"/>']
    limit = recipe.get("verdict", {}).get("max_ridge_mm")
    if limit is not None:
        parts.append(f'<path class="limit" d="{frame.line(along[order], mold[order] + limit)}"/>')
    width = max(2 * thickness * frame.x_scale, 3.0)  # two thicknesses, but at least what is visible
    for k, node in enumerate(nodes):
        if post[node] > laid + _SPARE_MM:
            x, top, foot = frame.x(along[k]), frame.y(mold[k] + float(post[node])), frame.y(mold[k])
            parts.append(
                f'<rect class="ridge" x="{x - width / 2:.1f}" y="{top:.1f}" width="{width:.1f}" '
                f'height="{max(foot - top, 1.0):.1f}"/>'
            )
    return parts


def _axes(frame: _Frame, length: float, highest: float) -> str:
    """Draw ticks with figures in mm, left and below."""
    parts = []
    step = nice(length / 5)
    for k in range(int(length / step + 1e-9) + 1):
        x = frame.x(k * step)
        parts.append(f'<path class="axis" d="M{x:.1f} {HEIGHT - _BOTTOM:.1f}v4"/>')
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - 18}" text-anchor="middle">{k * step:g}</text>')
    parts.append(f'<text x="{WIDTH - _RIGHT}" y="{HEIGHT - 4}" text-anchor="end">along the fibre, mm</text>')
    parts.append('<text x="2" y="12">height, mm</text>')
    step = nice(max(highest - frame.lowest, 0.1) / 5)
    for k in range(int(np.ceil(frame.lowest / step)), int(highest / step + 1e-9) + 1):
        y = frame.y(k * step)
        parts.append(f'<path class="rule" d="M{_LEFT:.1f} {y:.1f}H{WIDTH - _RIGHT:.1f}"/>')
        parts.append(f'<text x="{_LEFT - 5:.1f}" y="{y + 4:.1f}" text-anchor="end">{k * step:g}</text>')
    return "".join(parts)
