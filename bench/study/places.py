"""How far ridges of other minima are from the reported one: python bench/study/places.py [--layups 10] [--starts 8].

The pockets of virtual layups are solved from several perturbed starts. The place of a start is the peak of the highest
section of its minimum. Its distance from the reported ridge (from the nearer line, if a mirrored one is as likely) is
measured in radii of a disc of the foot's area. From half of the layups comes the distance within which nine in ten
places lie; the other half shows how many places lie within it there. Writes places.txt.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np

from debulk import Inspector, _core, scenes, solve
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.lines.by_runs import by_runs
from debulk.inspection.minima import ridges
from debulk.inspection.minima.laid_pocket import LaidPocket, lay_pocket
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import Recipe
from lab.net_crests import distance_mm, net_crests

COVERED = 0.9
EDGE_SPREAD = 1.35  # radii: with a band so wide the line of one start says nothing, and no report has it


@dataclass(frozen=True)
class Place:
    """The place of one start."""

    layup: int
    pocket: int
    held: bool  # judged by the excess; else the pocket is at the ply's edge
    off: float  # distance from the reported ridge, in radii of the foot


def places_of(layup: int, pixels: tuple[int, int], count: int) -> list[Place]:
    """Solve every pocket of a layup from the start of the report and `count` further ones."""
    recipe = Recipe()
    scene = scenes.layup(layup, pixels)
    inspector = Inspector(recipe, scene.reference, scene.ply_outline, mold_from_scanner=scene.mold_from_scanner)
    places = []
    for found in inspector.find(scene.scan).pockets:
        if not found.foot.closed:
            continue
        laid = lay_pocket(found, inspector.ply)
        minima = solve.minimise(
            laid.sheet, recipe.solve.method, starts=count + 2, seed=recipe.solve.seed, tolerance=recipe.solve.tolerance
        ).minima[1:]
        reported = _reported(found, laid, minima[0], inspector.ply)
        radius_mm = float(np.sqrt(found.foot.area_mm2 / np.pi))
        for minimum in minima[1:]:
            off_mm = _off(laid, minimum, reported)
            if off_mm is not None:
                places.append(Place(layup, found.number, laid.held, off_mm / radius_mm))
    return places


def _reported(found: FoundPocket, laid: LaidPocket, minimum: solve.Solution, ply: PlyOnMold) -> list[np.ndarray]:
    """Return the lines (K, 2) of the reported ridge; at the ply's edge that of the highest ridge of this minimum."""
    if laid.held:
        every = ridges.of_excess(laid, by_runs(found, ply, _core.Stop()).excess, found.foot)
        return [line[:, :2] for ridge in every for line in ridge.lines_mm]
    crests = net_crests(laid.post_process(minimum), laid.net.neighbours, minimum.nodes_mm) if minimum.certified else []
    return [crest.points_mm[:, :2] for crest in crests[:1]]


def _off(laid: LaidPocket, minimum: solve.Solution, reported: list[np.ndarray]) -> float | None:
    """Return the distance of a start's highest ridge from the reported one, mm; None if either has no ridge."""
    found = laid.post_process(minimum).sections if minimum.certified else ()
    if not found or not reported:
        return None
    peak = minimum.nodes_mm[max(found, key=lambda section: section.height_mm).peak, :2]
    return min(float(distance_mm(line, peak)) for line in reported)


def table(places: list[Place], layups: int, count: int) -> str:
    """Return the results as text."""
    lines = [
        fill(
            f"{layups} virtual layups, {count} perturbed starts of each pocket. Off: distance of the highest ridge of "
            "another start from the reported one, in radii of a disc of the foot's area. Held: pockets judged by their "
            "excess, whose reported ridge is no start's. Edge: at the ply's edge, against that of the first start.",
            116,
        ),
        "",
        "layups      pockets       pockets  places  median     90 %  95 %   farthest   in the report's band",
    ]
    for held, band in ((True, ridges.HELD_SPREAD), (False, EDGE_SPREAD)):
        for half, name in ((0, "even"), (1, "odd"), (None, "all")):
            chosen = [p for p in places if p.held is held and half in (None, p.layup % 2)]
            if not chosen:
                continue
            off = np.array([p.off for p in chosen])
            pockets = len({(p.layup, p.pocket) for p in chosen})
            q = np.quantile(off, (0.5, COVERED, 0.95, 1.0))
            lines.append(
                f"{name:<12}{'held' if held else 'edge':<12}{pockets:9d}{len(off):8d}"
                f"{q[0]:8.3f}{q[1]:9.3f}{q[2]:6.3f}{q[3]:11.3f}{100 * np.mean(off <= band):10.1f} % in {band:g}"
            )
        fitted = [p.off for p in places if p.held is held and p.layup % 2 == 0]
        kept = np.array([p.off for p in places if p.held is held and p.layup % 2 == 1])
        if fitted and kept.size:
            share = float(np.quantile(fitted, COVERED))
            lines.append(
                f"  the share that holds {100 * COVERED:.0f} % of the even layups' places, {share:.3f}, holds "
                f"{100 * np.mean(kept <= share):.1f} % of the odd ones'"
            )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=10)
    parser.add_argument("--first", type=int, default=200, help="seed of the first layup")
    parser.add_argument("--starts", type=int, default=8)
    parser.add_argument("--pixels", type=int, nargs=2, default=(960, 720))
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    options = parser.parse_args()
    places = []
    for layup in range(options.first, options.first + options.layups):
        places += places_of(layup, tuple(options.pixels), options.starts)
        print(f"layup {layup}: {len(places)} places", flush=True)
    text = table(places, options.layups, options.starts)
    (options.out / "places.txt").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
