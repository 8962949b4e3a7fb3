"""Pin-jointed nets on a surface: that of one pocket for the mass-spring model, or of a whole ply for fibre angles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arguments import of_type, typed
from debulk.arrays import Floats

if TYPE_CHECKING:
    from debulk.surface import Reference

Integers = NDArray[np.int32]
Paths = Literal["geodesic", "vertical_plane", "least_shear"]

_DEFAULTS = _core.net.FibreNetOptions()  # each default is defined only in cpp/debulk/net/fibre_net.hpp

FREE = 2
"""Kind of a boundary node at the ply's edge, which can slip."""

__all__ = ["FREE", "Drape", "Draping", "Net", "drape", "fibre_net", "surface_area"]


@dataclass(frozen=True, eq=False)
class Net:
    """A pocket's net: N nodes at one spacing along two families of inextensible fibres."""

    nodes_mm: Floats
    """(N, 3) mold frame, on the surface. They are numbered row by row along the first or the second fibre, whichever
    gives the narrower band of connected numbers."""
    neighbours: Integers
    """(N, 4) int32, numbers of the neighbours e, w (along the first fibre) and n, s (along the second); -1 means
    none."""
    kinds: NDArray[np.int8]
    """(N,) int8: 0 inner, 1 fixed boundary, 2 free boundary (`FREE`)."""
    edges: Integers
    """(M, 2) int32, the segments: pairs of nodes one spacing apart."""
    inside: NDArray[np.bool_]
    """(N,) bool: inside the perimeter (inside ``rms_outline_mm`` if it was given)."""
    spacing_mm: float
    """Length of every segment."""
    area_mm2: float
    """Area of the ply's surface inside the perimeter."""
    shear_deg: Floats
    """(N,) mean of ``|90° - crossing angle|`` of the fibres at each node."""
    open_ends: Integers
    """Numbers of inner nodes away from the ply's edge where a fibre neighbour is missing. If there are any, the rim is
    not closed by fixed nodes, and the pocket cannot be judged."""
    lattice: Integers
    """(N, 2) int32, steps along the first and the second fibre from the centre node."""
    _core: Any = field(repr=False)
    _given: tuple[Any, ...] | None = field(default=None, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what the net was laid from: laying it again gives the same net to the last bit."""
        if self._given is None:
            raise TypeError("this Net cannot be pickled or copied: only one that fibre_net() returned can")
        return fibre_net, self._given


@typed
def fibre_net(
    surface: Reference,
    reference: Reference,
    centre_mm: ArrayLike,
    angles_deg: ArrayLike,
    spacing_mm: float | None = None,
    outline_mm: ArrayLike | None = None,
    ply_outline: ArrayLike | None = None,
    edge_tol_mm: float = _DEFAULTS.free_edge_mm,
    mold_tol_mm: float = _DEFAULTS.mold_tol_mm,
    paths: Paths = "geodesic",
    rms_outline_mm: ArrayLike | None = None,
    node_target: int = _DEFAULTS.node_target,
) -> Net:
    """Lay the net of one pocket (paper, "Meshing").

    Two fibre paths run from the centre along the fibre angles. Every other node lies on the surface at one spacing from
    two neighbours. The net reaches one spacing past the perimeter (seen from above) and ends at the ply's edge. A node
    in that band within `mold_tol_mm` of the reference is a boundary node: free within `edge_tol_mm` of the ply's edge,
    and fixed elsewhere. A higher node in the band stays movable, but is removed if only one segment holds it. A fibre
    that the ply's edge cuts ends in a free node.

    Parameters
    ----------
    surface
        The ply around the pocket, a patch.
    reference
        The surface below it.
    centre_mm
        (2,) where the paths cross, inside the outline (and the ply), mold XY.
    angles_deg
        (2,) directions of the two fibres, counter-clockwise from the mold's +x, projected along z into the tangent
        plane. They must cross at 10° or more, and need not cross at 90°.
    spacing_mm
        Distance between the nodes, a chord. Default: chosen so that the net has about `node_target` nodes.
    outline_mm
        (K, 2) the pocket's perimeter, closed implicitly. Default: the rectangle of the surface's grid.
    ply_outline
        (K, 2) the ply's edge. Default: unknown, no free node.
    edge_tol_mm
        Distance from the ply's edge within which boundary nodes are free.
    mold_tol_mm
        Height above the reference up to which the mold holds a node in the band.
    paths
        How the net continues from the centre along its two fibres: on each as a "geodesic" or in a "vertical_plane", or
        with "least_shear" by two crossing strips of cells that shear least, as in KinDrape (see below). Geodesics
        follow every bump. Use the plane on a surface that is noisy from sample to sample, or was joined with a step at
        the perimeter. The strips follow a doubly curved mold with the least shear at first, but each cell depends on
        the one before; shear is measured from the angle at which the fibres cross at the centre in space, so only
        directions at a right angle in the tangent plane give KinDrape's net.
    rms_outline_mm
        (K, 2) outline that determines `Net.inside` in place of the perimeter.
    node_target
        Number of nodes for which the spacing is chosen, 9 or more; met within 3 % if any spacing allows that.

    Raises
    ------
    InputError
        If the surface is no Reference, the centre is outside the outline, the fibres are parallel, the spacing is not
        positive, or an outline has no area or values that are not finite. Also if a path is trapped on a steep part of
        the surface, as in a vertical plane that hardly meets a dome's rim; the error says where.

    References
    ----------
    C. Krogh, B. L. V. Bak, E. Lindgaard, A. M. Olesen, S. M. Hermansen, P. H. Broberg, J. A. Kepler, E. Lund,
    J. Jakobsen: "A simple MATLAB draping code for fiber-reinforced composites with application to optimization of
    manufacturing process parameters", Struct. Multidisc. Optim. 64 (2021), 457-471.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> x = np.arange(-60.0, 61.0, 2.0)
    >>> r = np.hypot(*np.meshgrid(x, x))
    >>> mold = debulk.surface.Reference(np.zeros((61, 61)), (-60, -60), 2.0)
    >>> ply = debulk.surface.Reference(np.where(r < 40, 8 * np.cos(np.pi * r / 80) ** 2, 0.0), (-60, -60), 2.0)
    >>> t = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    >>> net = fibre_net(ply, mold, (0, 0), (0, 90), 10.0, outline_mm=40 * np.c_[np.cos(t), np.sin(t)])
    >>> net.nodes_mm.shape, np.bincount(net.kinds).tolist(), net.open_ends.size
    ((81, 3), [49, 32], 0)
    >>> a, b = net.nodes_mm[net.edges[:, 0]], net.nodes_mm[net.edges[:, 1]]
    >>> bool(np.allclose(np.linalg.norm(a - b, axis=1), 10.0, rtol=1e-9))
    True
    """
    options = _core.net.FibreNetOptions()
    options.spacing_mm = spacing_mm
    options.node_target = node_target
    options.free_edge_mm = edge_tol_mm
    options.mold_tol_mm = mold_tol_mm
    options.paths = paths
    made = _core.net.fibre_net(
        _checked(surface, "surface"),
        _checked(reference, "reference"),
        arrays.pair(centre_mm, "centre_mm"),
        _radians(angles_deg),
        _core.surface.extent(surface) if outline_mm is None else arrays.corners(outline_mm, "outline_mm"),
        None if ply_outline is None else arrays.corners(ply_outline, "ply_outline"),
        None if rms_outline_mm is None else arrays.corners(rms_outline_mm, "rms_outline_mm"),
        options,
    )
    places = (_copied(centre_mm), _copied(angles_deg), spacing_mm, _copied(outline_mm), _copied(ply_outline))
    limits = (edge_tol_mm, mold_tol_mm, paths, _copied(rms_outline_mm), node_target)
    return from_core(made, (surface, reference, *places, *limits))


def from_core(made: _core.net.PocketNet, given: tuple[Any, ...] | None = None) -> Net:
    """Wrap the net of a compiled pocket, which the sheet and the post-processing use.

    `given` holds the arguments of `fibre_net` if it laid the net.
    """
    net = made.net
    return Net(
        nodes_mm=net.nodes,
        neighbours=net.neighbours,
        kinds=net.kinds,
        edges=net.edges,
        inside=net.inside,
        spacing_mm=net.spacing,
        area_mm2=made.area,
        shear_deg=np.degrees(net.shear),
        open_ends=made.open_ends,
        lattice=net.lattice,
        _core=made,
        _given=given,
    )


def surface_area(surface: Reference, outline_mm: ArrayLike, ply_outline: ArrayLike | None = None) -> float:
    """Area of a surface inside an outline, mm².

    Parameters
    ----------
    surface
        Any smooth surface.
    outline_mm
        (K, 2) outline in mold XY, closed implicitly.
    ply_outline
        (K, 2) outline of the ply; only the area inside both outlines counts.

    Raises
    ------
    InputError
        If an outline has no area, or values that are not finite.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> slope = debulk.surface.Reference(np.tile(np.arange(8.0), (8, 1)), (0, 0), 1.0)
    >>> round(surface_area(slope, [(1, 1), (4, 1), (4, 3), (1, 3)]), 6)  # 6 √2
    8.485281
    """
    ply = None if ply_outline is None else arrays.corners(ply_outline, "ply_outline")
    return float(_core.net.surface_area(_checked(surface, "surface"), arrays.corners(outline_mm, "outline_mm"), ply))


@dataclass(frozen=True, eq=False)
class Drape:
    """The net of a whole ply on the mold, which gives the fibre angles anywhere in it.

    Attributes
    ----------
    nodes_mm, neighbours, edges, shear_deg, spacing_mm, lattice
        As in `Net`.
    inside
        (N,) bool: inside the outline; the net reaches about one cell beyond it where it can.
    """

    nodes_mm: Floats
    neighbours: Integers
    edges: Integers
    inside: NDArray[np.bool_]
    spacing_mm: float
    shear_deg: Floats
    lattice: Integers
    _core: Any = field(repr=False)
    _given: tuple[Any, ...] = field(repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what the ply was draped from: draping it again gives the same net to the last bit."""
        return drape, self._given

    def angles_deg(self, xy_mm: ArrayLike) -> Floats:
        """Directions of the two fibres at points of the mold's XY plane.

        Parameters
        ----------
        xy_mm
            (..., 2) points.

        Returns
        -------
        (..., 2) degrees in (-180, 180], counter-clockwise from the mold's +x, seen from above; NaN where the net does
        not reach.
        """
        xy = np.asarray(xy_mm, dtype=np.float64)
        if xy.ndim == 0 or xy.shape[-1] != 2:
            raise _core.InputError(f"xy_mm: expected an (..., 2) array, but got {arrays.came(xy_mm, xy)}")
        radians: Floats = self._core.fibre_angles(xy.reshape(-1, 2))
        return np.degrees(radians).reshape(xy.shape)


@typed
def drape(
    surface: Reference,
    seed_mm: ArrayLike,
    angles_deg: ArrayLike,
    spacing_mm: float,
    outline_mm: ArrayLike | None = None,
    paths: Paths = "geodesic",
) -> Drape:
    """Map a whole ply kinematically onto a surface: a pin-jointed net from a seed point (Mack and Taylor 1956).

    Parameters
    ----------
    surface
        The mold.
    seed_mm
        (2,) where the ply is first laid down, mold XY.
    angles_deg
        (2,) fibre directions at the seed, as in `fibre_net`.
    spacing_mm
        Distance between the nodes, a chord.
    outline_mm
        (K, 2) area to cover. Default: the rectangle of the surface's grid.
    paths
        As in `fibre_net`.

    Raises
    ------
    InputError
        If the seed lies outside the bounding box of the outline, the fibres are parallel, or the spacing is not
        positive or so small that the net would need more than 4 million nodes, or a path is trapped on a steep part of
        the surface.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> x, y = np.meshgrid(np.arange(-100.0, 101.0, 5.0), np.arange(-100.0, 101.0, 5.0))
    >>> dome = debulk.surface.Reference(np.sqrt(400.0**2 - x**2 - y**2), (-100, -100), 5.0)
    >>> ply = drape(dome, (0, 0), (45, 135), 5.0)
    >>> np.round(ply.angles_deg([[0, 0], [60, 10]]), 1).tolist()
    [[45.0, 135.0], [45.0, 135.0]]
    >>> round(float(ply.shear_deg[ply.inside].max()), 1)
    1.8
    >>> strips = drape(dome, (0, 0), (45, 135), 5.0, paths="least_shear")
    >>> round(float(strips.shear_deg[strips.inside].max()), 1)
    1.9
    """
    core = _core.net.Drape(
        _checked(surface, "surface"),
        arrays.pair(seed_mm, "seed_mm"),
        _radians(angles_deg),
        spacing_mm,
        outline=_core.surface.extent(surface) if outline_mm is None else arrays.corners(outline_mm, "outline_mm"),
        paths=paths,
    )
    net = core.net
    given = (surface, _copied(seed_mm), _copied(angles_deg), spacing_mm, _copied(outline_mm), paths)
    return Drape(
        net.nodes, net.neighbours, net.edges, net.inside, net.spacing, np.degrees(net.shear), net.lattice, core, given
    )


@dataclass(frozen=True)
class Draping:
    """Where a ply is first laid down, and how: a drape of a surface that is only known later.

    `debulk.Inspector` takes it as ``fibre_angles_deg`` and drapes the ply over the reference that it prepares.

    Raises
    ------
    InputError
        If seed or angles are not two finite numbers each, or the spacing is not positive.

    Examples
    --------
    >>> import numpy as np, debulk
    >>> plane = debulk.surface.Reference(np.zeros((5, 5)), (0, 0), 25.0)
    >>> Draping((20, 30), (45, 135)).on(plane).angles_deg([80, 90]).round(6).tolist()
    [45.0, 135.0]
    """

    seed_mm: tuple[float, float]
    """(x, y) where the ply is first laid down, mold XY."""
    angles_deg: tuple[float, float] = (0.0, 90.0)
    """Its two fibre directions there, as in `fibre_net`."""
    spacing_mm: float = 10.0
    """Distance between the nodes, a chord. A mold of 4 m² takes 40 000 nodes with the default, 10 mm."""
    paths: Paths = "geodesic"
    """As in `fibre_net`."""

    def __post_init__(self) -> None:
        arrays.pair(self.seed_mm, "seed_mm")
        arrays.pair(self.angles_deg, "angles_deg")
        arrays.positive(self.spacing_mm, "spacing_mm")

    def on(self, surface: Reference, outline_mm: ArrayLike | None = None) -> Drape:
        """Drape a surface; arguments and errors are those of `drape`."""
        return drape(surface, self.seed_mm, self.angles_deg, self.spacing_mm, outline_mm, self.paths)


def _checked(surface: Reference, argument: str) -> Any:
    if not isinstance(surface, _core.surface.Reference):
        raise _core.InputError(f"{argument}: expected a debulk.surface.Reference, but got {of_type(surface)}")
    return surface


def _copied(places: ArrayLike | None) -> Floats | None:
    """Return an argument that its owner cannot change any more."""
    return None if places is None else np.array(places, dtype=np.float64)


def _radians(angles_deg: ArrayLike) -> Floats:
    return np.radians(arrays.pair(angles_deg, "angles_deg"))
