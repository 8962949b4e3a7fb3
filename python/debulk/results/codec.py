"""The report as JSON, schema 15.

Records are objects and arrays are nested lists. Numbers that JSON does not have are the strings "NaN", "Infinity" and
"-Infinity". Only grids, such as the height map, are packed: base64 of zlib of little-endian float32, or float64 if they
are of that type, row by row. Every number is restored to the last bit.
The declared types of the dataclasses are the schema: the codec reads them, so that it cannot differ from them.
"""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import sys
import typing
import zlib
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any, TypeVar, cast

import numpy as np

from debulk._core import InputError
from debulk.grid import Grid
from debulk.results.migrations import OLDEST, migrated
from debulk.results.record import hints_of, stored_as, without_none

SCHEMA = 16
_ODD = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}
_MAX_CELLS = 1 << 30
_ENCODINGS = {size: f"base64(zlib(float{8 * size} little-endian, row by row))" for size in (4, 8)}
RecordT = TypeVar("RecordT")


def encode(record: Any, format_name: str) -> dict[str, Any]:
    """Return any record of the results as JSON types, with its format and schema named."""
    return {"format": format_name, "schema": SCHEMA, **_encode(record)}


def dumps(record: Any, format_name: str) -> str:
    """Return any record of the results as JSON text that names its format and schema."""
    return json.dumps(encode(record, format_name), allow_nan=False, ensure_ascii=False, separators=(",", ":")) + "\n"


def loads(
    kind: type[RecordT], data: bytes, format_name: str, check: Callable[[RecordT], None] = lambda record: None
) -> RecordT:
    """Read what `dumps` wrote, in this schema or an earlier one; a record of this schema is also checked.

    The rules of an earlier schema's time may have been others, so its verdicts are not checked against its figures.
    """
    what = format_name.removeprefix("debulk ")
    try:
        tree = json.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"not a {what}: byte {error.start} is not UTF-8") from None
    except json.JSONDecodeError as error:
        cut = " (the file was cut off?)" if error.pos >= len(error.doc.rstrip()) - 1 else ""
        raise InputError(f"not valid JSON: line {error.lineno}, column {error.colno}: {error.msg}{cut}") from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"not a {what}: {error}") from None
    if not isinstance(tree, dict) or tree.get("format") != format_name:
        raise InputError(f'not a {what}: expected "format": "{format_name}"')
    schema = tree.get("schema")
    if type(schema) is not int or not OLDEST <= schema <= SCHEMA:
        remedy = "; install a newer debulk" if type(schema) is int and schema > SCHEMA else ""
        raise InputError(f"schema: expected {OLDEST} to {SCHEMA}, got {json.dumps(schema)[:40]}{remedy}")
    values = {k: v for k, v in tree.items() if k not in ("format", "schema")}
    if schema < SCHEMA:
        return cast(RecordT, _decode(kind, migrated(values, schema, SCHEMA), ""))
    record = cast(RecordT, _decode(kind, values, ""))
    check(record)
    return record


