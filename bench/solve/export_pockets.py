"""Write the nets of the 14 pockets of a virtual layup for the C++ benchmark: export_pockets.py FILE."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from debulk import _core, cloud, net, pocket, scenes, surface


def nets(seed: int) -> Iterator[tuple[net.Net, surface.Reference]]:
    """Yield each pocket's net and the mold below it, as the pipeline's front end and net make them."""
    layup = scenes.layup(seed, (1280, 960))
    clouds = []
    for points in (layup.reference, layup.scan):
        moved = cloud.transform(points, layup.mold_from_scanner)
        moved[~cloud.remove_outliers(moved)] = np.nan
        clouds.append(moved)
    spacing = max(0.5, cloud.median_pitch(clouds[0]))
    reference = surface.fit_reference(surface.grid_heights(clouds[0], spacing_mm=spacing))
    heights = surface.median(surface.height_map(clouds[1], reference, spacing, hole_diameter_mm=15), 3)
    segmentation = pocket.segment(heights, ply_outline=layup.ply_outline)
    feet = pocket.feet(segmentation)
    for p, foot in zip(segmentation.pockets, feet.feet, strict=True):
        margin = 2 * np.sqrt(foot.area_mm2 / 100) + 10
        patch = pocket.patch(segmentation, feet, p.id, reference, margin_mm=margin)
        ply = surface.Reference(patch.surface.values, patch.surface.origin_mm, patch.surface.spacing_mm)
        yield (
            net.fibre_net(
                ply,
                reference,
                p.centroid_mm,
                (0, 90),
                outline_mm=patch.outline_mm,
                ply_outline=layup.ply_outline,
                mold_tol_mm=1.5 * feet.mold_tol_mm,
                rms_outline_mm=p.outline_mm,
            ),
            reference,
        )


def crop(reference: surface.Reference, nodes: np.ndarray, margin: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Return the heights around the nodes, and the position of the first height."""
    first = np.floor((nodes[:, :2].min(0) - reference.origin_mm) / reference.spacing_mm).astype(int) - margin
    last = np.ceil((nodes[:, :2].max(0) - reference.origin_mm) / reference.spacing_mm).astype(int) + margin
    heights = reference.heights_mm
    first, last = np.maximum(first, 0), np.minimum(last, np.array(heights.shape)[::-1] - 1)
    origin = np.asarray(reference.origin_mm) + first * reference.spacing_mm
    return heights[first[1] : last[1] + 1, first[0] : last[0] + 1], origin


def main(path: Path) -> None:
    """Write all pockets into one text file: counts, nodes with neighbours and kind, heights."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        for n, reference in nets(seed=0):
            heights, origin = crop(reference, n.nodes_mm)
            ny, nx = heights.shape
            print(len(n.nodes_mm), repr(float(n.spacing_mm)), repr(float(n.area_mm2)), file=file)
            for x, neighbours, kind in zip(n.nodes_mm.tolist(), n.neighbours.tolist(), n.kinds.tolist(), strict=True):
                print(*map(repr, x), *neighbours, kind, file=file)
            print(nx, ny, *map(repr, origin.tolist()), repr(float(reference.spacing_mm)), file=file)
            for row in heights.tolist():
                print(*map(repr, row), file=file)
    print(f"{path}: written with {_core.default_threads()} threads")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
