"""Reports and comparisons of earlier schemas, brought to the present one step by step: old files stay readable.

A step gives each new value what it meant before there was one: None or nothing where it was not looked at. What a step
takes away, and that the verdict of an old record was given by the rules of its time, the record's warnings say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from debulk._core import InputError

Tree = dict[str, Any]
OLDEST = 1


def migrated(tree: Tree, schema: int, present: int) -> Tree:
    """Bring the JSON of a report or a comparison, without format and schema, from an earlier schema to the present."""
    try:
        for reached in range(schema + 1, present + 1):
            (_REPORT if "verdict" in tree else _COMPARISON).get(reached, _nothing)(tree)
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


def _nothing(tree: Tree) -> None:
    """Change nothing."""


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


def _to_3(report: Tree) -> None:
    _add(report, level=None)


def _to_4(report: Tree) -> None:
    _add(report, unseen=[], wrinkles=[], trace=None)
    for entry in report["left_out"]:
        _add(entry, place_mm=None)
    for pocket in report["pockets"]:
        decided = pocket["rms_mm"] is not None and pocket["verdict"] in ("cease", "crease")
        _add(pocket, decided_by="paper" if decided else "", excess=None, promoted="")
        _add(pocket, paper_verdict=pocket["verdict"] if decided else None)
    if report["recipe"]:
        _add(report["recipe"].setdefault("verdict", {}), criterion="paper")
        _add(report["recipe"].setdefault("solve", {}), when="always")


def _to_5(report: Tree) -> None:
    if report["level"] is not None:
        _add(report["level"], loose_share=0.0)
    for pocket in report["pockets"]:
        _add(pocket, ridges=[], drawn_in_mm=None, drawn_in_tension_n_per_mm=None, drawn_in_hold_n_per_mm=None)
    if report["recipe"]:
        _add(report["recipe"].setdefault("loads", {}), lumping="paper")


def _ridges_of_comparison(comparison: Tree) -> None:
    for pocket in comparison["pockets"]:
        _add(pocket, predicted_ridges_mm=[], predicted_place_mm=None)


def _trace_of_comparison(comparison: Tree) -> None:
    _add(comparison, trace=None, report_trace=None, report_verdict=None, report_sha256=None, recipe={}, source={})


def _to_6(report: Tree) -> None:
    for pocket in report["pockets"]:
        _add(pocket, half_seen=None)


def _to_7(report: Tree) -> None:
    for pocket in report["pockets"]:
        _add(pocket, edge_friction=None)
    for excess in _excesses(report):
        _add(excess, missed_mm=0.0)


def _to_8(report: Tree) -> None:
    for pocket in report["pockets"]:
        _add(pocket, bridge_section=None)


def _to_9(report: Tree) -> None:
    trace = report["trace"] or {}
    for name in ("scan", "reference", "mask"):
        if trace.get(name) is not None:
            _add(trace[name], xxh3=None)


def _to_10(report: Tree) -> None:
    _add(report, excess_map=None)
    for excess in _excesses(report):
        # The figures of the two nets that the excess was extrapolated from; the excess itself stays.
        for name in ("at_spacing_mm", "at_half_mm", "noise_bias_mm", "spacing_error_mm"):
            del excess[name]
        _add(excess, alone_mm=excess["range_mm"][1], fibre=None, direction_deg=None, from_mm=None, to_mm=None)


def _to_11(report: Tree) -> None:
    finding = {"measured": None, "limit": None, "unit": "", "place_mm": None, "pocket": None}
    only = {"check": "not recorded", "at_best": report["verdict"], "reason": report["reason"], **finding}
    _add(report, findings=[only], chain=None)


def _to_13(report: Tree) -> None:
    _add(report, runs=None, crease_probability=None)
    for pocket in report["pockets"]:
        _add(pocket, crease_probability=None)
    for asking in (*report["findings"], *report["pockets"]):
        _add(asking, remedy="")


def _to_14(record: Tree) -> None:
    if "verdict" in record:
        _add(record, shear_map=None)
    for trace in (record["trace"], record.get("report_trace")):
        if trace is not None:
            _add(trace, nominal_angles_map=None)


_REPORT: dict[int, Callable[[Tree], None]] = {
    2: _to_2,
    3: _to_3,
    4: _to_4,
    5: _to_5,
    6: _to_6,
    7: _to_7,
    8: _to_8,
    9: _to_9,
    10: _to_10,
    11: _to_11,
    13: _to_13,
    14: _to_14,
}
_COMPARISON: dict[int, Callable[[Tree], None]] = {
    5: _ridges_of_comparison,
    12: _trace_of_comparison,
    14: _to_14,
}
