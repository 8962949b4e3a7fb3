"""Types of the compiled module `debulk._core.net`."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import Stop, _Bound, _Flags, _Floats, _Integers, _Made, _Options
from debulk._core.pocket import FootMap, Segmentation
from debulk._core.surface import Surface

class Drape(metaclass=_Bound):
    def __init__(
        self, surface: Surface, seed: ArrayLike, angles: ArrayLike, spacing: float, *, outline: ArrayLike, paths: str
    ) -> None: ...
    def fibre_angles(self, xy: ArrayLike) -> _Floats: ...
    @property
    def net(self) -> Net: ...

class FibreNetOptions(_Options):
    spacing_mm: float | None
    node_target: int
    free_edge_mm: float
    mold_tol_mm: float
    paths: str

class LayPocketOptions(_Options):
    mode: str
    net: FibreNetOptions

class Net(_Made):
    @property
    def edges(self) -> _Integers: ...
    @property
    def inside(self) -> _Flags: ...
    @property
    def kinds(self) -> NDArray[np.int8]: ...
    @property
    def lattice(self) -> _Integers: ...
    @property
    def neighbours(self) -> _Integers: ...
    @property
    def nodes(self) -> _Floats: ...
    @property
    def shear(self) -> _Floats: ...
    @property
    def spacing(self) -> float: ...

class PocketNet(_Made):
    @property
    def area(self) -> float: ...
    @property
    def held_all_round(self) -> bool: ...
    @property
    def net(self) -> Net: ...
    @property
    def open_ends(self) -> _Integers: ...

def fibre_net(
    surface: Surface,
    reference: Surface,
    centre: ArrayLike,
    angles: ArrayLike,
    outline: ArrayLike,
    ply_outline: ArrayLike | None,
    rms_outline: ArrayLike | None,
    options: FibreNetOptions,
) -> PocketNet: ...
def lay_pocket(
    segmentation: Segmentation,
    feet: FootMap,
    pocket_id: int,
    reference: Surface,
    angles: ArrayLike,
    ply_outline: ArrayLike | None,
    options: LayPocketOptions,
    stop: Stop,
) -> PocketNet: ...
def surface_area(surface: Surface, outline: ArrayLike, ply_outline: ArrayLike | None) -> float: ...
def with_rim_held(laid: PocketNet) -> PocketNet: ...
