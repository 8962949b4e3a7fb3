"""Whether the range of a ridge holds the true one, on bumps of shapes of which nothing was fitted.

python bench/trust/bumps.py [--scenes 78]. Each scene has one pocket of `foreign.py` with a true ridge of 0.62 to 0.80
mm: a bell, a cap, a flat top, a pyramid, a bump on a bump, or a fold 3 to 6 mm wide at half its height on a wide one.
Points lie 0.7 to 2.7 mm apart, as an image or a list. "beyond": the true ridge lies more than 0.005 mm above the upper
end, of a pocket or of a narrow bump that the filters take from it (`narrow_bumps`).
"""

from __future__ import annotations

import argparse
import warnings

import foreign
import numpy as np

import debulk

KINDS = ("bell", "cap", "top", "pyramid", "two", "fold")


def part_of(rng, kind):
    half = rng.uniform(6, 26)
    if kind == "pyramid":
        return foreign.pyramid(rng)
    if kind == "two":
        small = rng.uniform(0.4, 0.7) * half
        wide = (1.0, 140.0, 110.0, half, half * rng.uniform(1, 2), 0.3, "bell")
        on_it = (rng.uniform(0.2, 0.5), 140.0 + rng.uniform(-half / 2, half / 2), 110.0, small, small, 0.0, "bell")
    elif kind == "fold":
        wide = (1.0, 140.0, 110.0, rng.uniform(18, 35), 30.0, 0.3, "cap")
        on_it = (0.5, 140.0, 110.0, rng.uniform(3, 6), rng.uniform(10, 20), rng.uniform(0, 3), "bell")
    else:
        return foreign.plain(rng, bumps=[(1.0, 140.0, 110.0, half, half * rng.uniform(1, 2), rng.uniform(0, 3), kind)])
    return foreign.plain(rng, bumps=[wide, on_it])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=78)
    beyond = dict.fromkeys(KINDS, 0)
    warnings.simplefilter("ignore")
    for k in range(parser.parse_args().scenes):
        rng, kind = np.random.default_rng([77, k]), KINDS[k % 6]
        part, wanted = part_of(rng, kind), rng.uniform(0.62, 0.80)
        for _ in range(6):
            part.factor *= np.sqrt((wanted - foreign.FLAT_MM) / max(part.ridges()[0] - foreign.FLAT_MM, 0.01))
        true_mm = part.ridges()[0]
        apart_mm, image = rng.choice([0.7, 0.9, 1.5, 2.0, 2.7]), rng.random() < 0.6
        scan, reference, how = foreign.scans(rng, part, image=image, dx=apart_mm, dy=apart_mm)
        report = debulk.Inspector(None, reference, part.outline, part.angles, **how).inspect(scan)
        ranges = [p.excess.range_mm for p in report.pockets if p.excess is not None]
        low_mm, high_mm = (max((r[end] for r in ranges), default=0.0) for end in (0, 1))
        narrow = [f.measured for f in report.findings if f.check == "narrow_bumps" and f.measured is not None]
        high_mm = max([high_mm, *narrow])
        beyond[kind] += true_mm - high_mm > 0.005
        said = f"{kind:8} {apart_mm} mm, true {true_mm:.3f}, range {low_mm:.3f} to {high_mm:.3f}"
        print(f"{k:3} {said}, beyond by {true_mm - high_mm:+.3f}: {report.verdict.name}", flush=True)
    print(
        f"\ndebulk {debulk.__version__}, beyond the upper end:", ", ".join(f"{n} {kind}" for kind, n in beyond.items())
    )


if __name__ == "__main__":
    main()
