"""The inspectors of a cell: each is prepared once for its reference, and then waits for scans."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import InputError, files
from debulk.chain.record import Chain
from debulk.inspection.inspector import Inspector
from debulk.net import Draping
from debulk.recipe import Recipe
from debulk.serve.refusal import Refusal

MOST = 8
"""Inspectors at once: each keeps its reference in memory."""


@dataclass(frozen=True, eq=False)
class Cell:
    """What all inspectors of a cell have in common: arguments of `debulk.Inspector` by their names, and the units."""

    recipe: Recipe
    ply_outline: NDArray[np.float64] | None = None
    fibre_angles_deg: tuple[float, float] | Draping = (0.0, 90.0)
    mold_from_scanner: NDArray[np.float64] | None = None
    camera: tuple[float, float, float] | None = None
    mask: NDArray[np.bool_] | None = None
    chain: Chain | None = None
    approved: Path | None = None
    unit: files.Unit = "mm"  # of clouds
    frame_unit: files.Unit = "mm"  # of outlines and angles
    outline_layer: str | None = None  # of outlines in DXF files

    def changed(self, angles: tuple[float, float] | None, outline: Path | None) -> Cell:
        """Return the same for a ply of other fibre angles and another outline, where they are given.

        A ply that is draped from a place is draped from there along the other angles.
        """
        own = self.fibre_angles_deg
        draped = replace(own, angles_deg=angles) if angles and isinstance(own, Draping) else angles
        cell = self if draped is None else replace(self, fibre_angles_deg=draped)
        if outline is None:
            return cell
        return replace(cell, ply_outline=files.load_outline(outline, self.frame_unit, self.outline_layer))

    def inspector(self, reference: Path) -> Inspector:
        """Read a reference and prepare its inspector, which takes seconds; an error names the reference."""
        of_files = "unit", "frame_unit", "outline_layer"
        given = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in of_files}
        try:
            return Inspector(reference=files.load_cloud(reference, self.unit), **given)
        except InputError as error:
            text = str(error)
            raise InputError(text if str(reference) in text else f"{reference}: {text}") from None


class Inspectors:
    """Inspectors by their names; a name whose reference is being replaced has none, so that no scan meets the old one.

    The methods are called from one thread.
    """

    def __init__(self) -> None:
        self._ready: dict[str, Inspector] = {}
        self._wrong: dict[str, str] = {}
        self.preparing = ""

    def names(self) -> dict[str, str]:
        """Return the state of each: "ready", "preparing", or why it could not be prepared."""
        preparing = {self.preparing: "preparing"} if self.preparing else {}
        return {**dict.fromkeys(self._ready, "ready"), **self._wrong, **preparing}

    def get(self, name: str) -> Inspector:
        """Return an inspector that is ready; a `Refusal` says why there is none."""
        if name in self._ready:
            return self._ready[name]
        if name == self.preparing:
            raise Refusal(503, f"inspector: {name} is being prepared", retry_after_s=1)
        if name in self._wrong:
            raise Refusal(409, f"inspector: {name} could not be prepared: {self._wrong[name]}")
        raise Refusal(404, f"inspector: there is no {name}; prepare it: PUT /inspectors/{name}")

    def begin(self, name: str) -> None:
        """Take an inspector out of use, because another reference is prepared for its name; only one is at a time."""
        if self.preparing:
            raise Refusal(503, f"inspector: {self.preparing} is being prepared", retry_after_s=2)
        if len({*self._ready, name}) > MOST:
            raise Refusal(409, f"inspector: there are {MOST} already; DELETE /inspectors/NAME removes one")
        self._ready.pop(name, None)
        self._wrong.pop(name, None)
        self.preparing = name

    def end(self, found: Inspector | str) -> None:
        """Put the prepared inspector into use, or keep the reason why there is none."""
        name, self.preparing = self.preparing, ""
        if not isinstance(found, str):
            self._ready[name] = found
            return
        while len(self._wrong) >= MOST:
            self._wrong.pop(next(iter(self._wrong)))
        self._wrong[name] = found

    def remove(self, name: str) -> None:
        """Forget an inspector, or why there is none."""
        if name not in self._wrong:
            self.get(name)
        self._ready.pop(name, None)
        self._wrong.pop(name, None)
