"""Make the benchmark's clouds, and the answers of some criteria: python bench/open/contenders.py [--folder DIR].

The clouds of each scene are written to build/open as NNN.npz and compared with their hashes in scenes.csv. Then every
criterion answers from the clouds alone; its file of answers stands beside them. scorer.py scores these files.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from open_scenes import PITCH_MM, SCENES, Scene, clouds, digest, draw
from scipy import ndimage

import debulk
from debulk.results.report import PocketReport

HERE = Path(__file__).parent
OFF_MM = 0.3  # a gap above this is a pocket for the criteria of its shape
RMS_LIMIT_MM, RIDGE_LIMIT_MM = 0.30, 0.60
FOOT = 2 - np.pi / 2  # of the thickness: the ridge of no excess
COLUMNS = ("scene", "x_mm", "y_mm", "verdict", "score", "probability")
NAMES = ("debulk_verdict", "debulk_probability", "rms_of_minimum", "ridge_of_minimum", "peak_height", "area", "volume",
         "height_over_width", "steepest_slope")  # fmt: skip
LISTED = HERE / "scenes.csv"
Rows = dict[str, list[tuple[object, ...]]]


def write(scene: Scene, folder: Path) -> dict[str, np.ndarray]:
    """Write the clouds of a scene with all that an inspector may know, and return the clouds."""
    found = clouds(scene)
    np.savez_compressed(
        folder / f"{scene.number:03d}.npz", **found, mold_from_scanner=scene.camera.mold_from_scanner,
        outline_mm=scene.ply.outline, fibre_deg=np.array([scene.fibre_deg, scene.fibre_deg + 90]),
        thickness_mm=scene.ply.thickness_mm,
    )  # fmt: skip
    return found


def of_shape(scene: Scene, height: debulk.Grid, excess: debulk.Grid) -> Rows:
    """Return what the shape of each raised region says: the measures that need neither fibres nor a simulation."""
    step, origin = height.spacing_mm, np.asarray(height.origin_mm)
    gap = np.nan_to_num(ndimage.gaussian_filter(np.nan_to_num(height.values), 1.0) - scene.ply.thickness_mm)
    slope = np.hypot(*np.gradient(gap, step))
    labels, count = ndimage.label(gap > OFF_MM)
    rows: Rows = defaultdict(list)
    for k in range(1, count + 1):
        inner = labels == k
        if (peak := float(gap[inner].max())) < 2 * OFF_MM:
            continue
        area = float(inner.sum()) * step**2
        top = np.unravel_index(np.argmax(np.where(inner, gap, 0)), gap.shape)
        x, y = origin + step * np.array(top[::-1])
        j, i = (np.argwhere(inner) * step + origin[::-1] - np.asarray(excess.origin_mm)[::-1]).T / excess.spacing_mm
        longest = np.nanmax(ndimage.map_coordinates(np.nan_to_num(excess.values), (j, i), order=0), initial=0.0)
        for name, figure in (
            ("peak_height", peak), ("area", area), ("volume", float(gap[inner].sum()) * step**2),
            ("height_over_width", peak / np.sqrt(area)), ("steepest_slope", float(slope[inner].max())),
            ("debulk_verdict", longest / 2 + FOOT * scene.ply.thickness_mm),
        ):  # fmt: skip
            rows[name].append((scene.number, x, y, "", figure, ""))
    return rows


def of_debulk(report: debulk.Report, scene: Scene) -> Rows:
    """Return what debulk says by its verdict and its probability, and by the figures of its nets at the minimum."""
    rows: Rows = defaultdict(list)

    def say(
        name: str, pocket: PocketReport | None, verdict: str, figure: object = "", probability: object = ""
    ) -> None:
        place = ("", "") if pocket is None else tuple(pocket.outline_mm.mean(axis=0))
        rows[name].append((scene.number, *place, verdict, figure, probability))

    for p in report.pockets:
        ridge = p.excess.height_mm if p.excess else ""
        say("debulk_verdict", p, p.verdict.value, ridge)
        say("debulk_probability", p, "", "", p.crease_probability if p.crease_probability is not None else "")
        if p.rms_mm is not None and p.ridge_height_mm is not None:
            say("rms_of_minimum", p, _above(p.rms_mm, RMS_LIMIT_MM), p.rms_mm)
            say("ridge_of_minimum", p, _above(p.ridge_height_mm, RIDGE_LIMIT_MM), p.ridge_height_mm)
    longest = float(np.nanmax(report.excess_map.values, initial=0.0)) if report.excess_map else 0.0
    say("debulk_verdict", None, report.verdict.value, longest / 2 + FOOT * scene.ply.thickness_mm)
    say("debulk_probability", None, "", "", report.crease_probability if report.crease_probability is not None else "")
    return rows


def _above(figure: float, limit: float) -> str:
    return "CREASE" if figure > limit else "CEASE"


def answers(scene: Scene, found: dict[str, np.ndarray]) -> Rows:
    """Inspect a scene and return the rows of all criteria."""
    ply, pose = scene.ply, scene.camera.mold_from_scanner
    recipe = debulk.Recipe(material={"thickness_mm": ply.thickness_mm}, solve={"when": "always"})
    angles = (scene.fibre_deg, scene.fibre_deg + 90)
    report = debulk.inspect(found["scan"], found["reference"], recipe, ply.outline, angles, pose)
    scan, reference = (found[name].reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3] for name in ("scan", "reference"))
    height = debulk.surface.height_map(scan, reference, spacing_mm=PITCH_MM)
    rows = of_debulk(report, scene)
    for name, some in of_shape(scene, height, report.excess_map).items():
        rows[name] += some
    return rows


def listed(scene: Scene, found: dict[str, np.ndarray]) -> dict[str, str]:
    """Return the row of scenes.csv for a scene."""
    values = (scene.number, scene.family, scene.mold, scene.ply.thickness_mm, len(scene.ply.bells), digest(found))
    return dict(zip(("scene", "family", "mold", "thickness_mm", "pockets", "sha256"), map(str, values), strict=True))


def main() -> None:
    """Make clouds and answers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("build/open"))
    parser.add_argument("--clouds-only", action="store_true", help="make the clouds and compare their hashes, no more")
    parser.add_argument("--renew", action="store_true", help="write scenes.csv anew, for other scenes")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    known = {} if args.renew else {int(row["scene"]): row for row in csv.DictReader(LISTED.open(newline=""))}
    rows: Rows = {name: [] for name in NAMES}
    for number in range(SCENES):
        scene = draw(number)
        found = write(scene, args.folder)
        row = listed(scene, found)
        if known.setdefault(number, row) != row:
            raise SystemExit(f"scene {number} is not that of {LISTED.name}: {row}")
        for name, some in ({} if args.clouds_only else answers(scene, found)).items():
            rows[name] += some
    if args.renew:
        with LISTED.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(known[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(known.values())
    for name, some in ({} if args.clouds_only else rows).items():
        with (args.folder / f"{name}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([COLUMNS, *some])
    print(f"{SCENES} scenes in {time.process_time():.0f} s of processor time, debulk {debulk.__version__}")


if __name__ == "__main__":
    main()
