"""Will it crease or cease? Predicts which air pockets under a draped prepreg ply survive vacuum debulking."""

from __future__ import annotations

from debulk._core import InputError
from debulk.grid import Grid

__version__ = "0.1.0"
__all__ = ["Grid", "InputError", "__version__"]
