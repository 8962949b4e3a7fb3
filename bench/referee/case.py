"""One case of the referee: a pocket, one of its perturbed starts or noisy members, and what the physics differs in."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pockets import Pocket, all_pockets, spread
from tables import Table

# What both engines can change, by the names of the recipe's material. The table's own case has no name.
MATERIAL: dict[str, dict[str, float]] = {
    "": {},
    "E x 0.5": {"young_mpa": 180.0},
    "E x 2": {"young_mpa": 720.0},
    "mu 0.2": {"friction": 0.2},
    "mu 0.6": {"friction": 0.6},
}


@dataclass(frozen=True, eq=False)
class Case:
    """What a row of own.csv or mujoco.csv is about."""

    pocket: Pocket
    member: int  # seeds the perturbation or the noise; from 1
    variant: str = ""

    @property
    def key(self) -> tuple[str, int, str]:
        """What tells its row apart."""
        return self.pocket.name, self.member, self.variant

    def __str__(self) -> str:
        """For a line on the screen."""
        return f"{self.pocket.name} {self.member} {self.variant}".rstrip()


def complete(kept: Table, cases: Iterable[Case], run: Callable[[Case], dict[str, object]], good: str) -> None:
    """Make the rows that are missing, and say what came of each; `good` is the column of 1 and 0."""
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
    """Cases that the command line asks for: the first member of every pocket, then the second, and so on."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--members", type=int, default=members, help="of each pocket")
    parser.add_argument("--most", type=int, default=most, help="pockets")
    parser.add_argument("--names", nargs="*", help="of pockets; default: small ones all round the limit first")
    options = parser.parse_args()
    named = [p for p in spread(all_pockets()) if not options.names or p.name in options.names]
    return [Case(p, member) for member in range(1, options.members + 1) for p in named[: options.most]]
