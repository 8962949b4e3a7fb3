"""The directive `checks-reference`: a section for each check, made from the list that the inspection runs."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from debulk.inspection.checks.listed import CHECKS
from debulk.results.check_texts import CHECK_TEXTS, CheckText

_LIMITS = {check.name: check.limits for check in CHECKS}


def reference() -> str:
    """Every check in the order in which they speak, as Markdown."""
    return "\n".join(line for check in CHECK_TEXTS for line in section(check))


def section(check: CheckText) -> list[str]:
    """One check: what is wrong, what is looked at, the limit, and what to do."""
    verdicts = " or ".join(one.name for one in check.at_best if one is not None)
    return [
        f"(check-{check.name.replace('_', '-')})=",
        f"## {check.title}",
        "",
        f"`{check.name}`, {verdicts + ' at best' if verdicts else 'only mentioned'}",
        "",
        f"* **Looks at** {check.sees}.",
        f"* **Limit**: {check.limit}.",
        f"* **Do**: {check.remedy}.",
        *(line for limits in _LIMITS[check.name] for line in thresholds(limits)),
        "",
    ]


def thresholds(limits: Any) -> Iterator[str]:
    """Yield what thresholds are of, and for each its name, its value and the comment that it has in the source."""
    yield f"* **Thresholds**: {inspect.cleandoc(limits.__doc__)}"
    source = inspect.getsource(type(limits)).split('"""')[2]
    said = ""
    for line in source.splitlines():
        before, _, comment = line.partition("#")
        said = f"{said} {comment.strip()}".strip()
        if name := re.match(r"\s*(\w+):", before):
            yield f"  * `{name[1]} = {getattr(limits, name[1])!r}`{f': {said}' if said else ''}"
            said = ""


class ChecksReference(SphinxDirective):
    """Puts the reference into the page."""

    def run(self) -> list[nodes.Node]:
        """Read the Markdown where the directive stands, headings and all."""
        return self.parse_text_to_nodes(reference(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("checks-reference", ChecksReference)
    return {"parallel_read_safe": True}
