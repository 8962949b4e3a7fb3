"""Carry out the advice on creasing pockets, in fine nets: python bench/rework/trial.py [--pockets 200] [--minutes 60].

Every creasing pocket of virtual layups of several families is found by an inspection, which plans its rework. Its net
is laid with a spacing of 1.5 mm, about four times finer than an inspection's, and minimised as it lies: its worst fold.
Then the ends of its fibres are moved over the mold as the plan says, with all others held, and the lengths are made
true again by the least movement of the nodes. From there the vacuum is drawn once more, now with the moved ends free
against the friction of the ply between them and the ply's edge. A pocket ceases if its worst fold gathers less excess
than a ridge of the limit holds. Each pocket adds a row to trial.csv; trial.txt is written from it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "referee"))

import own  # noqa: E402
import tables  # noqa: E402
from edge import along_fibres  # noqa: E402
from folds import worst_fold  # noqa: E402
from pockets import LIMIT_EXCESS_MM, THICKNESS_MM, Pocket  # noqa: E402

from debulk import Inspector, net, pocket, ridge, scenes, sheet, solve  # noqa: E402
from debulk.recipe import Recipe  # noqa: E402
from debulk.results.rework import rework  # noqa: E402
from debulk.rework import Handling, Move  # noqa: E402
from debulk.verdict import Verdict  # noqa: E402
from lab.third.scene import scene  # noqa: E402
from lab.varied import given_right, varied_layup  # noqa: E402

Floats = np.ndarray


def third(number: int, _: tuple[int, int]) -> SimpleNamespace | None:
    """Return a creasing scene of the third family with the attributes of a layup; None if its ply is not as thick."""
    made = scene(number, "creases")
    if not np.isclose(made.thickness_mm, THICKNESS_MM):
        return None
    return SimpleNamespace(
        scan=made.scan, reference=made.reference, mold_from_scanner=made.mold_from_scanner, camera=None, mask=None,
        ply_outline=made.outline, fibre_angles_deg=(made.fibre_deg, made.fibre_deg + 90),
    )  # fmt: skip


FAMILIES = {
    "first": scenes.layup,
    "varied": partial(varied_layup, pockets=8, severity="any", borders=0, clamp=False, holes_mm=0),
    "third": third,
}
FIRST_SEED, PIXELS = 700, (1280, 960)
SPACING_MM, LARGEST_FOOT_MM2 = 1.5, 4000.0  # the coarsest at which the lattice does not pin folds (docs/referee.md)
WORSE_MM = 0.02  # of excess: more than the referee's members differ where nothing changes
COLUMNS = [
    "family", "seed", "pocket", "foot_area_mm2", "nodes", "spacing_mm", "plan_ms", "moves", "length_mm",
    "excess_before_mm", "excess_after_mm", "strain", "before_certified", "after_certified", "gathered_before_mm",
    "gathered_after_mm", "cpu_s", "build",
]  # fmt: skip


def creasing(family: str, seed: int) -> Iterator[tuple[Pocket, tuple[Move, ...], float]]:
    """Yield each creasing pocket of a layup inside the ply, with its moves and the time that the plan took, ms each."""
    if (layup := FAMILIES[family](seed, PIXELS)) is None:
        return
    given = given_right(layup)
    inspector = Inspector(
        Recipe(segmentation={"regions": False}), given.reference, given.ply_outline, given.fibre_angles_deg,
        mold_from_scanner=given.mold_from_scanner, mask=given.mask,
    )  # fmt: skip
    report = inspector.inspect(given.scan)
    creases = [p.id for p in report.pockets if p.verdict is Verdict.CREASE and p.decided_by == "excess"]
    if not creases:
        return
    began = time.process_time()
    planned = rework(report, Handling(hold_n=1e-6))  # each place by itself: nothing is passed on
    took_ms = 1e3 * (time.process_time() - began) / len(creases)
    for one in inspector.find(given.scan).pockets:
        moves = planned.of(one.number) if planned else ()
        if any(move.towards_deg is None for move in moves):
            print(f"{family} {seed} pocket {one.number}: no way out is known", flush=True)
            continue
        if one.number not in creases or not moves or one.foot.area_mm2 > LARGEST_FOOT_MM2:
            continue
        patch = pocket.patch(one.segmentation, one.feet, one.pocket.id, inspector.ply.reference)
        made = Pocket(
            name=f"{family}{seed}_{one.number}", family=family, ply_mm=patch.surface.values,
            mold_mm=patch.reference.values, origin_mm=np.asarray(patch.surface.origin_mm),
            grid_mm=patch.surface.spacing_mm, centre_mm=one.pocket.centroid_mm,
            angles_deg=np.asarray(inspector.ply.fibre_angles_deg), outline_mm=patch.outline_mm,
            rms_outline_mm=one.pocket.outline_mm, ply_outline_mm=np.asarray(given.ply_outline),
            foot_area_mm2=one.foot.area_mm2, at_edge=one.pocket.touches_ply_edge,
            mold_tol_mm=1.25 * one.feet.mold_tol_mm,
        )  # fmt: skip
        yield made, moves, took_ms


def moved_ends(laid: net.Net, moves: tuple[Move, ...]) -> Floats:
    """Return (N, 2) by how much, in XY, the plan moves the ends of the net's fibres; NaN where it moves none."""
    out = np.full((len(laid.nodes_mm), 2), np.nan)
    xy = laid.nodes_mm[:, :2]
    for move in moves:
        way = np.radians(move.towards_deg)
        way = np.array([np.cos(way), np.sin(way)])
        ahead, back = 2 * move.fibre, 2 * move.fibre + 1
        inner = np.flatnonzero((laid.neighbours[:, ahead] >= 0) & (laid.neighbours[:, back] >= 0))
        steps = xy[laid.neighbours[inner, ahead]] - xy[laid.neighbours[inner, back]]
        if (steps @ way).mean() < 0:
            ahead, back = back, ahead
        ends = np.flatnonzero((laid.neighbours[:, ahead] < 0) & (laid.neighbours[:, back] >= 0))
        across = np.array([-way[1], way[0]])
        at, lengths = move.from_mm @ across, move.lengths_mm
        order = np.argsort(at)
        apart = move.band_mm / len(at)
        at = np.concatenate([[at[order[0]] - apart], at[order], [at[order[-1]] + apart]])
        by = np.interp(xy[ends] @ across, at, np.concatenate([[0.0], lengths[order], [0.0]]))
        for k, length in zip(ends[by > 0], by[by > 0], strict=True):
            out[k] = np.nan_to_num(out[k]) + length * way
    return out


