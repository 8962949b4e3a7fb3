"""What a request asks for: read strictly, so that a misspelt deadline is an error and no inspection without one."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from debulk.recipe.errors import wrong_values
from debulk.serve.refusal import Refusal

MOST_JSON = 1 << 16
"""Bytes of a request that is JSON."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]
Word = Annotated[str, Field(max_length=200)]
Path = Annotated[str, Field(min_length=1, max_length=4096)]


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, coerce_numbers_to_str=True)


class Inspection(_Asked):
    """A scan to be inspected: `path` of a file on this machine, or `name` of the file that is sent.

    `inspector` names the reference; `angles` is a file of what a sensor measured on this ply; `deadline_s` counts from
    when the request is accepted, None: the service's own; `part` and `ply` are kept in the report.
    """

    path: Path | None = None
    name: Name | None = None
    inspector: Name = "default"
    angles: Path | None = None
    deadline_s: Annotated[float, Field(gt=0, le=3600)] | None = None
    part: Word = ""
    ply: Word = ""


class Reference(_Asked):
    """What a new inspector is prepared from: a reference, and what differs from the service's own inspector."""

    reference: Path
    angles: tuple[float, float] | None = None
    outline: Path | None = None


Kind = TypeVar("Kind", bound=_Asked)


def of_json(kind: type[Kind], body: bytes) -> Kind:
    """Read a request in JSON; a `Refusal` names every wrong value, or says that it is no JSON object."""
    try:
        values = json.loads(body)
    except (ValueError, RecursionError) as error:  # also what is not UTF-8
        raise Refusal(400, f"the request is no JSON: {error}") from None
    if not isinstance(values, dict):
        raise Refusal(400, "the request: expected a JSON object")
    return _checked(kind, values)


def of_query(kind: type[Kind], query: Mapping[str, str]) -> Kind:
    """Read a request from the part of its address behind the question mark; a `Refusal` as for `of_json`."""
    return _checked(kind, dict(query))


def checked_name(name: str) -> str:
    """Return the name of an inspector; refuse one of other characters than letters, digits, dots, - and _."""
    return _checked(Inspection, {"inspector": name}).inspector


def _checked(kind: type[Kind], values: dict[str, Any]) -> Kind:
    try:
        return kind(**values)
    except ValidationError as error:
        wrong = wrong_values(kind, error)
        raise Refusal(400, "; ".join(f"{one.name}: {one.text}" for one in wrong)) from None
    except TypeError as error:  # a keyword that no call can have
        raise Refusal(400, f"the request: {error}") from None
