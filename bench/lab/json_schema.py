"""The JSON Schema of reports and comparisons, made of the dataclasses that the codec reads, so that it cannot differ.

``python -m lab.json_schema FOLDER`` writes both files; those of this version lie in `debulk/results/schema`.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import typing
from enum import StrEnum
from pathlib import Path
from typing import Any

from debulk.grid import Grid
from debulk.results import comparison, report
from debulk.results.codec import SCHEMA
from debulk.results.record import Stored, hints_of, stored_as, without_none

Tree = dict[str, Any]
_DRAFT = "https://json-schema.org/draft/2020-12/schema"
_NUMBER: Tree = {"anyOf": [{"type": "number"}, {"enum": ["NaN", "Infinity", "-Infinity"]}]}
_GRID: Tree = {
    "type": "object",
    "description": "values at origin_mm + spacing_mm (i, j), packed as `encoding` says",
    "properties": {
        "origin_mm": {"type": "array", "items": {"$ref": "#/$defs/number"}, "minItems": 2, "maxItems": 2},
        "spacing_mm": {"type": "number", "exclusiveMinimum": 0},
        "shape": {"type": "array", "items": {"type": "integer", "minimum": 1}, "minItems": 2, "maxItems": 3},
        "encoding": {"type": "string"},
        "values": {"type": "string", "contentEncoding": "base64"},
    },
    "required": ["origin_mm", "spacing_mm", "shape", "encoding", "values"],
}
RECORDS: dict[str, tuple[type, str]] = {
    "report": (report.ReportData, report.FORMAT),
    "comparison": (comparison.ComparisonData, comparison.FORMAT),
}


def json_schema(what: str) -> Tree:
    """Return the JSON Schema, draft 2020-12, of a record as `save` writes it."""
    kind, format_name = RECORDS[what]
    defined: Tree = {"number": _NUMBER}
    top = _record(kind, defined)
    named = {"format": {"const": format_name}, "schema": {"const": SCHEMA}}
    return {
        "$schema": _DRAFT,
        "title": f"{format_name}, schema {SCHEMA}",
        **top,
        "properties": {**named, **top["properties"]},
        "required": [*named, *top["required"]],
        "$defs": defined,
    }


def _record(kind: type, defined: Tree) -> Tree:
    values = {name: _value(hint, defined) for name, hint in hints_of(kind).items()}
    return {"type": "object", "properties": values, "required": list(values), "additionalProperties": False}


def _value(hint: Any, defined: Tree) -> Tree:
    plain = without_none(hint)
    if plain is not hint:
        return {"anyOf": [_value(plain, defined), {"type": "null"}]}
    if plain is Any:
        return {}
    if (stored := stored_as(plain)) is not None:
        return _array(stored)
    if dataclasses.is_dataclass(plain):
        kind = typing.cast(type, plain)
        if kind.__name__ not in defined:
            defined[kind.__name__] = _GRID if kind is Grid else _record(kind, defined)
        return {"$ref": f"#/$defs/{kind.__name__}"}
    if isinstance(plain, type) and issubclass(plain, StrEnum):
        return {"enum": [member.value for member in plain]}
    origin, arguments = typing.get_origin(plain), typing.get_args(plain)
    if origin is dict:
        return {"type": "object", "additionalProperties": _value(arguments[1], defined)}
    if origin is tuple:
        item = _value(arguments[0], defined)
        ends = {} if arguments[-1] is Ellipsis else {"minItems": len(arguments), "maxItems": len(arguments)}
        return {"type": "array", "items": item, **ends}
    if plain is float:
        return {"$ref": "#/$defs/number"}
    return {"type": {int: "integer", bool: "boolean", str: "string"}[plain]}


def _array(stored: Stored) -> Tree:
    kinds: dict[str, Tree] = {"f": {"$ref": "#/$defs/number"}, "b": {"type": "boolean"}}
    tree = kinds.get(stored.dtype.kind, {"type": "integer"})
    for length in reversed(stored.shape):
        ends = {} if length is None else {"minItems": length, "maxItems": length}
        tree = {"type": "array", "items": tree, **ends}
    return tree


def main(folder: Path) -> None:
    """Write both schemas into a folder."""
    for what in RECORDS:
        text = json.dumps(json_schema(what), indent=1) + "\n"
        (folder / f"{what}.schema.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
