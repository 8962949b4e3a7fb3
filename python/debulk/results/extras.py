"""Packages that only some users want: imported where they are used, with one clear error if one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from debulk._core import InputError

__all__ = ["imported"]


def imported(module: str, extra: str, what: str) -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    module
        Name of the module.
    extra
        Extra of debulk that installs it.
    what
        What needs it; named first in the error.

    Raises
    ------
    InputError
        If its package is not installed; the message names the command that installs it.
    """
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        if error.name != package:
            raise InputError(f"{what}: {package} cannot be loaded: {error}") from None
        raise InputError(f"{what}: {package} is not installed; install it by pip install 'debulk[{extra}]'") from None
