"""Types of the compiled module `debulk._core.section`."""

from numpy.typing import ArrayLike

from debulk._core import Stop, _Floats, _Made, _Options
from debulk._core.solve import Certificate

class SectionFold(_Made):
    @property
    def certificate(self) -> Certificate: ...
    @property
    def certified(self) -> bool: ...
    @property
    def explanation(self) -> str: ...
    @property
    def guide_force_n_per_mm(self) -> float: ...
    @property
    def natural_length_mm(self) -> float: ...
    @property
    def points_mm(self) -> _Floats: ...
    @property
    def status(self) -> str: ...
    @property
    def steps(self) -> list[SectionStep]: ...

class SectionStep(_Made):
    @property
    def end_force_n_per_mm(self) -> float: ...
    @property
    def foot_width_mm(self) -> float: ...
    @property
    def height_mm(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def pressure_mpa(self) -> float: ...

class SectionPly(_Options):
    stiffness_n_mm: float
    pressure_mpa: float

class SectionOptions(_Options):
    segments: int
    steps: int
    pressure: str
    bending: str
    self_contact: bool
    contact_distance_mm: float

def fold_section(
    excess_length_mm: float,
    span_mm: float,
    ply: SectionPly,
    profile: ArrayLike | None,
    options: SectionOptions,
    stop: Stop,
) -> SectionFold: ...
