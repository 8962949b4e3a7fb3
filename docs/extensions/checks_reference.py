"""The directive `checks-reference`: a section for each check, made from the list that the inspection runs."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from debulk.results.check_texts import CHECK_TEXTS, CheckText


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
        "",
    ]


class ChecksReference(SphinxDirective):
    """Puts the reference into the page."""

    def run(self) -> list[nodes.Node]:
        """Read the Markdown where the directive stands, headings and all."""
        return self.parse_text_to_nodes(reference(), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("checks-reference", ChecksReference)
    return {"parallel_read_safe": True}
