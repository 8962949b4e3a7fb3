"""Types of the compiled module `debulk._core.verdict`."""

from collections.abc import Sequence
from typing import ClassVar

from debulk._core import _Bound, _Enum, _Made, _Options

class Criteria(_Options):
    compliance_margin_mm: float
    criterion: Criterion
    max_ridge_height_mm: float
    max_rms_mm: float
    min_coverage: float
    min_pocket_coverage: float
    ridge_margin_mm: float
    rms_margin_mm: float
    def check(self) -> None: ...

class Criterion(_Enum):
    __members__: ClassVar[dict[str, Criterion]]
    EXCESS: ClassVar[Criterion]
    PAPER: ClassVar[Criterion]

class JudgedPocket(_Options):
    id: int
    judgement: Judgement

class Judgement(_Options):
    reason: str
    verdict: Verdict
    @property
    def decided_by(self) -> Criterion | None: ...

class PocketEvidence(_Options):
    bridge_height: Spread
    certified: bool
    closed_rim: bool
    compliant: bool
    coverage: float
    deadline_passed: bool
    excess_ridge: Spread | None
    inside_ply: bool
    refused: str
    ridge_height: Spread
    rms: Spread
    solve_status: str

class RidgeBounds(_Made):
    @property
    def elastic_mm(self) -> float: ...
    @property
    def geometric_mm(self) -> float: ...
    @property
    def least_mm(self) -> float: ...

class Spread(metaclass=_Bound):
    def __init__(self, low: float, high: float) -> None: ...
    @property
    def high(self) -> float: ...
    @property
    def low(self) -> float: ...

class Verdict(_Enum):
    __members__: ClassVar[dict[str, Verdict]]
    CEASE: ClassVar[Verdict]
    CREASE: ClassVar[Verdict]
    INVALID: ClassVar[Verdict]
    UNDECIDED: ClassVar[Verdict]

def excess_bounds(
    excess_length_mm: float, thickness_mm: float, bulk_factor: float, natural_length_mm: float
) -> RidgeBounds: ...
def judge(evidence: PocketEvidence, criteria: Criteria) -> Judgement: ...
def judge_layup(pockets: Sequence[JudgedPocket], coverage: float, criteria: Criteria) -> Judgement: ...
def natural_length(modulus_mpa: float, thickness_mm: float, pressure_mpa: float) -> float: ...
