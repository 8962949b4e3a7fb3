"""Types of the compiled module `debulk._core.region`."""

from numpy.typing import ArrayLike

from debulk._core import Stop, _Bound, _Floats, _Options, _Singles
from debulk._core.pocket import FootMap, FootOptions, Segmentation, SegmentOptions, Unseen, UnseenOptions
from debulk._core.surface import FrontEndOptions, Reference

class RegionOptions(_Options):
    front: FrontEndOptions
    segment: SegmentOptions
    feet: FootOptions
    flag_mm: float | None
    largest_share: float
    row_step: int
    column_step: int

class RegionFront(metaclass=_Bound):
    def __init__(
        self,
        reference: Reference,
        shape: tuple[int, int],
        camera: tuple[float, float, float],
        mold_from_scanner: ArrayLike,
        options: RegionOptions,
        threads: int,
        seen: tuple[ArrayLike, ArrayLike, float] | None,
    ) -> None: ...
    def overview(self, options: UnseenOptions) -> tuple[_Singles, _Floats, float, Unseen]: ...
    def run(self, scan: ArrayLike, mask: ArrayLike | None, stop: Stop) -> bool: ...
    def regions(self) -> list[tuple[Segmentation, FootMap]]: ...
    @property
    def flag_mm(self) -> float: ...
    @property
    def image_share(self) -> float: ...
    @property
    def mesh(self) -> tuple[int, int, float, float]: ...
    @property
    def read_share(self) -> float: ...
    @property
    def usable(self) -> bool: ...
    @property
    def reason(self) -> str: ...
    @property
    def threshold(self) -> tuple[float, float, int]: ...
    @property
    def times(self) -> tuple[float, float, float, float, float, float]: ...
    @property
    def windows(self) -> list[tuple[int, int, int, int]]: ...
