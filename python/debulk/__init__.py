"""Will it crease or cease? Predicts which air pockets under a draped prepreg ply survive vacuum debulking."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from debulk import _core
from debulk._core import InputError
from debulk.build import check_core
from debulk.grid import Grid

if TYPE_CHECKING:
    from debulk import (
        batch,
        chain,
        cloud,
        fibre,
        files,
        history,
        learning,
        net,
        pocket,
        recipe,
        ridge,
        scanner,
        scenes,
        section,
        sheet,
        solve,
        surface,
        verdict,
    )
    from debulk.chain.qualifying import qualify
    from debulk.chain.record import Chain
    from debulk.comparison import Comparison
    from debulk.inspection.calls import compare, inspect
    from debulk.inspection.inspector import Cancelled, Inspector
    from debulk.inspection.repeating import repeat
    from debulk.recipe import Recipe
    from debulk.report import Report
    from debulk.stack import Stack
    from debulk.verdict import Verdict

__version__ = "0.18.0"
check_core(getattr(_core, "build", "unknown"), __version__)

__all__ = [
    "Cancelled",
    "Chain",
    "Comparison",
    "Grid",
    "InputError",
    "Inspector",
    "Recipe",
    "Report",
    "Stack",
    "Verdict",
    "__version__",
    "batch",
    "chain",
    "cloud",
    "compare",
    "fibre",
    "files",
    "history",
    "inspect",
    "learning",
    "net",
    "pocket",
    "qualify",
    "recipe",
    "repeat",
    "ridge",
    "scanner",
    "scenes",
    "section",
    "sheet",
    "solve",
    "surface",
    "verdict",
]

# Loaded when first used, so that `import debulk` does not wait for parts that a program may never need.
_HOMES = {
    "Cancelled": "inspection.inspector",
    "Chain": "chain.record",
    "Comparison": "comparison",
    "Inspector": "inspection.inspector",
    "Recipe": "recipe",
    "Report": "report",
    "Stack": "stack",
    "Verdict": "verdict",
    "compare": "inspection.calls",
    "inspect": "inspection.calls",
    "qualify": "chain.qualifying",
    "repeat": "inspection.repeating",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"debulk.{_HOMES[name]}"), name)
    if name in __all__:
        return importlib.import_module(f"debulk.{name}")
    raise AttributeError(f"module 'debulk' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
