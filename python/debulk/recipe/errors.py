"""Error messages for a wrong recipe, worded so that its author can correct it."""

from __future__ import annotations

import difflib
import math
import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError


class Wrong(NamedTuple):
    """One wrong value: its dotted name and what is the matter with it."""

    name: str
    text: str


def message(what: str, wrong: list[Wrong]) -> str:
    """Put all wrong values into one message, one per line where there are several."""
    lines = [f"{entry.name}: {entry.text}" for entry in wrong]
    if len(lines) == 1:
        return lines[0]
    return "\n  ".join([f"{len(lines)} wrong values in the {what.lower()}:", *lines])


def known_names(model: type[BaseModel], prefix: str = "") -> list[str]:
    """Return all dotted names of a model's values, sections included."""
    names = []
    for name, field in model.model_fields.items():
        names.append(prefix + name)
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            names += known_names(field.annotation, f"{prefix}{name}.")
    return names


def wrong_values(model: type[BaseModel], error: ValidationError) -> list[Wrong]:
    """Translate pydantic's errors into dotted names, each with what was expected and what was given."""
    names = known_names(model)
    wrong: dict[str, Wrong] = {}
    for entry in error.errors(include_url=False, include_context=True):
        name = ".".join(str(part) for part in entry["loc"])
        if entry["type"] == "extra_forbidden":
            wrong.setdefault(name, Wrong(name, _unknown(name, names)))
        else:
            text = f"expected {_expected(entry['type'], entry.get('ctx', {}))}, got {shown(entry['input'])}"
            wrong.setdefault(name, Wrong(name, text))
    return list(wrong.values())


# Settings of earlier versions that are gone, and what to write instead.
_GONE = {
    "segmentation.edge_tol_mm": "it is called net.free_edge_mm now",
    "loads.vacuum": "see loads.pressure_direction",
}


def _unknown(name: str, names: list[str]) -> str:
    """Name the nearest known setting: first by the last part of its name, in any section, then by the whole name."""
    if name in _GONE:
        return f"not a setting any more: {_GONE[name]}"
    last = name.rsplit(".", 1)[-1]
    tails = {known.rsplit(".", 1)[-1]: known for known in reversed(names)}
    near = [tails[tail] for tail in difflib.get_close_matches(last, list(tails), n=1, cutoff=0.75)]
    near = near or difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    return "not a known setting" + (f"; did you mean {near[0]}?" if near else "")


_LIMITS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}
_KINDS = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number of at most 63 bits",
    "model_type": "a table of settings",
    "model_attributes_type": "a table of settings",
    "string_type": "text",
    "string_too_short": "text",
    "string_unicode": "text",
    "string_too_long": "a shorter text",
    "string_pattern_mismatch": "letters, digits, dots, - and _",
    "tuple_type": "a list of numbers",
    "missing": "a value",
    "invalid_key": "names that are text",
}


def _expected(kind: str, context: Mapping[str, Any]) -> str:
    if kind in _LIMITS:
        key, words = _LIMITS[kind]
        return f"a number {words} {context[key]:g}"
    if kind == "too_long":
        return f"at most {context['max_length']} values"
    if kind == "literal_error":
        return str(context["expected"])
    return _KINDS.get(kind, kind.replace("_", " "))


def shown(value: Any) -> str:
    """Return a value as it would be written, at most 60 characters of it, on one line."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


# Height above the laid ply. A bump this high makes a ridge of the limit's height only if it is narrower than about
# 10 mm.
_LOWEST_SURE_MM = 1.7


def impossible(values: Mapping[str, Mapping[str, Any]], unusable: set[str]) -> list[Wrong]:
    """Check all settings against each other; those of dotted names that are wrong already are left out."""
    wrong: list[Wrong] = []

    def usable(name: str) -> float | None:
        section, key = name.split(".")
        value = values[section][key]
        finite = not {name, section} & unusable and isinstance(value, (int, float)) and abs(value) <= sys.float_info.max
        return value if finite else None

    def check_more(name: str, limit: float, why: str) -> None:
        if (value := usable(name)) is not None and not value > limit:
            wrong.append(Wrong(name, f"expected more than {limit:g} ({why}), got {shown(value)}"))

    def check_most(name: str, most: float, why: str) -> None:
        if (value := usable(name)) is not None and value > most:
            wrong.append(Wrong(name, f"expected at most {most:.3g} ({why}), got {shown(value)}"))

    area, cut, mold = "segmentation.area_tol_mm2", "segmentation.cut_height_mm", "patch.mold_tol_mm"
    thickness, bulk = "material.thickness_mm", "material.bulk_factor"
    if (tolerance := usable(area) or 0.0) > 0:
        across = 2 * math.sqrt(tolerance / math.pi)
        for name, most, why in (
            ("clean.grid_spacing_mm", math.sqrt(tolerance) / 4, "a pocket of the tolerance needs four points across"),
            ("patch.smooth_mm", across, "a wider window smooths a pocket of the tolerance away"),
            ("clean.max_hole_mm", 2 * across, "a wider hole can hold a pocket of the tolerance with its foot"),
        ):
            check_most(name, most, f"{why}, {area}")
    thick_mm, factor, touches_mm = usable(thickness), usable(bulk), usable(mold)
    if thick_mm is not None:
        check_more(cut, thick_mm, f"a ply that lies well stands this high, {thickness}")
        why = "what stands below half of it is not looked at, and a bump there can crease"
        check_most(cut, 2 * (thick_mm + _LOWEST_SURE_MM), f"{why}, {thickness}")
    if touches_mm is not None:
        check_more(cut, touches_mm, f"the ply touches the mold up to here, {mold}")
    if thick_mm is not None and factor is not None:
        for name in ("verdict.max_rms_mm", "verdict.max_ridge_mm"):
            check_more(name, thick_mm / factor, f"a ply without any wrinkle has this much, {thickness}/bulk_factor")
    return wrong
