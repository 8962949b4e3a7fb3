"""Carry out the advice on creasing pockets, in fine nets: python bench/rework/trial.py [--pockets 200] [--minutes 60].

Every creasing pocket of virtual layups of several families is found by an inspection, which plans its rework. Its net
is laid with a spacing of five thicknesses (1.5 mm at 0.3 mm), about four times finer than an inspection's, and
minimised as it lies: its worst fold. Then the ends of its fibres are moved over the mold as the plan says, and the
lengths are made true again by the least movement of the nodes, in which the flat ply at the rim gives way a thousand
times less easily. From there the vacuum is drawn once more, now with the moved ends free against the friction of the
ply between them and the ply's edge. A pocket ceases if its worst fold gathers less excess than a ridge of the limit
holds. The first pockets with few nodes are pressed in MuJoCo, too, as they lie and after the move (the extra
`referee`). Each pocket adds a row to trial.csv; trial.txt is written from it.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu
from scipy.stats import beta

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "referee"))

import own  # noqa: E402
import tables  # noqa: E402
from edge import along_fibres  # noqa: E402
from folds import fibres, worst_fold  # noqa: E402
from pockets import LIMIT_MM, Pocket  # noqa: E402

from debulk import Inspector, net, pocket, ridge, scenes, sheet, solve  # noqa: E402
from debulk.recipe import Recipe  # noqa: E402
from debulk.results.rework import rework  # noqa: E402
from debulk.rework import Handling, Move  # noqa: E402
from debulk.rework.plan import _MOST_ACROSS as MOST_ACROSS  # noqa: E402
from debulk.verdict import Verdict  # noqa: E402
from lab.third.scene import scene  # noqa: E402
from lab.varied import given_right, varied_layup  # noqa: E402

Floats = np.ndarray


def third(number: int, _: tuple[int, int]) -> SimpleNamespace | None:
    """Return a creasing scene of the third family with the attributes of a layup; None without the ply's outline."""
    made = scene(number, "creases")
    if made.outline is None:  # no way out is known
        return None
    return SimpleNamespace(
        scan=made.scan, reference=made.reference, mold_from_scanner=made.mold_from_scanner, camera=None, mask=None,
        ply_outline=made.outline, fibre_angles_deg=(made.fibre_deg, made.fibre_deg + 90),
        thickness_mm=made.thickness_mm,
    )  # fmt: skip


