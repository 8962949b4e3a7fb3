"""Types of the compiled module, one file per submodule. `mypy.stubtest debulk._core` checks them (make lint)."""

from typing import Never, type_check_only

import numpy as np
from numpy.typing import NDArray

from debulk._core import cloud as cloud
from debulk._core import fibre as fibre
from debulk._core import files as files
from debulk._core import net as net
from debulk._core import pocket as pocket
from debulk._core import ridge as ridge
from debulk._core import scanner as scanner
from debulk._core import section as section
from debulk._core import sheet as sheet
from debulk._core import solve as solve
from debulk._core import surface as surface
from debulk._core import verdict as verdict

_Floats = NDArray[np.float64]
_Singles = NDArray[np.float32]
_Integers = NDArray[np.int32]
_Bytes = NDArray[np.uint8]
_Flags = NDArray[np.bool_]

@type_check_only
class _Bound(type):
    """The metaclass that pybind11 gives its classes."""

@type_check_only
class _Made(metaclass=_Bound):
    """A class whose objects only the module itself creates."""

    def __init__(self, *args: Never, **kwargs: Never) -> None: ...

build: str

@type_check_only
class _Options(metaclass=_Bound):
    """A class whose objects are made with their defaults, and then changed."""

    def __init__(self) -> None: ...

@type_check_only
class _Enum(metaclass=_Bound):
    """An enumeration of pybind11."""

    def __init__(self, value: int) -> None: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...
    def __index__(self) -> int: ...
    def __int__(self) -> int: ...
    def __ne__(self, other: object) -> bool: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> int: ...

class InputError(ValueError): ...
class Stopped(RuntimeError): ...

class Stop(metaclass=_Bound):
    def __init__(self) -> None: ...
    def cancel(self) -> None: ...
    def now(self) -> bool: ...
    def set_deadline(self, seconds: float) -> None: ...
    @property
    def cancelled(self) -> bool: ...
    @property
    def past_deadline(self) -> bool: ...

def build_versions() -> dict[str, str]: ...
def default_threads() -> int: ...
def instruction_set() -> str: ...
