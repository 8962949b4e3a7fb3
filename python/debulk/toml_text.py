"""TOML that people write by hand."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from debulk._core import InputError


def values_in(data: bytes, path: Path, what: str) -> dict[str, Any]:
    """Return the values of a file of TOML, which may begin with the mark that editors of Windows set before UTF-8.

    An `InputError` names the file, and what is wrong with it; `what` says what was expected.
    """
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a text file: byte {error.start} is not UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not valid TOML: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: not {what}: nested too deeply") from None
