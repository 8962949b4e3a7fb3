"""A pocket whose verdict needed neither net nor minimum: they are made when somebody reads one of their figures."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from debulk.forking import Guard
from debulk.results.report import PocketReport

Made = TypeVar("Made")

PICTURE = frozenset(
    (
        "paper_verdict", "spacing_mm", "node_count", "rms_mm", "rms_range_mm", "ridge_height_mm", "ridge_length_mm",
        "ridge_range_mm", "ridges", "ridge_nodes", "bridge_height_mm", "drawn_in_mm",
        "drawn_in_tension_n_per_mm", "drawn_in_hold_n_per_mm", "excess_length_mm", "net", "initial_gap_mm",
        "debulked_mm", "debulked_gap_mm", "post_processed_gap_mm", "energy_mj", "energy_terms_mj", "solve",
    )
)  # fmt: skip
"""The fields of a pocket that come from its net and its minimum."""

_LATER = "_later"


class Later(Generic[Made]):
    """Something that is made when it is first asked for, once for all threads; what it is made from is let go then.

    Examples
    --------
    >>> answer = Later(lambda: print("computing") or 42)
    >>> answer(), answer()
    computing
    (42, 42)
    """

    def __init__(self, make: Callable[[], Made]) -> None:
        self._make: Callable[[], Made] | None = make
        self._made: Made | None = None
        self._guard = Guard()

    def __call__(self) -> Made:
        """Return it, made now if it is not made yet."""
        with self._guard.held():
            if self._make is not None:
                self._made = self._make()
                self._make = None
            return cast(Made, self._made)


class UnsettledPocket(PocketReport):
    """A pocket with its verdict and the figures that gave it; the fields in `PICTURE` are made when one is read.

    What is read so does not depend on when it is read. Everything else stays as the inspection left it, the verdict
    too. A copy, also one by pickle or `dataclasses.replace`, is a plain record.
    """

    @classmethod
    def of(cls, decided: PocketReport, later: Callable[[], PocketReport]) -> UnsettledPocket:
        """Return the pocket with the function that makes its report with net and minimum."""
        made = object.__new__(cls)
        made.__dict__.update(vars(decided))
        made.__dict__[_LATER] = later
        return made

    if not TYPE_CHECKING:  # a type checker would take every name for an attribute

        def __getattribute__(self, name: str) -> Any:
            if name in PICTURE and (later := vars(self).get(_LATER)) is not None:
                return getattr(later(), name)
            return super().__getattribute__(name)

    def as_decided(self) -> PocketReport:
        """Return the plain record of what decided, without net and minimum."""
        return PocketReport(**{name: value for name, value in vars(self).items() if name != _LATER})

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(PocketReport, **vars(self.as_decided())), ()
