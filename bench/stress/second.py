"""A second opinion on an answer: how well it is conditioned, and how far it is from one of extended precision.

The forces are computed anew from the paper's equations, in numbers of 64 binary digits instead of 53, and Newton's
method goes on from the answer until nothing is left of them. The fibres keep the lengths, and the nodes that push on
the mold the gaps, that they have in the answer; the mold itself is that of the solve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, SuperLU, onenormest, splu

from debulk import sheet, solve

Exact = NDArray[np.longdouble]
Integers = NDArray[np.int64]
TOUCHING_MM = 1e-3
PUSHING = 1e-6  # of the largest force at the answer
STEPS = 8
DEPENDENT = 1e-13  # of the equations' size: what keeps them solvable where fibres depend on each other


@dataclass
class Second:
    """What extended precision says of an answer."""

    condition: float  # of the answer's equations in the 1-norm, with all rows brought to one size
    residual: float  # largest force that is not balanced, in units of the vacuum on a node (its weight without vacuum)
    left: float  # the same after Newton's method
    moved: float  # largest way of a node to there, in spacings


def second(model: sheet.Sheet, solution: solve.Solution) -> Second:
    """Return what extended precision says of an answer."""
    start = solution.nodes_mm
    movable = np.flatnonzero(model.kinds != 1)
    kept = (3 * movable[:, None] + np.arange(3)).ravel()
    edges = np.array([(i, j) for i, row in enumerate(model.neighbours) for j in row[[0, 2]] if j >= 0])
    tensions = np.asarray(solution._core.tensions_n, dtype=np.longdouble)
    matters = (model.kinds[edges] != 1).any(axis=1)  # segments with a movable end
    edges, tensions = edges[matters], tensions[matters]
    loads = _loads(model)
    x = start.astype(np.longdouble)
    along, lengths = _along(x, edges)
    force = forces(model, x, loads) + _pull(edges, along, tensions, len(x))
    scale = np.abs(forces(model, x, loads)[movable]).max()
    touches = movable[(model.gaps(start)[movable] <= TOUCHING_MM) & (force[movable, 2] > PUSHING * scale)]
    pushes = force[touches, 2].copy()
    unit = np.abs(loads).max()

    matrix, scaling = _equations(model, start, edges, tensions.astype(float), touches, pushes.astype(float), kept)
    factors = splu(matrix)
    inverse = LinearOperator(matrix.shape, matvec=factors.solve, rmatvec=lambda v: factors.solve(v, trans="T"))
    condition = float(abs(matrix).sum(axis=0).max() * onenormest(inverse))

    gaps = _gaps(model, x, touches)
    sizes = []
    for step in range(STEPS + 1):
        along, now = _along(x, edges)
        unbalanced = forces(model, x, loads) + _pull(edges, along, tensions, len(x))
        unbalanced[touches] -= pushes[:, None] * _normals(model, x, touches)
        sizes.append(float(np.abs(unbalanced[movable]).max() / unit))
        if step == STEPS or sizes[-1] > 10 * min(sizes):
            break
        rest = np.concatenate([unbalanced.ravel()[kept], now - lengths, _gaps(model, x, touches) - gaps])
        move = _solved(factors, scaling, rest)
        x.reshape(-1)[kept] -= move[: len(kept)]
        tensions = tensions - move[len(kept) : len(kept) + len(edges)]
        pushes = pushes + move[len(kept) + len(edges) :]
    moved = float(np.linalg.norm((x - start).astype(float), axis=1).max() / model.spacing_mm)
    return Second(condition, sizes[0], sizes[-1], moved)


def forces(model: sheet.Sheet, x: Exact, loads: Exact) -> Exact:
    """Return the gradient of the energy, (N, 3), N: paper equations (2), (4), (5), (6), (7)."""
    out = np.zeros_like(x)
    ply, n = model.ply, model.neighbours
    bending = np.longdouble(ply["young_mpa"]) * np.longdouble(ply["thickness_mm"]) ** 3 / 12
    shear = np.longdouble(ply["shear_mpa"]) * (np.longdouble(model.spacing_mm) / 2) ** 2 * ply["thickness_mm"]
    right = 2 * np.arctan(np.longdouble(1))
    for one, other in ((0, 1), (2, 3)):
        _add_corners(out, x, n, one, other, bending, np.longdouble(0), -1)
    for one in (0, 1):
        for other in (2, 3):
            _add_corners(out, x, n, one, other, shear, right, 1)
    out[:, 2] += loads
    free = model.kinds == 2
    way = x[free] - model.start_mm[free]
    grip = np.longdouble(ply["friction"]) * ply["pressure_mpa"] * np.longdouble(model.spacing_mm) ** 2 / 2
    out[free] += grip * way / np.sqrt((way**2).sum(axis=1, keepdims=True) + (1e-3 * model.spacing_mm) ** 2)
    return out


def _add_corners(
    out: Exact, x: Exact, n: NDArray[np.int32], one: int, other: int, c: np.longdouble, rest: np.longdouble, sign: int
) -> None:
    """Add the gradient of c/2 (angle - rest)^2 between the segments to two neighbours, one of them turned."""
    node = np.flatnonzero((n[:, one] >= 0) & (n[:, other] >= 0))
    a, b = n[node, one], n[node, other]
    u, v = x[a] - x[node], sign * (x[b] - x[node])
    w = np.cross(u, v)
    s, d = np.sqrt((w**2).sum(axis=1)), (u * v).sum(axis=1)
    off = np.arctan2(s, d) - rest
    over = np.where(s > 0, off / np.where(s > 0, s, 1), 1 / d if sign < 0 else 0)  # (angle - rest) / s
    both = c / (s**2 + d**2)
    by_u = both[:, None] * ((d * over)[:, None] * np.cross(v, w) - (s * off)[:, None] * v)
    by_v = sign * both[:, None] * ((d * over)[:, None] * np.cross(w, u) - (s * off)[:, None] * u)
    for k, part in ((a, by_u), (b, by_v), (node, -by_u - by_v)):
        np.add.at(out, k, part)


def _loads(model: sheet.Sheet) -> Exact:
    """Return what gravity and vacuum do to each node, N, downward: a quarter of each cell that adjoins it."""
    x, n, ply = model.start_mm.astype(np.longdouble), model.neighbours, model.ply
    area = np.zeros(len(x), dtype=np.longdouble)
    for one in (0, 1):
        for other in (2, 3):
            node = np.flatnonzero((n[:, one] >= 0) & (n[:, other] >= 0))
            cross = np.cross(x[n[node, one]] - x[node], x[n[node, other]] - x[node])
            area[node] += np.sqrt((cross**2).sum(axis=1)) / 4
    return area * (ply["pressure_mpa"] + ply["thickness_mm"] * ply["density_kg_m3"] * 1e-9 * ply["gravity_m_s2"])


def _along(x: Exact, edges: Integers) -> tuple[Exact, Exact]:
    """Return directions and lengths of the segments."""
    along = x[edges[:, 0]] - x[edges[:, 1]]
    length = np.sqrt((along**2).sum(axis=1))
    return along / length[:, None], length


def _pull(edges: Integers, along: Exact, tensions: Exact, nodes: int) -> Exact:
    out = np.zeros((nodes, 3), dtype=np.longdouble)
    np.add.at(out, edges[:, 0], tensions[:, None] * along)
    np.add.at(out, edges[:, 1], -tensions[:, None] * along)
    return out


def _gaps(model: sheet.Sheet, x: Exact, nodes: Integers) -> Exact:
    """Return gaps, mm; the mold is known in double precision, and goes on straight from there."""
    near = x[nodes, :2].astype(float)
    slope = model.reference.gradient(near)
    return x[nodes, 2] - model.reference.height(near) - (slope * (x[nodes, :2] - near)).sum(axis=1)


def _normals(model: sheet.Sheet, x: Exact, nodes: Integers) -> Exact:
    near = x[nodes, :2].astype(float)
    curved = np.einsum("nij,nj->ni", model.reference.hessian(near), (x[nodes, :2] - near).astype(float))
    return np.column_stack([-(model.reference.gradient(near) + curved), np.ones(len(nodes))])


def _solved(factors: SuperLU, scaling: NDArray[np.float64], right: Exact) -> Exact:
    """Solve the equations with a right side of which the factors see no more than double precision."""
    size = max(float(np.abs(right).max()), 1e-300)
    return size * scaling * factors.solve(scaling * (right / size).astype(float)).astype(np.longdouble)


def _equations(
    model: sheet.Sheet, x: NDArray[np.float64], edges: Integers, tensions: NDArray[np.float64], touches: Integers,
    pushes: NDArray[np.float64], kept: Integers,
) -> tuple[sparse.csc_matrix, NDArray[np.float64]]:  # fmt: skip
    """Return the matrix of Newton's method, scaled, and the scaling of its rows and columns (Ruiz)."""
    nodes = len(x)
    rows, columns, values = model.hessian(x)
    hessian = sparse.coo_matrix((values, (rows, columns)), shape=(3 * nodes, 3 * nodes)).tocsr()
    hessian = hessian + sparse.tril(hessian, -1).T
    along = x[edges[:, 0]] - x[edges[:, 1]]
    length = np.linalg.norm(along, axis=1)
    along /= length[:, None]
    across = (tensions / length)[:, None, None] * (np.eye(3) - along[:, :, None] * along[:, None, :])
    for a, b, sign in ((0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)):
        hessian = hessian + _blocks(edges[:, a], edges[:, b], sign * across, nodes)
    bowl = np.zeros((len(touches), 3, 3))
    bowl[:, :2, :2] = pushes[:, None, None] * model.reference.hessian(x[touches, :2])
    hessian = (hessian + _blocks(touches, touches, bowl, nodes))[kept][:, kept]
    normals = np.column_stack([-model.reference.gradient(x[touches, :2]), np.ones(len(touches))])
    segments = _columns(edges[:, 0], along, nodes) - _columns(edges[:, 1], along, nodes)
    active = sparse.hstack([segments, _columns(touches, normals, nodes)]).tocsr()[kept]
    matrix = sparse.bmat([[hessian, active], [active.T, None]]).tocsc()
    scaling = np.ones(matrix.shape[0])
    for _ in range(5):
        by = 1 / np.sqrt(np.maximum(abs(matrix).max(axis=1).toarray().ravel(), 1e-300))
        scaling *= by
        matrix = (sparse.diags(by) @ matrix @ sparse.diags(by)).tocsc()
    signs = np.concatenate([np.ones(len(kept)), -np.ones(matrix.shape[0] - len(kept))])
    return (matrix + DEPENDENT * sparse.diags(signs)).tocsc(), scaling


def _blocks(i: Integers, j: Integers, values: NDArray[np.float64], nodes: int) -> sparse.csr_matrix:
    """Return a matrix with 3 by 3 blocks at nodes i, j."""
    row = np.broadcast_to(3 * i[:, None, None] + np.arange(3)[:, None], values.shape)
    column = np.broadcast_to(3 * j[:, None, None] + np.arange(3), values.shape)
    return sparse.coo_matrix((values.ravel(), (row.ravel(), column.ravel())), shape=(3 * nodes, 3 * nodes)).tocsr()


def _columns(node: Integers, vectors: NDArray[np.float64], nodes: int) -> sparse.csr_matrix:
    """Return a matrix with one vector in each column, at a node's coordinates."""
    row = 3 * node[:, None] + np.arange(3)
    column = np.broadcast_to(np.arange(len(node))[:, None], row.shape)
    return sparse.coo_matrix((vectors.ravel(), (row.ravel(), column.ravel())), shape=(3 * nodes, len(node))).tocsr()