FAMILIES: dict[str, Callable[[int, tuple[int, int]], Any]] = {
    "first": scenes.layup,
    "varied": partial(varied_layup, pockets=8, severity="any", borders=0, clamp=False, holes_mm=0),
    "third": third,
}
FIRST_SEED, PIXELS = 700, (1280, 960)
SPACING = 5.0  # in thicknesses: the coarsest at which the lattice does not pin folds (docs/referee.md)
LARGEST_FOOT = 1780.0  # in cells of the net: 40 cm2 at a thickness of 0.3 mm
STARTS = (1, 2, 3)  # perturbed ones, until the minimum of one is certified, or MuJoCo's run accepted
OFF_MM = 2.0  # a net that stands so much farther off the mold than its pocket was not laid on it
SIMULATED_NODES = 450  # most that MuJoCo is given
RIM_EASE = 1e-3  # how easily the flat ply at the rim gives way, over the ply that stands off the mold
MOST_SHARE = 1.2  # of the excess that one fold can gather: what gathers more is a net that leaves a steep mold
WORSE_MM = 0.02  # of excess: more than the referee's members differ where nothing changes
COLUMNS = [
    "family", "seed", "pocket", "thickness_mm", "foot_area_mm2", "nodes", "spacing_mm", "plan_ms", "moves", "length_mm",
    "across_mm", "excess_before_mm", "excess_after_mm", "strain", "drawn_mm", "before_certified", "after_certified",
    "gathered_before_mm", "gathered_after_mm", "mujoco_before_mm", "mujoco_after_mm", "cpu_s", "build",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Task:
    """A creasing pocket inside the ply, and what to do about it."""

    pocket: Pocket
    recipe: Recipe
    moves: tuple[Move, ...]
    plan_ms: float  # that the plan of its layup took for each pocket of it


def creasing(family: str, seed: int) -> Iterator[Task]:
    """Yield the creasing pockets of a layup."""
    if (layup := FAMILIES[family](seed, PIXELS)) is None:
        return
    given = given_right(layup)
    thickness_mm = getattr(layup, "thickness_mm", Recipe().material.thickness_mm)
    recipe = Recipe(material={"thickness_mm": thickness_mm})
    inspector = Inspector(
        recipe, given.reference, given.ply_outline, given.fibre_angles_deg,
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
        if one.number not in creases or not moves:
            continue
        if one.foot.area_mm2 > LARGEST_FOOT * (SPACING * thickness_mm) ** 2:
            print(f"{family} {seed} pocket {one.number}: {one.foot.area_mm2:.0f} mm2 is too large for the net")
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
        yield Task(made, recipe, moves, took_ms)


@dataclass(frozen=True, eq=False)
class Ends:
    """Nodes (K,) of the rim that are moved by `by_mm` (K,) along `way` (K, 2), mold XY; by 0: they slide across it."""

    node: np.ndarray
    way: Floats
    by_mm: Floats


def moved_ends(laid: net.Net, moves: tuple[Move, ...], gap: Floats) -> Ends:
    """Return the ends that the plan moves, and with them the other fibres that end at the same nodes, which stay.

    The plan's lines are straight, and the fibres of a net on a bump are not quite: each gives what the plan says for
    the line that it meets on average, its height as the weight. At its end it may be 2 mm from that line, and what the
    plan says may differ by 0.4 mm from one millimetre to the next.
    """
    xy, found = laid.nodes_mm[:, :2], {}
    for move in moves:
        assert move.towards_deg is not None
        turn = np.radians(move.towards_deg)
        way, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
        at, lengths = move.from_mm @ across, move.lengths_mm
        order = np.argsort(at)
        apart = move.band_mm / len(at)
        at = np.concatenate([[at[order[0]] - apart], at[order], [at[order[-1]] + apart]])
        lengths = np.concatenate([[0.0], lengths[order], [0.0]])
        for line in fibres(laid.neighbours, move.fibre):
            end = line[-1] if (xy[line[-1]] - xy[line[0]]) @ way > 0 else line[0]
            high = np.maximum(gap[line], 0.0) + 1e-3
            length = float(np.interp(high @ (xy[line] @ across) / high.sum(), at, lengths))
            if length > 0:
                found[int(end), move.fibre] = (way, length)
    for k in sorted({int(node) for ends in list(found) for node in on_rim(laid, *ends)}):
        found.setdefault((k, 2), (np.zeros(2), 0.0))  # free, also where no fibre ends
        for fibre in (0, 1):
            e, w = laid.neighbours[k, 2 * fibre :][:2]
            if (k, fibre) not in found and (e < 0) != (w < 0):
                step = xy[k] - xy[max(e, w)]
                found[k, fibre] = (step / np.linalg.norm(step), 0.0)
    node, (way, by) = np.array([k for k, _ in found]), (np.array(v) for v in zip(*found.values(), strict=True))
    return Ends(node, way, by)


def on_rim(laid: net.Net, end: int, fibre: int) -> Iterator[int]:
    """Yield the end of a fibre, and the nodes of the rim on that fibre before its other end: they slide with it."""
    back = 2 * fibre + int(laid.neighbours[end, 2 * fibre] < 0)
    while (following := int(laid.neighbours[end, back])) >= 0:
        if laid.kinds[end] != 0:
            yield end
        end = following


def laid_again(made: Pocket, laid: net.Net, ends: Ends, parts: int = 16, most: int = 25) -> tuple[Floats, float]:
    """Return the nodes after the ends were moved, and the largest strain that remained.

    The ends go there in small parts, each along its fibre and free across it. After each part the lengths are made true
    again, and nodes below the mold lifted to it, by the least movement of all nodes. Others of the rim move where the
    lengths want it: fibres that cross a sheared band get shorter, and draw the flat ply beside it in.
    """
    ease_of = np.where(laid.kinds == 0, 1.0, RIM_EASE)
    ease_of[ends.node] = 1.0
    rim, on_mold = laid.kinds != 0, laid.nodes_mm[:, 2] - made.reference.height(laid.nodes_mm[:, :2])
    blocks = ease_of[:, None, None] * np.eye(3)
    a, b = laid.edges.T
    stays = ends.by_mm == 0  # these hardly move along their fibre
    for k, way in zip(ends.node[stays], ends.way[stays], strict=True):
        blocks[k, :2, :2] -= (1 - RIM_EASE) * np.outer(way, way)
    ease = sparse.block_diag(list(blocks), format="csr")
    node, way, by_mm = ends.node[~stays], ends.way[~stays], ends.by_mm[~stays]
    count, x, held = len(a), laid.nodes_mm.copy(), len(node)
    three = np.arange(3)
    for part in range(1, parts + 1):
        for _ in range(most):
            gap = x[:, 2] - made.reference.height(x[:, :2])
            on = np.flatnonzero((gap < -1e-7) | rim)
            length = np.linalg.norm(x[a] - x[b], axis=1)
            gone = ((x - laid.nodes_mm)[node, :2] * way).sum(axis=1)
            wrong = np.concatenate(
                [
                    length - laid.spacing_mm,
                    np.where(rim, gap - on_mold, np.minimum(gap, 0.0))[on],
                    gone - by_mm * part / parts,
                ]
            )
            if np.abs(wrong).max() < 1e-6:
                break
            slope, unit = made.reference.gradient(x[on, :2]), (x[a] - x[b]) / length[:, None]
            rows = np.repeat(np.arange(len(wrong)), np.repeat([6, 3, 2], [count, len(on), held]))
            along = np.hstack([3 * a[:, None] + three, 3 * b[:, None] + three])
            columns = [along, 3 * on[:, None] + three, 3 * node[:, None] + three[:2]]
            values = [np.hstack([unit, -unit]), np.hstack([-slope, np.ones((len(on), 1))]), way]
            flat = [np.concatenate([part_of.ravel() for part_of in parts_of]) for parts_of in (values, columns)]
            jacobian = sparse.csr_matrix((flat[0], (rows, flat[1])), (len(wrong), x.size))
            system = jacobian @ ease @ jacobian.T + 1e-8 * sparse.identity(len(wrong))
            step = (ease @ (jacobian.T @ splu(system.tocsc()).solve(wrong))).reshape(-1, 3)
            x -= step * min(1.0, 0.2 * laid.spacing_mm / max(np.abs(step).max(), 1e-12))
    strain = np.abs(np.linalg.norm(x[a] - x[b], axis=1) / laid.spacing_mm - 1)
    x[:, 2] = np.maximum(x[:, 2], made.reference.height(x[:, :2]))
    return x, float(strain.max())


def minimum(ply: sheet.Sheet, laid: net.Net, made: Pocket) -> tuple[float, bool]:
    """Return the excess that the worst fold gathers under the vacuum, and whether the minimum is certified."""
    for start in STARTS:
        found = solve.minimise(ply, starts=start + 1, first_start=start, seed=12, deadline_s=own.DEADLINE_S)
        if found.certified:
            break
    return worst_fold(found.nodes_mm, laid.neighbours, laid.kinds, made.reference).gathered_mm, found.certified


def simulated(laid: net.Net, made: Pocket, recipe: Recipe) -> float:
    """Return the excess that the worst fold gathers in MuJoCo; NaN if the run is not accepted."""
    import mujoco_ply

    for member in STARTS:
        end = mujoco_ply.simulate(made, laid, member, mujoco_ply.Physics(), recipe=recipe)
        if end.accepted:
            return worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, made.reference).gathered_mm
    return np.nan


def run(task: Task, in_mujoco: bool) -> dict[str, object] | None:
    """Try one pocket before and after, and return its row; None if its net cannot be laid."""
    began, made = time.process_time(), task.pocket
    laid = made.lay(SPACING * task.recipe.material.thickness_mm)
    gap = laid.nodes_mm[:, 2] - made.reference.height(laid.nodes_mm[:, :2])
    if gap.max() > (made.ply_mm - made.mold_mm).max() + OFF_MM:
        return None
    ends = moved_ends(laid, task.moves, gap)
    before, before_good = minimum(sheet.Sheet.of_net(laid, made.reference, task.recipe), laid, made)
    nodes, strain = laid_again(made, laid, ends)
    kinds = laid.kinds.copy()
    kinds[ends.node[ends.by_mm > 0]] = 2
    drawn = np.linalg.norm(nodes - laid.nodes_mm, axis=1)[(laid.kinds != 0) & (kinds != 2)]
    again = replace(laid, nodes_mm=nodes, kinds=kinds)
    after_ply = sheet.Sheet(
        nodes, laid.neighbours, kinds, laid.spacing_mm, laid.area_mm2, made.reference, task.recipe,
        np.maximum(along_fibres(made.ply_outline_mm, laid), laid.spacing_mm),
    )  # fmt: skip
    after, after_good = minimum(after_ply, again, made)
    in_mujoco &= len(nodes) <= SIMULATED_NODES
    largest = ridge.largest_fibre_excess
    return {
        "thickness_mm": task.recipe.material.thickness_mm, "foot_area_mm2": made.foot_area_mm2, "nodes": len(nodes),
        "spacing_mm": laid.spacing_mm, "plan_ms": task.plan_ms, "moves": len(task.moves),
        "length_mm": max(move.length_mm for move in task.moves),
        "across_mm": max(move.across_mm for move in task.moves),
        "excess_before_mm": largest(laid.nodes_mm, laid.neighbours, made.reference),
        "excess_after_mm": largest(nodes, laid.neighbours, made.reference), "strain": strain,
        "drawn_mm": float(drawn.max(initial=0.0)),
        "before_certified": int(before_good), "after_certified": int(after_good), "gathered_before_mm": before,
        "gathered_after_mm": after, "mujoco_before_mm": simulated(laid, made, task.recipe) if in_mujoco else "",
        "mujoco_after_mm": simulated(again, made, task.recipe) if in_mujoco else "",
        "cpu_s": time.process_time() - began, "build": tables.build(),
    }  # fmt: skip


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pockets", type=int, default=200)
    parser.add_argument("--simulated", type=int, default=30, help="pockets that MuJoCo is given")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="of the first layup")
    parser.add_argument("--families", nargs="*", default=list(FAMILIES), choices=list(FAMILIES))
    options = parser.parse_args()
    tables.HERE = HERE
    kept = tables.Table("trial.csv", COLUMNS, ["family", "seed", "pocket"])
    until = time.monotonic() + 60 * options.minutes
    for k in range(10_000):
        if len(kept.done) >= options.pockets or time.monotonic() > until:
            break
        family, seed = options.families[k % len(options.families)], options.seed + k // len(options.families)
        if any(row[:2] == (family, str(seed)) for row in kept.done):
            continue
        for task in creasing(family, seed):
            in_mujoco = sum(row["mujoco_before_mm"] != "" for row in kept.rows()) < options.simulated
            if (tried := run(task, in_mujoco)) is None:
                print(f"{task.pocket.name}: the net cannot be laid", flush=True)
                continue
            row = {"family": family, "seed": seed, "pocket": task.pocket.name.split("_")[1], **tried}
            kept.add(row)
            print(" ".join(f"{n}={v:.3g}" if isinstance(v, float) else f"{n}={v}" for n, v in row.items()), flush=True)
    report = text(kept.rows())
    (HERE / "trial.txt").write_text(report, encoding="utf-8")
    print(report)


