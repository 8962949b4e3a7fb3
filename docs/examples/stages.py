"""Every stage by itself, on NumPy arrays: from two clouds to what is left of a pocket."""

import numpy as np

import debulk

layup = debulk.scenes.layup(seed=0, pixels=(960, 720))
pose = layup.mold_from_scanner


def in_mold_frame(points: np.ndarray) -> np.ndarray:
    """Remove stray points, then move the rest."""
    keep = debulk.cloud.remove_outliers(points)
    return np.where(keep[..., None], points, np.nan).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]


# Heights of the ply above the reference, and the pockets in them.
scan, reference_cloud = in_mold_frame(layup.scan), in_mold_frame(layup.reference)
heights = debulk.surface.height_map(scan, reference_cloud, spacing_mm=1.5)
pockets = debulk.pocket.segment(heights, ply_outline=layup.ply_outline).pockets
one = pockets[7]
print(f"{len(pockets)} pockets, the eighth {one.area_mm2:.0f} mm2 and {one.peak_mm:.1f} mm high")

# One as large and high, round and on a flat mold: a net of inextensible fibres on it.
radius, peak = np.sqrt(one.area_mm2 / np.pi) * 1.5, one.peak_mm
ticks = np.arange(-1.5 * radius, 1.5 * radius, 2.0)
r = np.hypot(*np.meshgrid(ticks, ticks))
corner = (ticks[0], ticks[0])
mold = debulk.surface.Reference(np.zeros_like(r), corner, 2.0)
ply = debulk.surface.Reference(np.where(r < radius, peak * np.cos(np.pi * r / 2 / radius) ** 2, 0.0), corner, 2.0)
turn = np.linspace(0, 2 * np.pi, 100, endpoint=False)
outline = radius * np.c_[np.cos(turn), np.sin(turn)]
net = debulk.net.fibre_net(ply, mold, centre_mm=(0, 0), angles_deg=(0, 90), outline_mm=outline)

# Under vacuum, with a certificate; then what will be seen of it.
solution = debulk.solve.minimise(debulk.sheet.Sheet.of_net(net, mold))
assert solution.certified
seen = debulk.ridge.post_process(solution.nodes_mm, net.neighbours, net.inside, mold, thickness_mm=0.3, bulk_factor=1.2)
print(f"{len(net.nodes_mm)} nodes, {net.spacing_mm:.1f} mm apart")
print(f"ridge {seen.ridge_height_mm:.2f} mm, RMS {seen.rms_mm:.2f} mm")
