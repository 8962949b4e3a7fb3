"""The directive `recipe-reference`: a table of each section of the recipe, made from the model itself."""

from __future__ import annotations

import json
from typing import Any, Literal, get_args, get_origin

from docutils import nodes
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from debulk.recipe import Recipe, Section

SIGNS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


def reference() -> str:
    """Every section with its settings, as Markdown."""
    lines: list[str] = []
    for name in Recipe.model_fields:
        section = type(getattr(Recipe(), name))
        lines += [f"## {name}", "", (section.__doc__ or "").strip(), "", *table(section), ""]
    return "\n".join(lines)


def table(section: type[Section]) -> list[str]:
    """One line a setting."""
    rows = ["| setting | default | may be | |", "|---|---|---|---|"]
    for name, field in section.model_fields.items():
        default = "unset" if field.default is None else f"`{json.dumps(field.default)}`"
        rows.append(f"| `{name}` | {default} | {allowed(field)} | {field.description} |")
    return rows


def allowed(field: FieldInfo) -> str:
    """Kind and bounds of a value in words."""
    kinds = [kind for kind in get_args(field.annotation) or (field.annotation,) if kind is not type(None)]
    if get_origin(field.annotation) is Literal:
        return ", ".join(f"`{json.dumps(value)}`" for value in kinds)
    bounds = [f"{SIGNS[key]} {value:g}" for rule in field.metadata for key, value in bound(rule)]
    words: dict[Any, str] = {int: "whole number", float: "number", bool: "`true`, `false`", str: "text"}
    return " ".join([words[kinds[0]], ", ".join(bounds)]).strip()


def bound(rule: object) -> list[tuple[str, float]]:
    """Read the limit that a rule of pydantic's sets, if it is one."""
    return [(key, getattr(rule, key)) for key in SIGNS if hasattr(rule, key)]


class RecipeReference(SphinxDirective):
    """Puts the reference into the page."""

    def run(self) -> list[nodes.Node]:
        """Read the Markdown where the directive stands, headings and all."""
        return self.parse_text_to_nodes(reference(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("recipe-reference", RecipeReference)
    return {"parallel_read_safe": True}
