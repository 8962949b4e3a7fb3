"""Reports and comparisons of earlier schemas, brought to the present one step by step: old files stay readable.

A step gives each new value what it meant before there was one: None or nothing where it was not looked at. What a step
takes away, and that the verdict of an old record was given by the rules of its time, the record's warnings say.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from debulk._core import InputError

Tree = dict[str, Any]
OLDEST = 1

# By schema, the values that are new in it: in the record itself (""), or in each entry of one of its lists.
_NEW_IN_REPORT: Mapping[int, Mapping[str, Tree]] = {
    3: {"": {"level": None}},
    4: {
        "": {"unseen": [], "wrinkles": [], "trace": None},
        "left_out": {"place_mm": None},
        "pockets": {"excess": None, "promoted": ""},
    },
    5: {
        "pockets": dict.fromkeys(("drawn_in_mm", "drawn_in_tension_n_per_mm", "drawn_in_hold_n_per_mm"))
        | {"ridges": []}
    },
    6: {"pockets": {"half_seen": None}},
    7: {"pockets": {"edge_friction": None}},
    8: {"pockets": {"bridge_section": None}},
    10: {"": {"excess_map": None}},
    11: {"": {"chain": None}},
    13: {
        "": {"runs": None, "crease_probability": None},
        "findings": {"remedy": ""},
        "pockets": {"crease_probability": None, "remedy": ""},
    },
    14: {"": {"shear_map": None}},
}
_NEW_IN_COMPARISON: Mapping[int, Mapping[str, Tree]] = {
    5: {"pockets": {"predicted_ridges_mm": [], "predicted_place_mm": None}},
    12: {
        "": dict.fromkeys(("trace", "report_trace", "report_verdict", "report_sha256")) | {"recipe": {}, "source": {}},
    },
    15: {"pockets": {"measured_peak_range_mm": None}},
    16: {"": {"standing": []}},
}


def migrated(tree: Tree, schema: int, present: int) -> Tree:
    """Bring the JSON of a report or a comparison, without format and schema, from an earlier schema to the present."""
    new, steps = (_NEW_IN_REPORT, _REPORT) if "verdict" in tree else (_NEW_IN_COMPARISON, _COMPARISON)
    try:
        for reached in range(schema + 1, present + 1):
            for where, values in new.get(reached, {}).items():
                for entry in tree[where] if where else (tree,):
                    _add(entry, **copy.deepcopy(values))
            if reached in steps:
                steps[reached](tree)
        tree["warnings"] = [*tree["warnings"], _note(tree, schema, present)]
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(f"not a record of schema {schema}: {type(error).__name__}: {error}") from None
    return tree


def _note(tree: Tree, schema: int, present: int) -> str:
    return (
        f"debulk {tree['version']} wrote this record in schema {schema}; it is shown in schema {present}. Its verdicts "
        "are those of the rules of its time, and are not checked against its figures; what newer records have in "
        "addition was not looked at"
    )


def _add(tree: Tree, **values: Any) -> None:
    for name, value in values.items():
        tree.setdefault(name, value)


def _excesses(report: Tree) -> Iterator[Tree]:
    return (pocket["excess"] for pocket in report["pockets"] if pocket["excess"] is not None)


def _to_2(report: Tree) -> None:
    recipe = report["recipe"]
    recipe.get("loads", {}).pop("vacuum", None)
    if (edge_mm := recipe.get("segmentation", {}).pop("edge_tol_mm", None)) is not None:
        recipe.setdefault("net", {})["free_edge_mm"] = edge_mm


def _to_4(report: Tree) -> None:
    for pocket in report["pockets"]:
        decided = pocket["rms_mm"] is not None and pocket["verdict"] in ("cease", "crease")
        _add(pocket, decided_by="paper" if decided else "", paper_verdict=pocket["verdict"] if decided else None)
    if report["recipe"]:
        _add(report["recipe"].setdefault("verdict", {}), criterion="paper")
        _add(report["recipe"].setdefault("solve", {}), when="always")


def _to_5(report: Tree) -> None:
    if report["level"] is not None:
        _add(report["level"], loose_share=0.0)
    if report["recipe"]:
        _add(report["recipe"].setdefault("loads", {}), lumping="paper")


def _to_7(report: Tree) -> None:
    for excess in _excesses(report):
        _add(excess, missed_mm=0.0)


def _to_9(report: Tree) -> None:
    trace = report["trace"] or {}
    for name in ("scan", "reference", "mask"):
        if trace.get(name) is not None:
            _add(trace[name], xxh3=None)


def _to_10(report: Tree) -> None:
    for excess in _excesses(report):
        # The figures of the two nets that the excess was extrapolated from; the excess itself stays.
        for name in ("at_spacing_mm", "at_half_mm", "noise_bias_mm", "spacing_error_mm"):
            del excess[name]
        _add(excess, alone_mm=excess["range_mm"][1], fibre=None, direction_deg=None, from_mm=None, to_mm=None)


def _to_11(report: Tree) -> None:
    finding = {"measured": None, "limit": None, "unit": "", "place_mm": None, "pocket": None}
    only = {"check": "not recorded", "at_best": report["verdict"], "reason": report["reason"], **finding}
    _add(report, findings=[only])


def _to_14(record: Tree) -> None:
    for trace in (record["trace"], record.get("report_trace")):
        if trace is not None:
            _add(trace, nominal_angles_map=None)


_REPORT: dict[int, Callable[[Tree], None]] = {
    2: _to_2,
    4: _to_4,
    5: _to_5,
    7: _to_7,
    9: _to_9,
    10: _to_10,
    11: _to_11,
    14: _to_14,
}
_COMPARISON: dict[int, Callable[[Tree], None]] = {
    14: _to_14,
}
