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
NAMES = ("debulk_verdict", "debulk_probability", "rms_of_minimum", "rms_over_thickness", "ridge_of_minimum",
         "peak_height", "area", "volume", "height_over_width", "steepest_slope")  # fmt: skip
LISTED = HERE / "scenes.csv"
Given = dict[str, np.ndarray]
Rows = dict[str, list[tuple[object, ...]]]


def given(scene: Scene) -> Given:
    """Return the clouds of a scene with all else that an inspector may know: the arrays of its file."""
    return {
        **clouds(scene), "mold_from_scanner": scene.camera.mold_from_scanner, "outline_mm": scene.ply.outline,
        "fibre_deg": np.array([scene.fibre_deg, scene.fibre_deg + 90]),
        "thickness_mm": np.array(scene.ply.thickness_mm),
    }  # fmt: skip


def of_shape(number: int, thickness_mm: float, height: debulk.Grid, excess: debulk.Grid) -> Rows:
    """Return what the shape of each raised region says: the measures that need neither fibres nor a simulation."""
    step, origin = height.spacing_mm, np.asarray(height.origin_mm)
    gap = np.nan_to_num(ndimage.gaussian_filter(np.nan_to_num(height.values), 1.0) - thickness_mm)
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
            ("debulk_verdict", longest / 2 + FOOT * thickness_mm),
        ):  # fmt: skip
            rows[name].append((number, x, y, "", figure, ""))
    return rows


def of_debulk(number: int, thickness_mm: float, report: debulk.Report) -> Rows:
    """Return what debulk says by its verdict and its probability, and by the figures of its nets at the minimum."""
    rows: Rows = defaultdict(list)

    def say(
        name: str, pocket: PocketReport | None, verdict: str, figure: object = "", probability: object = ""
    ) -> None:
        place = ("", "") if pocket is None else tuple(pocket.outline_mm.mean(axis=0))
        rows[name].append((number, *place, verdict, figure, probability))

    for p in report.pockets:
        ridge = p.excess.height_mm if p.excess else ""
        say("debulk_verdict", p, p.verdict.value, ridge)
        say("debulk_probability", p, "", "", p.crease_probability if p.crease_probability is not None else "")
        if p.rms_mm is not None and p.ridge_height_mm is not None:
            say("rms_of_minimum", p, _above(p.rms_mm, RMS_LIMIT_MM), p.rms_mm)
            say("rms_over_thickness", p, _above(p.rms_mm, thickness_mm), p.rms_mm / thickness_mm)
            say("ridge_of_minimum", p, _above(p.ridge_height_mm, RIDGE_LIMIT_MM), p.ridge_height_mm)
    longest = float(np.nanmax(report.excess_map.values, initial=0.0)) if report.excess_map else 0.0
    say("debulk_verdict", None, report.verdict.value, longest / 2 + FOOT * thickness_mm)
    say("debulk_probability", None, "", "", report.crease_probability if report.crease_probability is not None else "")
    return rows


def _above(figure: float, limit: float) -> str:
    return "CREASE" if figure > limit else "CEASE"


def answers(number: int, known: Given) -> Rows:
    """Inspect what is given of a scene and return the rows of all criteria."""
    pose, thickness = known["mold_from_scanner"], float(known["thickness_mm"])
    recipe = debulk.Recipe(material={"thickness_mm": thickness}, solve={"when": "always"})
    report = debulk.inspect(known["scan"], known["reference"], recipe, known["outline_mm"], known["fibre_deg"], pose)
    scan, reference = (known[name].reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3] for name in ("scan", "reference"))
    height = debulk.surface.height_map(scan, reference, spacing_mm=PITCH_MM)
    rows = of_debulk(number, thickness, report)
    for name, some in of_shape(number, thickness, height, report.excess_map).items():
        rows[name] += some
    return rows


def listed(scene: Scene, found: Given) -> dict[str, str]:
    """Return the row of scenes.csv for a scene."""
    values = (scene.number, scene.family, scene.mold, scene.ply.thickness_mm, len(scene.ply.bells), digest(found))
    return dict(zip(("scene", "family", "mold", "thickness_mm", "pockets", "sha256"), map(str, values), strict=True))


def made(number: int, folder: Path, known: dict[int, dict[str, str]]) -> None:
    """Write the file of a scene; SystemExit if its hash is not the one that is listed."""
    scene = draw(number)
    found = given(scene)
    row = listed(scene, found)
    if known.setdefault(number, row) != row:
        raise SystemExit(f"scene {number} is not that of {LISTED.name}: {row}")
    np.savez_compressed(folder / f"{number:03d}.npz", **found)


def main() -> None:
    """Make clouds and answers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("build/open"))
    parser.add_argument("--only", choices=("clouds", "answers"), help="make only one of the two")
    parser.add_argument("--renew", action="store_true", help="write scenes.csv anew, for other scenes")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    known = {} if args.renew else {int(row["scene"]): row for row in csv.DictReader(LISTED.open(newline=""))}
    rows: Rows = {name: [] for name in NAMES}
    for number in range(SCENES):
        if args.only != "answers":
            made(number, args.folder, known)
        if args.only != "clouds":
            with np.load(args.folder / f"{number:03d}.npz") as file:
                for name, some in answers(number, dict(file)).items():
                    rows[name] += some
    if args.renew:
        with LISTED.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(known[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(known.values())
    for name, some in rows.items() if args.only != "clouds" else ():
        with (args.folder / f"{name}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([COLUMNS, *some])
    print(f"{SCENES} scenes in {time.process_time():.0f} s of processor time, debulk {debulk.__version__}")


if __name__ == "__main__":
    main()
