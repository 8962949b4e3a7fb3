"""Layups as AQDEF (.dfq), the Q-DAS ASCII transfer format that quality software reads: keys, then a line per layup."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from debulk._core import InputError
from debulk.history.rows import LayupRow

_NEXT_FIELD, _NEXT_CHARACTERISTIC = "\x14", "\x0f"
_VALID, _MISSING = 0, 255  # attributes of a value, K0002


class Layup(NamedTuple):
    """A layup, and the highest ridge that any of its pockets may have, mm; None: no ridge is known."""

    row: LayupRow
    ridge_mm: float | None


class _Characteristic(NamedTuple):
    name: str
    unit: str
    digits: int
    most: float | None = None


def write(path: Path, layups: Sequence[Layup], limit_mm: float | None) -> None:
    """Write layups of one part, in the order of their records; the limit becomes the upper one of the specification."""
    parts = sorted({layup.row.part for layup in layups})
    if len(parts) != 1:
        got = ", ".join(map(repr, parts[:4])) or "no layup"
        raise InputError(f"a .dfq: expected layups of one part, got {got}; choose one (--part)")
    kinds = [
        _Characteristic("largest ridge", "mm", 3, limit_mm),
        _Characteristic("pockets", "", 0),
        _Characteristic("pockets CREASE", "", 0),
        _Characteristic("pockets UNDECIDED or INVALID", "", 0),
        _Characteristic("coverage", "%", 2),
        _Characteristic("noise", "mm", 4),
        _Characteristic("level", "mm", 4),
        _Characteristic("tilt", "deg", 4),
        _Characteristic("bow", "mm", 3),
    ]
    lines = [f"K0100 {len(kinds)}", f"K1001 {_text(parts[0]) or 'layup'}", "K1002 layups inspected by debulk"]
    for number, kind in enumerate(kinds, start=1):
        keys = {"K2001": str(number), "K2002": kind.name, "K2022": str(kind.digits), "K2142": kind.unit}
        if kind.most is not None:
            keys["K2111"] = f"{kind.most:.{kind.digits}f}"
        lines += [f"{key}/{number} {value}" for key, value in keys.items() if value]
    lines += (_line(layup, kinds) for layup in layups)
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8-sig", newline="")


def _line(layup: Layup, kinds: Sequence[_Characteristic]) -> str:
    row = layup.row
    values = (
        layup.ridge_mm, row.pockets, row.creasing, row.undecided + row.unjudged,
        None if row.coverage is None else 100 * row.coverage, row.noise_mm, row.level_mm, row.tilt_deg, row.bow_mm,
    )  # fmt: skip
    when = f"{datetime.fromisoformat(row.time_utc):%d.%m.%Y/%H:%M:%S}" if row.time_utc else ""
    ply = f"#{_text(row.ply)}" if row.ply else ""
    fields = []
    for value, kind in zip(values, kinds, strict=True):
        known = value is not None and math.isfinite(value)
        number = f"{value:.{kind.digits}f}" if known else "0"
        fields.append(_NEXT_FIELD.join((number, str(_VALID if known else _MISSING), when, "", ply)))
    return _NEXT_CHARACTERISTIC.join(fields)


def _text(text: str) -> str:
    """Return a text of one line without what separates fields."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
