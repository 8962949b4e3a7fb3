"""Packages that only some users want: imported where they are used, missed by one clear error."""

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
        Its name.
    extra
        Of debulk, that installs it.
    what
        Needs it: named first in the error.

    Raises
    ------
    InputError
        If its package is not installed: names the command that installs it.
    """
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        if error.name != package:
            raise InputError(f"{what}: {package} cannot be loaded: {error}") from None
        raise InputError(f"{what}: {package} is not installed; install it by pip install 'debulk[{extra}]'") from None
