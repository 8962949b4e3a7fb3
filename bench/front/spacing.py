"""Compare the error due to the height map's spacing with the front end's time, on one layup of 20 million points.

Writes spacing.txt.
"""

import time
from pathlib import Path

import numpy as np
from accuracy import middle

import debulk
from debulk.inspection.find.front import FrontEnd
from debulk.recipe import options

layup = debulk.scenes.layup(seed=0, pixels=(5120, 3840))
inspector = debulk.Inspector(
    None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner, camera=layup.camera
)
lines = ["spacing   busy ms   area: median    worst   peak: median   worst   volume: median    worst"]
for spacing in (0.5, 0.75, 1.0, 1.5, 2.0, 3.0):
    front = FrontEnd(
        inspector.reference,
        inspector.prepared.image,
        layup.mold_from_scanner,
        options=options.front_end(inspector.recipe, spacing),
    )
    busy = []
    for _ in range(3):
        began = time.process_time()
        heights = front.inspect(layup.scan)
        busy.append(1e3 * (time.process_time() - began) / 2)
    pockets = debulk.pocket.segment(
        heights, ply_outline=layup.ply_outline, smooth_mm=inspector.recipe.patch.smooth_mm
    ).pockets
    errors = []
    for true in layup.truth.pockets:
        near = [p for p in pockets if np.hypot(*(middle(p.outline_mm) - middle(true.outline_mm))) < 5]
        if len(near) == 1:
            p = near[0]
            errors.append(
                (
                    abs(p.area_mm2 / true.area_mm2 - 1) * 100,
                    abs(p.peak_mm - true.peak_mm),
                    abs(p.volume_mm3 / true.volume_mm3 - 1) * 100,
                )
            )
    half, worst = np.median(errors, axis=0), np.max(errors, axis=0)
    lines.append(
        f"{spacing:4.2f} mm{min(busy):10.0f}{half[0]:13.3f} %{worst[0]:8.3f} %{half[1]:11.3f} mm{worst[1]:6.3f} mm"
        f"{half[2]:11.3f} %{worst[2]:8.3f} %   ({len(errors)} of {len(layup.truth.pockets)} pockets)"
    )
    print(lines[-1], flush=True)
lines.append("busy: processors' time of clean, grid, fill, spikes and median over two threads, the best of three.")
Path(__file__).with_name("spacing.txt").write_text("\n".join(lines) + "\n")