def _encode(value: Any) -> Any:
    if isinstance(value, StrEnum):
        return value.value
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else "NaN" if math.isnan(value) else f"{'-' * (value < 0)}Infinity"
    if isinstance(value, Grid):
        return _encode_grid(value)
    if isinstance(value, np.generic):
        return _encode(value.item())
    if isinstance(value, np.ndarray):
        listed = value.tolist()
        return listed if value.dtype.kind != "f" or np.isfinite(value).all() else _encode(listed)
    if dataclasses.is_dataclass(value):
        return {entry.name: _encode(getattr(value, entry.name)) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _encode(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_encode(item) for item in value]
    raise InputError(f"a report cannot hold a {type(value).__name__}")


def _encode_grid(grid: Grid) -> dict[str, Any]:
    values = np.ascontiguousarray(grid.values, dtype="<f8" if grid.values.dtype == np.float64 else "<f4")
    return {
        "origin_mm": _encode(np.asarray(grid.origin_mm, dtype=np.float64)),
        "spacing_mm": _encode(float(grid.spacing_mm)),
        "shape": list(values.shape),
        "encoding": _ENCODINGS[values.dtype.itemsize],
        "values": base64.b64encode(zlib.compress(values.data, 1)).decode("ascii"),
    }


def _decode(hint: Any, value: Any, name: str) -> Any:
    """Build what the type hint asks for, or report where the JSON tree differs from it."""
    plain = without_none(hint)
    if value is None and plain is not hint:
        return None
    origin, arguments = typing.get_origin(plain), typing.get_args(plain)
    if plain is Any:
        return _decode_any(value)
    if plain is Grid:
        return _decode_grid(value, name)
    if dataclasses.is_dataclass(plain):
        return _decode_record(cast(type, plain), value, name)
    if isinstance(plain, type) and issubclass(plain, StrEnum):
        names = [member.value for member in plain]
        return plain(_require(value, name, lambda v: v in names, f"one of {', '.join(names)}"))
    if (stored := stored_as(plain)) is not None:
        return _decode_array(stored.dtype, value, name, stored.shape)
    if origin is tuple:
        _require(value, name, lambda v: isinstance(v, list), "a list")
        if arguments[-1] is Ellipsis:
            return tuple(_decode(arguments[0], item, f"{name}[{i}]") for i, item in enumerate(value))
        _require(value, name, lambda v: len(v) == len(arguments), f"{len(arguments)} values")
        parts = enumerate(zip(arguments, value, strict=True))
        return tuple(_decode(part, item, f"{name}[{i}]") for i, (part, item) in parts)
    if origin is dict:
        _require(value, name, lambda v: isinstance(v, dict), "an object")
        return {key: _decode(arguments[1], item, f"{name}.{key}") for key, item in value.items()}
    if plain is float:
        if isinstance(value, str) and value in _ODD:
            return _ODD[value]
        return float(_require(value, name, _is_number, "a number"))
    if plain is int:
        return _require(value, name, lambda v: isinstance(v, int) and not isinstance(v, bool), "a whole number")
    return _require(value, name, lambda v: isinstance(v, plain), {bool: "true or false", str: "text"}[plain])


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _require(value: Any, name: str, accept: Callable[[Any], bool], expected: str) -> Any:
    if not accept(value):
        raise InputError(f"{name}: expected {expected}, got {json.dumps(value)[:40]}")
    return value


def _decode_any(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _decode_any(item) for key, item in value.items()}
    return [_decode_any(item) for item in value] if isinstance(value, list) else value


def _decode_record(kind: type, value: Any, name: str) -> Any:
    _require(value, name or "report", lambda v: isinstance(v, dict), "an object")
    hints, prefix = hints_of(kind), f"{name}." if name else ""
    for key in value:
        if key not in hints:
            raise InputError(f"{prefix}{key}: not a value of schema {SCHEMA}")
    for key in hints:
        if key not in value:
            raise InputError(f"{prefix}{key}: is missing")
    parts = {key: _decode(hint, value[key], prefix + key) for key, hint in hints.items()}
    try:
        return kind(**parts)
    except InputError as error:
        raise InputError(f"{prefix}{error}") from None


def _decode_array(dtype: np.dtype[Any], value: Any, name: str, shape: tuple[int | None, ...]) -> Any:
    _require(value, name, lambda v: isinstance(v, list), "a list")
    try:
        flat = np.array(value, dtype=object)
        accepted = (int, float) if dtype.kind == "f" else (bool,) if dtype.kind == "b" else (int,)
        numbers: list[Any] = [_ODD.get(v, v) if isinstance(v, str) and dtype.kind == "f" else v for v in flat.ravel()]
        for number in numbers:
            known = isinstance(number, accepted) and (dtype.kind == "b" or not isinstance(number, bool))
            if not known or (dtype.kind in "iu" and not np.iinfo(dtype).min <= number <= np.iinfo(dtype).max):
                raise InputError(f"{name}: expected {dtype} values, got {json.dumps(number)[:40]}")
        if not numbers:  # an empty list looks the same for the shapes (0, 3) and (0,)
            return np.empty([length or 0 for length in shape], dtype=dtype)
        return np.array(numbers, dtype=dtype).reshape(flat.shape)
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"{name}: expected a regular array of {dtype}: {error}") from None


def _decode_grid(value: Any, name: str) -> Grid:
    _require(value, name, lambda v: isinstance(v, dict), "an object")
    for key in ("origin_mm", "spacing_mm", "shape", "encoding", "values"):
        if key not in value:
            raise InputError(f"{name}.{key}: is missing")
    origin = _decode_array(np.dtype(np.float64), value["origin_mm"], f"{name}.origin_mm", (2,))
    spacing = _decode(float, value["spacing_mm"], f"{name}.spacing_mm")
    shape, text = value["shape"], value["values"]
    lengths = isinstance(shape, list) and all(type(n) is int and 0 < n <= _MAX_CELLS for n in shape)
    good = lengths and len(shape) in (2, 3) and math.prod(shape) <= _MAX_CELLS
    _require(shape, f"{name}.shape", lambda _: good, "two or three lengths")
    _require(text, f"{name}.values", lambda v: isinstance(v, str), "base64 text")
    if origin.shape != (2,) or not spacing > 0:
        raise InputError(f"{name}: expected origin_mm (2,) and spacing_mm > 0, got {origin.shape} and {spacing}")
    encodings = {text: size for size, text in _ENCODINGS.items()}
    expected = f"one of {', '.join(encodings)}"
    size = encodings[_require(value["encoding"], f"{name}.encoding", lambda v: v in list(encodings), expected)]
    need = size * math.prod(shape)
    try:
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(base64.b64decode(text, validate=True), need + 1)  # no more than was declared
    except (ValueError, zlib.error) as error:
        raise InputError(f"{name}.values: {error}") from None
    if len(data) != need:
        raise InputError(f"{name}.values: expected {need} bytes for the shape {shape}, got {len(data)}")
    return Grid(np.frombuffer(data, dtype=f"<f{size}").astype(f"f{size}").reshape(shape), origin, spacing)
