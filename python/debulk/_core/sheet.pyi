"""Types of the compiled module `debulk._core.sheet`."""

from typing import overload

from numpy.typing import ArrayLike

from debulk._core import Stop, _Bound, _Floats, _Integers, _Made, _Options
from debulk._core.net import PocketNet
from debulk._core.solve import Certificate, SolveOptions
from debulk._core.surface import Surface

class Minimum(_Made):
    @property
    def certificate(self) -> Certificate: ...
    @property
    def certified(self) -> bool: ...
    @property
    def energy_mj(self) -> float: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def explanation(self) -> str: ...
    @property
    def iterations(self) -> int: ...
    @property
    def nodes_mm(self) -> _Floats: ...
    @property
    def status(self) -> str: ...
    @property
    def tensions_n(self) -> _Floats: ...

class PlyMaterial(_Options):
    thickness_mm: float
    young_mpa: float
    shear_mpa: float
    density_kg_m3: float
    friction: float
    pressure_mpa: float
    gravity_m_s2: float
    lumping: str
    torsion_n_mm: float
    in_plane_bending_n_mm: float
    tack_n_mm3: float
    pressure_direction: str

class MinimiseOptions(_Options):
    method: str
    starts: int
    first_start: int
    seed: int
    solve: SolveOptions

class Minimiser(metaclass=_Bound):
    def __init__(self, sheet: Sheet) -> None: ...
    def run(self, options: MinimiseOptions, start: ArrayLike | None, stop: Stop) -> list[Minimum]: ...

class Sheet(metaclass=_Bound):
    @overload
    def __init__(
        self,
        nodes_mm: ArrayLike,
        neighbours: ArrayLike,
        kinds: ArrayLike,
        spacing_mm: float,
        area_mm2: float,
        reference: Surface,
        ply: PlyMaterial,
        edge_mm: list[float],
    ) -> None: ...
    @overload
    def __init__(self, net: PocketNet, reference: Surface, ply: PlyMaterial) -> None: ...
    def energy(self, x: ArrayLike) -> float: ...
    def gaps(self, x: ArrayLike) -> _Floats: ...
    def gradient(self, x: ArrayLike) -> _Floats: ...
    def hessian(self, x: ArrayLike) -> tuple[_Integers, _Integers, _Floats]: ...
    def lengths(self, x: ArrayLike) -> _Floats: ...
    def terms(self, x: ArrayLike) -> dict[str, float]: ...
    @property
    def edge_mm(self) -> _Floats: ...
    @property
    def left_out(self) -> list[str]: ...
    @property
    def nodal_force_n(self) -> float: ...
    @property
    def start(self) -> _Floats: ...

def certify(sheet: Sheet, nodes_mm: ArrayLike, stiffness: float, /) -> Certificate: ...
