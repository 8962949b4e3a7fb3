"""A case of the referee (independent fine simulations): a pocket, a perturbed start or noisy member, and a variant."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pockets import Pocket, all_pockets, spread
from tables import Table

# The variants of the material that both engines can simulate, by the names of the recipe's material. The nominal case
# has an empty name.
MATERIAL: dict[str, dict[str, float]] = {
    "": {},
    "E x 0.5": {"young_mpa": 180.0},
    "E x 2": {"young_mpa": 720.0},
    "mu 0.2": {"friction": 0.2},
    "mu 0.6": {"friction": 0.6},
}


@dataclass(frozen=True, eq=False)
class Case:
    """The case that a row of own.csv or mujoco.csv describes."""

    pocket: Pocket
    member: int  # number from 1, which seeds the perturbation or the noise
    variant: str = ""

    @property
    def key(self) -> tuple[str, int, str]:
        """Return the key that identifies its row."""
        return self.pocket.name, self.member, self.variant

    def __str__(self) -> str:
        """Return the case as text for a line on the screen."""
        return f"{self.pocket.name} {self.member} {self.variant}".rstrip()


def complete(kept: Table, cases: Iterable[Case], run: Callable[[Case], dict[str, object]], good: str) -> None:
    """Compute the missing rows and print each result; `good` names the column that is 1 for a good run, else 0."""
    for case in cases:
        if kept.has(*case.key):
            continue
        row = run(case)
        if row.get("status") != "deadline":  # a faster machine may try again
            kept.add(row)
        print(
            f"{case}: {good if row[good] else 'REFUSED'}, height {row['height_mm']:.3f} mm, gathered "
            f"{row['gathered_mm']:.3f} of {row['fibre_excess_mm']:.3f} mm, {row['cpu_s']:.1f} s",
            flush=True,
        )


def asked(about: str, members: int, most: int) -> list[Case]:
    """Return the cases that the command line asks for: the first member of every pocket, then the second, and so on."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--members", type=int, default=members, help="of each pocket")
    parser.add_argument("--most", type=int, default=most, help="pockets")
    parser.add_argument("--names", nargs="*", help="of pockets; default: small ones all round the limit first")
    options = parser.parse_args()
    named = [p for p in spread(all_pockets()) if not options.names or p.name in options.names]
    return [Case(p, member) for member in range(1, options.members + 1) for p in named[: options.most]]
