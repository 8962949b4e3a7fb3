"""Packages that only some users want: imported where they are used, with one clear error if one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from debulk._core import InputError


def imported(module: str, extra: str, what: str) -> Any:
    """Import a module of an extra of debulk; if it is missing, the error says what needs it and how it is installed."""
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        if error.name != package:
            raise InputError(f"{what}: {package} cannot be loaded: {error}") from None
        raise InputError(f"{what}: {package} is not installed; install it by pip install 'debulk[{extra}]'") from None
