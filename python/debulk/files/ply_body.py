"""The elements of a PLY file, one kind after the other, in binary or in text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.files.source import Layout, Points, Source, summarised

_MOST_LINE_BYTES = 1 << 20


class Property(NamedTuple):
    """One number of an element, or, if there is a type of its length, a list of numbers."""

    name: str
    type: str
    length: str = ""

    @property
    def least_bytes(self) -> int:
        """Bytes of the number, or of an empty list."""
        return int((self.length or self.type)[1])


@dataclass
class Element:
    """A kind of elements as the header declares it."""

    name: str
    count: int
    offset: int
    properties: list[Property] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """Names of the properties."""
        return [one.name for one in self.properties]

    @property
    def has_list(self) -> bool:
        """Whether elements may differ in size."""
        return any(one.length for one in self.properties)

    @property
    def least_bytes(self) -> int:
        """Bytes of an element whose lists are empty."""
        return sum(one.least_bytes for one in self.properties)


class Body:
    """Reads the elements that follow the header, in their order; each call begins where the one before has ended."""

    def __init__(self, source: Source, form: str, offset: int) -> None:
        self._source, self._offset = source, offset
        self._text, self._big_endian = form == "ascii", form == "binary_big_endian"

    def skip(self, element: Element) -> None:
        """Pass over all elements of a kind."""
        self.values(element, [])

    def values(self, element: Element, names: Sequence[str]) -> NDArray[np.float64]:
        """Return (count, len(names)) numbers; of a list the first number, and NaN for an empty one."""
        if not element.count or not element.properties:
            return np.empty((0, len(names)))
        self._check_size(element)
        if not names and not self._text and not element.has_list:
            self._offset += element.count * element.least_bytes
            return np.empty((0, 0))
        out = np.empty((element.count, len(names)))
        places = {element.names.index(name): column for column, name in enumerate(names)}
        if self._text:
            self._lines(element, places, out)
            return out
        with self._source.faults():
            self._offset = _core.files.read_elements(
                self._source.file.fileno(),
                self._offset,
                self._source.size,
                [(one.type, one.length, places.get(k, -1)) for k, one in enumerate(element.properties)],
                self._big_endian,
                out,
            )
        return out

    def points(self, element: Element, xyz: list[int], factor: float, *, alone: bool) -> Points:
        """Return the vertices; `alone` says that nothing may follow them."""
        source, first = self._source, self._offset
        if element.has_list:
            values = self.values(element, [element.names[place] for place in xyz])
            if not len(values):
                source.fail(first, "no points in the file")
            source.file.seek(self._offset)
            rest = source.file.read(_MOST_LINE_BYTES if self._text else 1)
            if alone and (rest.split() if self._text else rest):
                source.fail(self._offset, f"{source.size - self._offset} bytes follow the {element.count} points")
            return summarised(values, factor)
        if self._text:
            read = source.text_points(first, len(element.names), xyz, factor, count=element.count, exact=alone)
            if not alone:
                self._lines(element, {}, None)
            return read
        starts = [0, *accumulate(one.least_bytes for one in element.properties)]
        types = [element.properties[place].type for place in xyz]
        layout = Layout(starts[-1], [starts[place] for place in xyz], types, self._big_endian)
        source.check_size(first, element.count, layout.record_bytes, exact=alone)
        self._offset += element.count * layout.record_bytes
        return source.points(first, element.count, layout, factor)

    def _check_size(self, element: Element) -> None:
        """Compare the least size of the elements with what the file still holds, before memory is taken for them."""
        each = 2 * len(element.properties) if self._text else element.least_bytes
        least = each * element.count - self._text  # the last line may lack its end
        self._source.check_size(
            self._offset, element.count, each, exact=False, what=f"elements {element.name[:40]!r}", least=least
        )

    def _lines(self, element: Element, places: dict[int, int], out: NDArray[np.float64] | None) -> None:
        """Read one line of numbers per element, keep the numbers at these places, and pass over empty lines."""
        file, done = self._source.file, 0
        file.seek(self._offset)
        while done < element.count:
            at = self._offset
            line = file.readline(_MOST_LINE_BYTES)
            self._offset += len(line)
            if not line or len(line) == _MOST_LINE_BYTES:
                what = "the file ends" if not line else f"a line of more than {_MOST_LINE_BYTES} bytes"
                lack = f"{element.count - done} of {element.count} elements {element.name[:40]!r} lack"
                self._source.fail(at, f"{what}, but {lack}")
            words = line.split()
            if not words:
                continue
            if places and out is not None:
                self._keep(element, words, places, out[done], at)
            done += 1

    def _keep(
        self, element: Element, words: list[bytes], places: dict[int, int], row: NDArray[np.float64], at: int
    ) -> None:
        word = 0
        try:
            for k, one in enumerate(element.properties):
                length = int(words[word]) if one.length else 1
                word += bool(one.length)
                if k in places:
                    row[places[k]] = float(words[word]) if length else np.nan
                if not 0 <= length <= len(words) - word:
                    raise ValueError
                word += length
        except (ValueError, IndexError):
            shown = b" ".join(words)[:60].decode("utf-8", errors="replace")
            self._source.fail(at, f"expected the numbers of an element {element.name[:40]!r}, got {shown!r}")
