"""Measure the effect of errors in the input on the pockets' figures and verdicts, on virtual layups.

python bench/front/registration.py [SEED ...] prints the table of registration.txt.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import debulk
from debulk.results.report import PocketReport

PIXELS = (1280, 960)
DECIDED = {debulk.Verdict.CEASE, debulk.Verdict.CREASE}
Floats = NDArray[np.float64]


def inspector_of(layup: Any, **changed: Any) -> debulk.Inspector:
    known = {
        "reference": layup.reference,
        "ply_outline": layup.ply_outline,
        "fibre_angles_deg": (0.0, 90.0),
        "mold_from_scanner": layup.mold_from_scanner,
        "camera": layup.camera,
    }
    return debulk.Inspector(None, **known | changed)


def moved_reference(inspector: debulk.Inspector, by_mm: Floats, tilt: float) -> Any:
    """Return the prepared reference as if mold or scanner had moved since then; tilt: mm of height per mm along x."""
    known = inspector.reference
    heights = known.heights_mm + by_mm[2]
    x = known.origin_mm[0] + known.spacing_mm * np.arange(heights.shape[1])
    heights = heights + tilt * (x - x.mean())
    moved = debulk.surface.Reference(heights, np.add(known.origin_mm, by_mm[:2]), known.spacing_mm)
    return replace(inspector.prepared, reference=moved)


def grown(outline: Floats, by_mm: float) -> Floats:
    """Return the outline with every corner moved outwards from the middle."""
    middle = outline.mean(axis=0)
    way = outline - middle
    return middle + way * (1 + by_mm / np.linalg.norm(way, axis=1, keepdims=True))


def cases(seed: int) -> Iterator[tuple[str, debulk.Report]]:
    """Yield each error's description and the report on it; the first is the layup with nothing wrong."""
    layup = debulk.scenes.layup(seed=seed, pixels=PIXELS)
    inspector = inspector_of(layup)
    yield "nothing", inspector.inspect(layup.scan)

    again = debulk.scenes.layup(seed=seed, pixels=PIXELS, repeat=1)
    yield "a second scan, other noise", inspector.inspect(again.scan)
    for noise in (0.02, 0.1, 0.2):
        noisy = debulk.scenes.layup(seed=seed, pixels=PIXELS, noise_mm=noise)
        yield f"noise {noise} mm instead of 0.05", inspector_of(noisy).inspect(noisy.scan)
    for pixels in ((640, 480), (2560, 1920)):
        finer = debulk.scenes.layup(seed=seed, pixels=pixels)
        yield f"{pixels[0]} x {pixels[1]} pixels", inspector_of(finer).inspect(finer.scan)

    for height in (-0.2, -0.1, -0.05, 0.05, 0.1, 0.2):
        reference = moved_reference(inspector, np.array([0, 0, height]), 0.0)
        yield f"reference {height:+} mm in height", inspector_of(layup, reference=reference).inspect(layup.scan)
    for tilt in (1e-4, 3e-4):
        reference = moved_reference(inspector, np.zeros(3), tilt)
        tilted = inspector_of(layup, reference=reference)
        yield f"reference tilted by {1000 * tilt:g} mm a m", tilted.inspect(layup.scan)
    for shift in (0.5, 1.0, 2.0):
        reference = moved_reference(inspector, np.array([shift, 0, 0]), 0.0)
        yield f"reference {shift} mm aside", inspector_of(layup, reference=reference).inspect(layup.scan)

    for turn in (1.0, 3.0, 10.0):
        turned = inspector_of(layup, reference=inspector.prepared, fibre_angles_deg=(turn, 90 + turn))
        yield f"fibre angles {turn:g} degrees off", turned.inspect(layup.scan)
    for by in (-5.0, -2.0, 2.0, 5.0):
        other = inspector_of(layup, reference=inspector.prepared, ply_outline=grown(layup.ply_outline, by))
        yield f"outline {by:+g} mm outwards", other.inspect(layup.scan)
    yield "no outline", inspector_of(layup, reference=inspector.prepared, ply_outline=None).inspect(layup.scan)


def same_pocket(pocket: PocketReport, report: debulk.Report) -> PocketReport | None:
    """Return the pocket of another report whose outline has its middle near by, if there is one."""
    middle = pocket.outline_mm.mean(axis=0)
    ways = [np.linalg.norm(p.outline_mm.mean(axis=0) - middle) for p in report.pockets]
    nearest = int(np.argmin(ways)) if ways else -1
    return report.pockets[nearest] if nearest >= 0 and ways[nearest] < 15.0 else None


def ridge_of(pocket: PocketReport) -> float | None:
    return None if pocket.deciding_ridge is None else pocket.deciding_ridge.height_mm


def excess_of(pocket: PocketReport) -> float | None:
    return None if pocket.excess is None else pocket.excess.length_mm


def main(seeds: list[int]) -> None:
    told: dict[str, list[tuple[PocketReport, PocketReport | None]]] = {}
    invalid: dict[str, int] = {}
    for seed in seeds:
        known: debulk.Report | None = None
        for name, report in cases(seed):
            known = known or report
            told.setdefault(name, []).extend((p, same_pocket(p, report)) for p in known.pockets)
            invalid[name] = invalid.get(name, 0) + (report.verdict is debulk.Verdict.INVALID)
    print(f"ERRORS OF THE INPUT, {PIXELS[0]} x {PIXELS[1]} pixels, seeds {', '.join(map(str, seeds))}")
    print()
    print("Against the same layups without them. Area to excess: median and largest change. Opposite: CEASE and CREASE")
    print(
        "changed places. Other: any other change of a verdict. Lost: pockets without one at the same place. Ridge: the"
    )
    print("one that decides. INVALID: layups.")
    print()
    widths = (34, 8, 5, 14, 14, 16, 14, 14, 10, 7, 9)
    heads = (
        "",
        "pockets",
        "lost",
        "area %",
        "peak mm",
        "RMS mm",
        "ridge mm",
        "excess mm",
        "opposite",
        "other",
        "INVALID",
    )
    print("".join(f"{head:>{width}}" for head, width in zip(heads, widths, strict=True)))
    for name, pairs in told.items():
        kept = [(a, b) for a, b in pairs if b is not None]

        def change(values: list[float], digits: int) -> str:
            known = [abs(v) for v in values if np.isfinite(v)]
            return f"{np.median(known):.{digits}f} {max(known):.{digits}f}" if known else "-"

        def less(a: float | None, b: float | None) -> float:
            return np.nan if a is None or b is None else b - a

        area = change([100 * (b.area_mm2 / a.area_mm2 - 1) for a, b in kept], 2)
        peak = change([b.peak_mm - a.peak_mm for a, b in kept], 3)
        rms = change([less(a.rms_mm, b.rms_mm) for a, b in kept], 4)
        ridge = change([less(ridge_of(a), ridge_of(b)) for a, b in kept], 3)
        excess = change([less(excess_of(a), excess_of(b)) for a, b in kept], 3)
        differ = [(a.verdict, b.verdict) for a, b in kept if a.verdict != b.verdict]
        opposite = sum(set(pair) == DECIDED for pair in differ)
        print(
            f"{name:34}{len(pairs):8}{len(pairs) - len(kept):5}{area:>14}{peak:>14}{rms:>16}{ridge:>14}{excess:>14}"
            f"{opposite:10}{len(differ) - opposite:7}{invalid[name]:9}",
            flush=True,
        )


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [20, 21, 22])
