"""What is known of a qualified chain, as the file chain.json keeps it."""

from __future__ import annotations

import hashlib
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import Field, ValidationError

from debulk._core import InputError
from debulk.arguments import typed
from debulk.chain.part import Part
from debulk.chain.study import Agreement, Drift, Strip, Study, Transfer
from debulk.files.replacing import check_ending, write_text
from debulk.recipe.errors import message, wrong_values

if TYPE_CHECKING:
    from debulk.chain.recognise import Recogniser
    from debulk.inspection.rawscan.filled import FilledSearch

FORMAT = "debulk chain 1"
_MAX_FILE_BYTES = 1 << 22  # a chain has some kilobytes; a file far larger is something else


class Figure(Part):
    """A figure of the scans' signatures."""

    name: str
    """As in `debulk.chain.Signature`."""
    mean: float
    sd: float = Field(ge=0)
    """`mean`, `sd`: mean and standard deviation over the scans of the qualification."""
    low: float | None
    high: float | None
    """`low`, `high`: a scan of this chain lies between them; None: any value does."""


class Chain(Part):
    """A chain of scanner, filters and export that was qualified; `debulk.qualify` makes it."""

    format: Literal["debulk chain 1"] = "debulk chain 1"
    name: str
    """The chain's name, such as the cell's."""
    made_utc: str
    debulk: str
    """`made_utc`, `debulk`: when it was qualified, ISO 8601, and by which version of debulk."""
    scans: int = Field(ge=1)
    """Number of scans."""
    image: tuple[int, int] | None = None
    """Rows and columns of its scans; None: they are lists of points."""
    figures: tuple[Figure, ...]
    """What its scans look like."""
    drifts: tuple[Drift, ...] = ()
    """Trends of the figures, and of the height of the flat ply, from the first scan to the last."""
    studies: tuple[Study, ...] = ()
    agreement: Agreement | None = None
    """`studies`, `agreement`: how well pockets and their verdicts repeat."""
    strip: Strip | None = None
    """What the scans of a gauge, a strip or a ridge, show; None: there were none."""
    blur_mm: float | None = None
    transfer: tuple[Transfer, ...] = ()
    """`blur_mm`, `transfer`: sigma of the blur, by the gauge, or else at least that of the ply's edge; and what it
    leaves of narrow bumps."""
    doubts: tuple[str, ...] = ()
    """What the qualification could not show, or should not have shown."""

    @property
    def sha256(self) -> str:
        """Fingerprint of everything in the chain, hexadecimal."""
        return hashlib.sha256(self._json().encode()).hexdigest()

    def figure(self, name: str) -> Figure | None:
        """Return the figure of this name; None if the qualification could not measure it."""
        return next((one for one in self.figures if one.name == name), None)

    def recogniser(self, search: FilledSearch) -> Recogniser:
        """Prepare the comparison of an inspector's scans with this chain."""
        from debulk.chain.recognise import Recogniser

        return Recogniser(search, self)

    @typed
    def save(self, path: str | PathLike[str]) -> None:
        """Write the chain as .json, which `load` reads back to an equal chain, or as .html, a page for an auditor.

        Raises
        ------
        InputError
            If the name ends otherwise, or the file cannot be written.
        """
        path = Path(path)
        check_ending(path, ".json", ".html")
        if path.suffix.lower() == ".html":
            from debulk.chain.page import page

            text = page(self)
        else:
            text = self._json()
        write_text(path, text)

    @classmethod
    @typed
    def load(cls, path: str | PathLike[str]) -> Chain:
        """Read a chain from its .json.

        Raises
        ------
        InputError
            The file cannot be read, or is no chain; the message names the file and every wrong value.
        """
        path = Path(path)
        try:
            if path.stat().st_size > _MAX_FILE_BYTES:
                raise InputError(f"{path}: expected a chain, got a file of {path.stat().st_size} bytes")
            return cls.model_validate_json(path.read_bytes())
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            if first["type"] == "json_invalid":
                raise InputError(f"{path}: not valid JSON: {first['msg'].removeprefix('Invalid JSON: ')}") from None
            wrong = wrong_values(cls, error)
            kind = [one for one in wrong if one.name == "format"]  # another file: its other entries say nothing
            raise InputError(f"{path}: {message('chain', kind or wrong)}") from None

    def _json(self) -> str:
        return self.model_dump_json(indent=1) + "\n"