def laid_again(made: Pocket, laid: net.Net, target: Floats, parts: int = 16, most: int = 12) -> tuple[Floats, float]:
    """Return the nodes after the ends were moved, and the largest strain that remained.

    The ends that the plan moves go there in small parts. After each the lengths are made true again, and nodes below
    the mold lifted to it, by the least movement of all nodes; other nodes of the rim hardly move.
    """
    moves = np.isfinite(target[:, 0])
    ease = np.repeat(np.where(laid.kinds == 0, 1.0, 1e-4) * ~moves, 3)
    a, b = laid.edges.T
    movable = (ease[3 * a] > 0) | (ease[3 * b] > 0)
    a, b = a[movable], b[movable]
    count, x = len(a), laid.nodes_mm.copy()
    for _ in range(parts):
        x[moves, :2] += target[moves] / parts
        x[moves, 2] = np.maximum(x[moves, 2], made.reference.height(x[moves, :2]))
        for _ in range(most):
            gap = x[:, 2] - made.reference.height(x[:, :2])
            on = np.flatnonzero((gap < 1e-6) & (ease[::3] > 0))
            length = np.linalg.norm(x[a] - x[b], axis=1)
            wrong = np.concatenate([length - laid.spacing_mm, np.minimum(gap[on], 0.0)])
            if np.abs(wrong).max() < 1e-6:
                break
            slope, unit = made.reference.gradient(x[on, :2]), (x[a] - x[b]) / length[:, None]
            three = np.arange(3)
            rows = np.concatenate([np.repeat(np.arange(count), 6), np.repeat(count + np.arange(len(on)), 3)])
            along = np.hstack([3 * a[:, None] + three, 3 * b[:, None] + three])
            columns = np.concatenate([along.ravel(), (3 * on[:, None] + three).ravel()])
            values = np.hstack([unit, -unit]).ravel(), np.hstack([-slope, np.ones((len(on), 1))]).ravel()
            jacobian = sparse.csr_matrix((np.concatenate(values), (rows, columns)), (count + len(on), x.size))
            system = jacobian @ sparse.diags(ease) @ jacobian.T + 1e-5 * sparse.identity(count + len(on))
            step = (ease * (jacobian.T @ splu(system.tocsc()).solve(wrong))).reshape(-1, 3)
            x -= step * min(1.0, 0.2 * laid.spacing_mm / max(np.abs(step).max(), 1e-12))
    strain = np.abs(np.linalg.norm(x[a] - x[b], axis=1) / laid.spacing_mm - 1)
    x[:, 2] = np.maximum(x[:, 2], made.reference.height(x[:, :2]))
    return x, float(strain.max())


