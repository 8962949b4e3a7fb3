"""The mass-spring ply on the mold: its potential energy with exact derivatives (paper, "Debulk Analysis")."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arguments import typed
from debulk.arrays import Floats
from debulk.forking import kept

if TYPE_CHECKING:
    from debulk.net import Net
    from debulk.recipe import Recipe
    from debulk.surface import Reference


__all__ = ["Sheet"]


class Sheet:
    """Potential energy of a pin-jointed net of prepreg under vacuum.

    Π = bending + shear + friction - gravity - vacuum, and where the recipe gives them a stiffness + torsion +
    in_plane_bending + tack. Terms that are zero wherever the nodes move (friction if no node is free; springs with a
    modulus of zero) are left out and named in `left_out`.

    Parameters
    ----------
    nodes_mm
        (N, 3) initial configuration, mold frame, mm. The work of loads and friction is counted from it.
    neighbours
        (N, 4) numbers of the neighbours e, w (first fibre) and n, s (second fibre); -1 means none. They must be mutual.
    kinds
        (N,) 0 inner, 1 fixed boundary, 2 free boundary.
    spacing_mm
        Length of every segment, mm.
    area_mm2
        Area of the ply inside the perimeter, mm². The paper's lumping distributes the loads evenly over the N nodes,
        and so does a net without a cell (a single fibre). Otherwise a node's share is a quarter of each adjoining cell.
    reference
        The surface below the ply.
    recipe
        Its sections `material` and `loads` are used. Default: ``Recipe()``.
    edge_mm
        (N,) distance from each node to the ply's edge, mm, for the friction of free nodes. Default: half a spacing.

    Raises
    ------
    InputError
        If shapes are wrong, coordinates are not finite, neighbours are not mutual, or the material is impossible.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> reference = debulk.surface.Reference(np.zeros((4, 4)), (-10, -10), 10.0)
    >>> nodes = [[0, 0, 0], [5, 0, 0], [10, 0, 0]]
    >>> neighbours = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    >>> sheet = Sheet(nodes, neighbours, [1, 0, 1], 5.0, 100.0, reference)
    >>> sheet.left_out
    ['friction', 'torsion', 'in_plane_bending', 'tack']
    >>> x = np.array(nodes, dtype=float)
    >>> x[1, 2] = 1.0
    >>> terms = sheet.terms(x)
    >>> round(terms["bending"], 6), round(terms["vacuum"], 6)  # c/2 (2 atan 1/5)², and lifted against the vacuum
    (0.063123, -3.333333)
    >>> bool(np.isclose(sheet.energy(x), terms["bending"] - terms["gravity"] - terms["vacuum"]))
    True
    """

    @typed
    def __init__(
        self,
        nodes_mm: ArrayLike,
        neighbours: ArrayLike,
        kinds: ArrayLike,
        spacing_mm: float,
        area_mm2: float,
        reference: Reference,
        recipe: Recipe | None = None,
        edge_mm: ArrayLike | None = None,
    ) -> None:
        from debulk.recipe import Recipe
        from debulk.recipe.options import ply

        recipe = recipe or Recipe()
        self._ply = ply(recipe)
        nodes = arrays.numbers(nodes_mm, "nodes_mm", (None, 3), "an (N, 3) array of nodes in mm")
        self._neighbours = _whole(neighbours, "neighbours", (None, 4), "an (N, 4) array of numbers of nodes")
        self._kinds = _whole(kinds, "kinds", (None,), "an (N,) array of 0, 1 and 2")
        self._spacing_mm, self._area_mm2 = float(spacing_mm), float(area_mm2)
        self._reference = reference
        self._core = _core.sheet.Sheet(
            nodes,
            self._neighbours,
            self._kinds,
            spacing_mm,
            area_mm2,
            reference,
            self._ply,
            [] if edge_mm is None else np.asarray(edge_mm, dtype=np.float64).tolist(),
        )
        given = nodes.copy(), self._neighbours, self._kinds, self._spacing_mm, self._area_mm2, reference, recipe
        self._made: tuple[Any, ...] = (Sheet, (*given, self.edge_mm))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what the sheet was made from."""
        return self._made

    @classmethod
    def of_net(cls, net: Net, reference: Reference, recipe: Recipe | None = None) -> Sheet:
        """Make the sheet of a pocket's net without copying the net's arrays back.

        Parameters
        ----------
        net
            From `debulk.net.fibre_net`.
        reference, recipe
            As in the constructor.

        Raises
        ------
        InputError
            If the material is impossible.

        Examples
        --------
        >>> import numpy as np, debulk
        >>> flat = debulk.surface.Reference(np.zeros((11, 11)), (-50, -50), 10.0)
        >>> square = [(-12, -12), (12, -12), (12, 12), (-12, 12)]
        >>> net = debulk.net.fibre_net(flat, flat, (0, 0), (0, 90), 5.0, outline_mm=square)
        >>> sheet = Sheet.of_net(net, flat)
        >>> bool((sheet.start_mm == net.nodes_mm).all()), sheet.area_mm2 == net.area_mm2
        (True, True)
        """
        from debulk.recipe import Recipe
        from debulk.recipe.options import ply

        sheet = cls.__new__(cls)
        recipe = recipe or Recipe()
        sheet._ply = ply(recipe)
        sheet._neighbours, sheet._kinds = net.neighbours, net.kinds.astype(np.int32)
        sheet._spacing_mm, sheet._area_mm2 = net.spacing_mm, net.area_mm2
        sheet._reference = reference
        sheet._core = _core.sheet.Sheet(net._core, reference, sheet._ply)
        sheet._made = (cls.of_net, (net, reference, recipe))
        return sheet

    @property
    def start_mm(self) -> Floats:
        """(N, 3) the initial configuration, mm."""
        return self._core.start

    @property
    def neighbours(self) -> NDArray[np.int32]:
        """(N, 4) numbers of the neighbours e, w, n, s; -1 means none."""
        return self._neighbours

    @property
    def kinds(self) -> NDArray[np.int32]:
        """(N,) 0 inner, 1 fixed boundary, 2 free boundary."""
        return self._kinds

    @property
    def spacing_mm(self) -> float:
        """Length of every segment, mm."""
        return self._spacing_mm

    @property
    def area_mm2(self) -> float:
        """Area of the ply inside the perimeter, mm²."""
        return self._area_mm2

    @property
    def reference(self) -> Reference:
        """The surface below the ply."""
        return self._reference

    @property
    def ply(self) -> dict[str, float | str]:
        """Material and loads, by the names that `Recipe.material` and `Recipe.loads` give them."""
        from debulk.recipe.options import LOADS, PLY

        return {name: getattr(self._ply, name) for name in (*PLY, *LOADS)}

    @property
    def edge_mm(self) -> Floats | None:
        """(N,) distance from each node to the ply's edge, mm; None where it is not known."""
        ways = self._core.edge_mm
        return ways if len(ways) else None

    @kept
    def _minimiser(self) -> _core.sheet.Minimiser:
        """The data that every start of a solve needs, prepared once."""
        return _core.sheet.Minimiser(self._core)

    @property
    def nodal_force_n(self) -> float:
        """Vacuum force on the node with the largest share of the ply, N; the unit for residual forces."""
        return self._core.nodal_force_n

    @property
    def left_out(self) -> list[str]:
        """Names of the energies that are zero for this net and ply, and are therefore not computed."""
        return self._core.left_out

    def energy(self, x: ArrayLike) -> float:
        """Π in mJ at the nodes x, (N, 3) in mm."""
        return self._core.energy(_points(x))

    def terms(self, x: ArrayLike) -> dict[str, float]:
        """Bending, shear, friction, gravity, vacuum, and optional terms if not left out, in mJ at x, (N, 3) in mm."""
        return self._core.terms(_points(x))

    def gradient(self, x: ArrayLike) -> Floats:
        """(N, 3) derivative of Π by the coordinates of every node, including fixed ones, mJ/mm."""
        return self._core.gradient(_points(x))

    def hessian(self, x: ArrayLike) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats]:
        """(rows, columns, values) of the lower triangle of the 3N x 3N Hessian in mJ/mm², order x0 y0 z0 x1 ..."""
        return self._core.hessian(_points(x))

    def lengths(self, x: ArrayLike) -> Floats:
        """(M,) lengths of the segments at x, mm, in the order of `Net.edges`."""
        return self._core.lengths(_points(x))

    def gaps(self, x: ArrayLike) -> Floats:
        """(N,) heights z - F(x, y) of the nodes above the reference, mm."""
        return self._core.gaps(_points(x))


def _points(x: ArrayLike) -> Floats:
    return arrays.numbers(x, "x", (None, 3), "an (N, 3) array of nodes in mm", nan=True)


def _whole(value: ArrayLike, name: str, shape: tuple[int | None, ...], expected: str) -> NDArray[np.int32]:
    return arrays.numbers(value, name, shape, expected).astype(np.int32)
