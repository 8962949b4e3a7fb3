"""Whether the recipe is one that the cell's owner approved."""

from __future__ import annotations

from collections.abc import Sequence

from debulk.recipe import Recipe
from debulk.results.approval import Approval, recipe_hash
from debulk.results.finding import Finding
from debulk.verdict import Verdict


def findings(approved: Sequence[Approval] | None, recipe: Recipe) -> list[Finding]:
    """Return UNDECIDED for a recipe that is none of the approved ones; nothing if no approval is asked for."""
    own = recipe_hash(recipe.model_dump())
    if approved is None or any(one.recipe_sha256 == own for one in approved):
        return []
    reason = f"the recipe, SHA-256 {own[:12]}, is none of the {len(approved)} approved: use one, or have it approved"
    return [Finding("approval", Verdict.UNDECIDED, reason)]
