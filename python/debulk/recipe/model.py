"""The recipe: every setting of an inspection, with its unit in its name and the paper's tables as defaults.

Import this module only where it is needed, not with the package: importing pydantic takes a tenth of a second.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pydantic import BaseModel, Field, ValidationError

from debulk._core import InputError
from debulk.arguments import typed
from debulk.recipe.errors import Wrong, impossible, message, wrong_values
from debulk.recipe.section import Section
from debulk.recipe.tables import (
    Clean,
    Level,
    Loads,
    Material,
    Net,
    Patch,
    Ridge,
    Run,
    Segmentation,
    Solve,
    Uncertainty,
    VerdictLimits,
)
from debulk.toml_text import values_in

Table = Mapping[str, Any]
_MAX_FILE_BYTES = 1 << 20  # a recipe has a few kilobytes; a file far larger is something else


def _max_rms_mm(thickness_mm: Any) -> float:
    """Return the limit of the RMS unless the recipe sets one: the paper's, or a thicker ply's nominal thickness."""
    papers = float(VerdictLimits.model_fields["max_rms_mm"].default)
    return max(papers, thickness_mm) if isinstance(thickness_mm, float) and thickness_mm < math.inf else papers


class Recipe(Section):
    """Every setting of an inspection.

    A recipe is frozen: compare it with ``==``, and make a changed copy with :meth:`model_copy`. The defaults are the
    tables of Krogh, Jakobsen and Wilm, *Will it Crease or Cease?*, and this project's readings where the paper is
    silent.

    Raises
    ------
    InputError
        A value is wrong or unknown; the message names every such value, what was expected and what was given.

    Examples
    --------
    >>> Recipe().material.thickness_mm
    0.3
    >>> Recipe(net={"node_target": 50}).net.node_target
    50
    """

    material: Material = Field(default_factory=lambda: Material())
    loads: Loads = Field(default_factory=lambda: Loads())  # not "load": Recipe.load reads a file
    segmentation: Segmentation = Field(default_factory=lambda: Segmentation())
    clean: Clean = Field(default_factory=lambda: Clean())
    level: Level = Field(default_factory=lambda: Level())
    patch: Patch = Field(default_factory=lambda: Patch())
    net: Net = Field(default_factory=lambda: Net())
    solve: Solve = Field(default_factory=lambda: Solve())
    ridge: Ridge = Field(default_factory=lambda: Ridge())
    verdict: VerdictLimits = Field(default_factory=lambda: VerdictLimits())
    uncertainty: Uncertainty = Field(default_factory=lambda: Uncertainty())
    run: Run = Field(default_factory=lambda: Run())

    if TYPE_CHECKING:  # pydantic accepts a table in place of a section, which type checkers would not know

        def __init__(
            self,
            *,
            material: Material | Table = ...,
            loads: Loads | Table = ...,
            segmentation: Segmentation | Table = ...,
            clean: Clean | Table = ...,
            level: Level | Table = ...,
            patch: Patch | Table = ...,
            net: Net | Table = ...,
            solve: Solve | Table = ...,
            ridge: Ridge | Table = ...,
            verdict: VerdictLimits | Table = ...,
            uncertainty: Uncertainty | Table = ...,
            run: Run | Table = ...,
        ) -> None: ...

    else:

        def __init__(self, **values: Any) -> None:
            """Check all values, each one alone and against the others."""
            try:
                super(Section, self).__init__(**values)
                # Not among the fields that are set, so that a copy with another thickness gets its own limit.
                if "max_rms_mm" not in self.verdict.model_fields_set:
                    self.verdict.__dict__["max_rms_mm"] = _max_rms_mm(self.material.thickness_mm)
                wrong = impossible(self.model_dump(), set())
            except ValidationError as error:
                wrong = wrong_values(type(self), error)
                wrong += self._impossible_rest(values, wrong)
            if wrong:
                raise InputError(message("recipe", wrong))

        __init__.__pydantic_base_init__ = True

    @classmethod
    def _impossible_rest(cls, values: Mapping[str, Any], wrong: list[Wrong]) -> list[Wrong]:
        """Check those values against each other that are right by themselves."""
        merged = cls().model_dump()
        for section, given in values.items():
            if section in merged:
                table = given.model_dump() if isinstance(given, BaseModel) else given
                merged[section] |= {str(k): v for k, v in table.items()} if isinstance(table, Mapping) else {}
        if not isinstance(values.get("verdict"), Mapping) or "max_rms_mm" not in values["verdict"]:
            merged["verdict"]["max_rms_mm"] = _max_rms_mm(merged["material"]["thickness_mm"])
        return impossible(merged, {entry.name for entry in wrong})

    def __repr__(self) -> str:
        """Show the values that are not defaults; ``to_toml`` shows the whole recipe."""
        changed = {
            name: {key: value for key, value in table if getattr(type(table)(), key) != value} for name, table in self
        }
        return f"Recipe({', '.join(f'{name}={table!r}' for name, table in changed.items() if table)})"

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a recipe from a TOML file; settings that the file does not name keep their defaults.

        Parameters
        ----------
        path
            The file. ``debulk recipe`` prints an example of one.

        Raises
        ------
        InputError
            The file cannot be read or holds a wrong recipe; the message names the file, and the line of broken TOML or
            every wrong value.
        """
        path = Path(path)
        try:
            if path.stat().st_size > _MAX_FILE_BYTES:
                raise InputError(f"{path}: expected a recipe in TOML, got a file of {path.stat().st_size} bytes")
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        values = values_in(data, path, "a recipe")
        try:
            return cls(**values)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def to_toml(self) -> str:
        """Return the recipe as TOML with a comment on every setting; :meth:`load` reads it back to an equal recipe."""
        from debulk.recipe.toml import toml

        return toml(self)