def minimum(ply: sheet.Sheet, laid: net.Net, made: Pocket) -> tuple[float, bool]:
    """Return the excess that the worst fold gathers under the vacuum, and whether the minimum is certified."""
    found = solve.minimise(ply, starts=2, first_start=1, seed=12, deadline_s=own.DEADLINE_S)
    return worst_fold(found.nodes_mm, laid.neighbours, laid.kinds, made.reference).gathered_mm, found.certified


def run(made: Pocket, moves: tuple[Move, ...], plan_ms: float) -> dict[str, object]:
    """Try one pocket before and after, and return its row."""
    began = time.process_time()
    laid = made.lay(SPACING_MM)
    target = moved_ends(laid, moves)
    before, before_good = minimum(own.fine_sheet(laid, made), laid, made)
    nodes, strain = laid_again(made, laid, target)
    kinds = np.where(np.isfinite(target[:, 0]), 2, laid.kinds)
    after_ply = sheet.Sheet(
        nodes, laid.neighbours, kinds, laid.spacing_mm, laid.area_mm2, made.reference, Recipe(),
        np.maximum(along_fibres(made.ply_outline_mm, laid), laid.spacing_mm),
    )  # fmt: skip
    after, after_good = minimum(after_ply, laid, made)
    largest = ridge.largest_fibre_excess
    return {
        "foot_area_mm2": made.foot_area_mm2, "nodes": len(nodes), "spacing_mm": laid.spacing_mm, "plan_ms": plan_ms,
        "moves": len(moves), "length_mm": max(move.length_mm for move in moves),
        "excess_before_mm": largest(laid.nodes_mm, laid.neighbours, made.reference),
        "excess_after_mm": largest(nodes, laid.neighbours, made.reference), "strain": strain,
        "before_certified": int(before_good), "after_certified": int(after_good), "gathered_before_mm": before,
        "gathered_after_mm": after, "cpu_s": time.process_time() - began, "build": tables.build(),
    }  # fmt: skip


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pockets", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--families", nargs="*", default=list(FAMILIES), choices=list(FAMILIES))
    options = parser.parse_args()
    tables.HERE = HERE
    kept = tables.Table("trial.csv", COLUMNS, ["family", "seed", "pocket"])
    until = time.monotonic() + 60 * options.minutes
    for k in range(10_000):
        if len(kept.done) >= options.pockets or time.monotonic() > until:
            break
        family, seed = options.families[k % len(options.families)], FIRST_SEED + k // len(options.families)
        if any(row[:2] == (family, str(seed)) for row in kept.done):
            continue
        for made, moves, plan_ms in creasing(family, seed):
            row = {"family": family, "seed": seed, "pocket": made.name.split("_")[1], **run(made, moves, plan_ms)}
            kept.add(row)
            print(" ".join(f"{n}={v:.3g}" if isinstance(v, float) else f"{n}={v}" for n, v in row.items()), flush=True)
    report = text(kept.rows())
    (HERE / "trial.txt").write_text(report, encoding="utf-8")
    print(report)


def text(rows: list[dict[str, str]]) -> str:
    """Return the table as text."""
    lines = [__doc__.split("\n\n")[0], ""]
    head = (
        "family",
        "pockets",
        "certified",
        "creased before",
        "cease after",
        "of them",
        "worse",
        "plan ms",
        "excess after",
    )
    lines.append("".join(f"{name:>16}" for name in head))
    for family in (*FAMILIES, "all"):
        every = [row for row in rows if family in (row["family"], "all")]
        good = [r for r in every if r["before_certified"] == r["after_certified"] == "1"]
        before = [r for r in good if float(r["gathered_before_mm"]) > LIMIT_EXCESS_MM]
        cease = sum(float(r["gathered_after_mm"]) <= LIMIT_EXCESS_MM for r in before)
        worse = sum(float(r["gathered_after_mm"]) > float(r["gathered_before_mm"]) + WORSE_MM for r in good)
        left = max((float(r["excess_after_mm"]) for r in good), default=0.0)
        share = f"{100 * cease / len(before):.1f} %" if before else "-"
        plan = np.median([float(r["plan_ms"]) for r in every]) if every else 0.0
        cells = (family, len(every), len(good), len(before), cease, share, worse, f"{plan:.1f}", f"{left:.3f} mm")
        lines.append("".join(f"{cell!s:>16}" for cell in cells))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