def text(rows: list[dict[str, str]]) -> str:
    """Return the table as text, and each pocket that does not cease or was not tried as advised."""
    for row in rows:
        row["limit"] = str(ridge.excess_of_ridge(LIMIT_MM, float(row["thickness_mm"])))
    lines = [__doc__.split("\n\n")[0], "", row_of("family", HEAD)]
    lines += [row_of(f, counts([r for r in rows if f in (r["family"], "all")])) for f in (*FAMILIES, "all")]
    shares = np.array([float(r["gathered_after_mm"]) / float(r["limit"]) for r in rows if judged(r)])
    late = np.percentile(shares, (50, 95, 100)).round(2)
    took = [float(r["plan_ms"]) for r in rows]
    lines += ["", "gathered after, over the limit's excess: {} in the median, {} at 95 %, {} at most".format(*late)]
    lines += [f"a plan takes {np.median(took):.1f} ms per pocket in the median, {max(took):.1f} ms at most"]
    steep = [row for row in rows if judged(row) and creased(row) and laid_anew(row)]
    ceased = sum(map(ceases, steep))
    lines += [f"bands that would shear too much, which the plan lifts: {len(steep)}; pulled even so, {ceased} cease"]
    run = [row for row in rows if row["mujoco_before_mm"]]
    lines += ["", f"IN MUJOCO, {len(run)} of them", row_of("family", IN_MUJOCO)]
    lines += [row_of(f, in_mujoco([r for r in run if f in (r["family"], "all")])) for f in (*FAMILIES, "all")]
    lines += ["", "one by one: no cease, worse, or not judged"]
    for row in rows:
        if not judged(row) or not ceases(row) or worse(row):
            at = " ".join(row[name] for name in ("family", "seed", "pocket"))
            before, after, limit = (float(row[name]) for name in ("gathered_before_mm", "gathered_after_mm", "limit"))
            lines.append(f"{at}: gathers {before:.2f}, then {after:.2f} mm, limit {limit:.2f}: {why(row)}")
    return "\n".join(lines) + "\n"


