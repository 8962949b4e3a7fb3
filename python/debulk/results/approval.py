"""Approved recipes: a file that a cell's owner keeps, with who approved which recipe and when."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.replacing import write_text
from debulk.files.source import open_source
from debulk.toml_text import values_in

_KEYS = ("name", "time_utc", "recipe_sha256")


@dataclass(frozen=True)
class Approval:
    """Who approved a recipe, when (ISO 8601, UTC), and the recipe's hash."""

    name: str
    time_utc: str
    recipe_sha256: str


def recipe_hash(recipe: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a recipe's settings, empty if there are none.

    The section ``run`` is left out: threads, fingerprints and folders differ between machines, and change no verdict.
    """
    if not recipe:
        return ""
    settings = {name: table for name, table in recipe.items() if name != "run"}
    text = json.dumps(settings, sort_keys=True, ensure_ascii=False, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def approvals(path: str | PathLike[str]) -> tuple[Approval, ...]:
    """Read a file of approvals."""
    path = Path(path)
    with open_source(path) as source:
        values = values_in(source.file.read(), path, "approvals")
    try:
        found = tuple(Approval(*(entry[key] for key in _KEYS)) for entry in values["approved"])
        if not all(isinstance(getattr(one, key), str) for one in found for key in _KEYS):
            raise TypeError
    except (KeyError, TypeError):
        what = f"approvals as debulk approve writes them: each with {', '.join(_KEYS)} as text"
        raise InputError(f"{path}: expected {what}") from None
    return found


@typed
def approve(path: str | PathLike[str], recipe: Mapping[str, Any], name: str, time_utc: str) -> Approval:
    """Add the approval of a recipe's settings, by name and time (ISO 8601), to a file .toml, which is made if need be.

    Keep the file where only those may write who may approve.
    """
    path = Path(path)
    if not name.strip() or not name.isprintable():
        raise InputError(f"name: expected who approves, got {name!r}")
    before = ""
    if path.exists():
        approvals(path)
        before = path.read_text(encoding="utf-8").rstrip("\n") + "\n\n"
    new = Approval(name, time_utc, recipe_hash(recipe))
    lines = "".join(f"{key} = {json.dumps(getattr(new, key), ensure_ascii=False)}\n" for key in _KEYS)
    write_text(path, f"{before}[[approved]]\n{lines}")
    return new
