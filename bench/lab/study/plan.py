"""The settings that the study varies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

from debulk._core import InputError
from debulk.recipe import Recipe
from lab.study.runs import Setting

AS_INSPECTED = "as inspected"


@dataclass(frozen=True)
class Plan:
    """One setting at a time differs from the recipe's; methods are compared at several tolerances with one start."""

    layups: tuple[int, ...] = tuple(range(110, 120))  # windows and margins were chosen on 0 to 19
    pixels: tuple[int, int] = (1280, 960)
    pockets: int = 14  # per layup, the largest ones
    node_targets: tuple[int, ...] = (50, 75, 100, 150, 200, 300)
    tolerances: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    starts: tuple[int, ...] = (1, 2, 3, 4, 6, 8, 16)  # for every pocket
    most_starts: tuple[int, ...] = (8, 12, 16, 24)  # for a pocket close to a limit
    stiffnesses: tuple[float, ...] = (1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10)
    method_tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8)
    gradient_tolerances: tuple[float, ...] = (1e-4, 1e-5)  # for NLopt, which has no second derivatives to get further
    amplitudes: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2)
    reference_starts: int = 36  # per size of perturbation, in addition to the deterministic one
    other_sizes_starts: int = 6  # the same for other sizes of net, with the middle perturbation
    heavy_layups: int = 4  # number of layups also used for other sizes of net and other methods, most of the work
    deadline_s: float = 120.0  # per minimisation; it fails if it takes longer

    @classmethod
    def quick(cls) -> Self:
        """Return a plan that takes seconds."""
        return cls(
            layups=(0,),
            pixels=(480, 360),
            pockets=4,
            node_targets=(50, 100),
            tolerances=(1e-4, 1e-8),
            starts=(1, 3),
            most_starts=(Recipe().solve.most_starts, 16),  # the table of layups shows the recipe's rule
            stiffnesses=(1e4, 1e8),
            method_tolerances=(1e-6, 1e-8),
            gradient_tolerances=(1e-4,),
            amplitudes=(0.02, 0.1),
            reference_starts=4,
            other_sizes_starts=2,
            deadline_s=5.0,
        )

    def with_layups(self, layups: Iterable[int]) -> Self:
        """Return the plan for other layups."""
        chosen = tuple(int(seed) for seed in layups)
        if not chosen:
            raise InputError("layups: expected at least one seed, but got none")
        return replace(self, layups=chosen)


def settings(plan: Plan, methods: list[str], recipe: Recipe | None = None) -> list[Setting]:
    """All settings of a plan, sweep by sweep."""
    recipe = recipe or Recipe()
    default = Setting(
        sweep="",
        label="",
        method="interior_point",
        starts=recipe.solve.starts,
        most_starts=recipe.solve.most_starts,
        tolerance=recipe.solve.tolerance,
        stiffness=recipe.solve.stiffness,
        node_target=recipe.net.node_target,
    )
    every = replace(default, as_inspected=False)
    return [
        *(replace(default, sweep="nodes", label=f"{n}", node_target=n) for n in plan.node_targets),
        *(replace(default, sweep="tolerance", label=f"{v:.0e}", tolerance=v) for v in plan.tolerances),
        replace(default, sweep="starts", label=AS_INSPECTED),
        *(replace(every, sweep="starts", label=f"{n}", starts=n, most_starts=n) for n in plan.starts),
        *(replace(every, sweep="starts", label=f"{every.starts} to {n}", most_starts=n) for n in plan.most_starts),
        *(replace(default, sweep="stiffness", label=f"{v:.0e}", stiffness=v) for v in plan.stiffnesses),
        *(
            replace(every, sweep="method", label=f"{m} {v:.0e}", method=m, tolerance=v, starts=1, most_starts=1)
            for m in methods
            for v in (plan.gradient_tolerances if m == "nlopt" else plan.method_tolerances)
        ),
    ]