HEAD = ("pockets", "judged", "creased before", "cease after", "of them", "at least", "worse")
IN_MUJOCO = ("pockets", "judged", "creased before", "cease after", "worse")


def row_of(name: str, cells: Sequence[object]) -> str:
    """Return a line of a table."""
    return "".join(f"{cell!s:>16}" for cell in (name, *cells))


def judged(row: dict[str, str]) -> bool:
    """Return whether both minima are certified, and what their folds gather is excess of the ply's."""
    return not any(row[f"{when}_certified"] != "1" or leaves(row, when) for when in ("before", "after"))


def leaves(row: dict[str, str], when: str) -> bool:
    """Return whether a fold gathers more than the fibres have: then the net left a steep mold under the vacuum."""
    return float(row[f"gathered_{when}_mm"]) > MOST_SHARE * float(row[f"excess_{when}_mm"])


def laid_anew(row: dict[str, str]) -> bool:
    """Return whether the plan asks to lift the ply for the band's shear; rows without that figure: not known, False."""
    return float(row["across_mm"] or 0) > MOST_ACROSS * float(row["limit"])


def creased(row: dict[str, str], of: str = "gathered") -> bool:
    """Return whether the pocket creases if nothing is done."""
    return float(row[f"{of}_before_mm"]) > float(row["limit"])


def ceases(row: dict[str, str], of: str = "gathered") -> bool:
    """Return whether it ceases after the rework."""
    return float(row[f"{of}_after_mm"]) <= float(row["limit"])


def worse(row: dict[str, str], of: str = "gathered") -> bool:
    """Return whether the rework made it worse."""
    return float(row[f"{of}_after_mm"]) > float(row[f"{of}_before_mm"]) + WORSE_MM


def why(row: dict[str, str]) -> str:
    """Return why a pocket does not cease, gets worse, or is not judged."""
    for when, name in (("before", "as it lies"), ("after", "after the move")):
        if row[f"{when}_certified"] != "1":
            return f"no minimum is certified {name}"
        if leaves(row, when):
            return f"{name} the net leaves its steep mold under the vacuum: it gathers more than its fibres have"
    if laid_anew(row):
        return f"its band shears and draws {float(row['across_mm']):.1f} mm of the ply beside it in: the plan lifts it"
    return f"of {float(row['excess_after_mm']):.2f} mm that its fibres keep it makes another fold"


def counts(rows: list[dict[str, str]]) -> tuple[object, ...]:
    """Return the cells of a family."""
    good = [row for row in rows if judged(row)]
    before = [row for row in good if creased(row)]
    cease = sum(map(ceases, before))
    share, least = "-", "-"
    if before:  # the lower end of the one-sided 95 % interval of Clopper and Pearson
        share = f"{100 * cease / len(before):.1f} %"
        least = f"{100 * beta.ppf(0.05, cease, len(before) - cease + 1):.1f} %" if cease else "0 %"
    return len(rows), len(good), len(before), cease, share, least, sum(map(worse, good))


def in_mujoco(rows: list[dict[str, str]]) -> tuple[object, ...]:
    """Return the cells of a family in MuJoCo."""
    good = [row for row in rows if "nan" not in (row["mujoco_before_mm"], row["mujoco_after_mm"]) and judged(row)]
    before = [row for row in good if creased(row, "mujoco")]
    cease = sum(ceases(row, "mujoco") for row in before)
    return len(rows), len(good), len(before), cease, sum(worse(row, "mujoco") for row in good)


if __name__ == "__main__":
    main()
