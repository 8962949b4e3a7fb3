"""Standard errors of a pocket's area, peak and volume that come from the noise of one scan. See accuracy.py."""

from dataclasses import replace

import numpy as np

from debulk.scenes.bump import cut_radius, measure
from debulk.scenes.spoil import LEFT_NOISE

CELL_MM = 1.0  # cell of the sums over a bell
STEPS = {"x": 0.05, "y": 0.05, "long": 0.05, "short": 0.05, "angle": 0.2, "height": 0.01}  # of the derivatives; mm, deg


def noise_density(layup, xy):
    """Return the variance of a height times the area that a pixel covers, at (N, 2) mold XY.

    This density determines the noise of sums over many pixels.
    """
    scanner = layup._scanner
    at = np.column_stack([xy, layup.truth.mold_height(xy) + layup.truth.cut_height_mm])
    pixel = scanner.camera.project(at)
    across, along = (scanner.camera.project(at + step) - pixel for step in ([1.0, 0, 0], [0, 1.0, 0]))
    pixels_per_mm2 = np.abs(across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0])
    sigma = np.where(pixel[:, 0] < scanner.camera.width // 3, LEFT_NOISE, 1.0) * scanner.noise_mm
    return sigma**2 / pixels_per_mm2


def moved(bell, name, by):
    """Return a bell with one of its six numbers changed."""
    (x, y), (long, short) = bell.centre_mm, bell.radii_mm
    return {
        "x": lambda: replace(bell, centre_mm=(x + by, y)),
        "y": lambda: replace(bell, centre_mm=(x, y + by)),
        "long": lambda: replace(bell, radii_mm=(long + by, short)),
        "short": lambda: replace(bell, radii_mm=(long, short + by)),
        "angle": lambda: replace(bell, angle_deg=bell.angle_deg + by),
        "height": lambda: replace(bell, height_mm=bell.height_mm + by),
    }[name]()


def grid_inside(layup, bell):
    """Return the centres of the cells within the bell's foot that are on the ply."""
    foot = bell.foot(90)
    low, high = foot.min(axis=0), foot.max(axis=0)
    x, y = np.meshgrid(*(np.arange(low[k] + CELL_MM / 2, high[k], CELL_MM) for k in (0, 1)))
    u, v = bell.to_unit(x, y)
    inside = (u * u + v * v < 1) & layup._scanner.ply.inside(x, y)
    return np.column_stack([x[inside], y[inside]])


def ideal_errors(layup, true):
    """Return the Cramér-Rao bounds if it is known that the pocket is a bell: area and volume in %, peak in mm."""
    xy = grid_inside(layup, true.bell)
    slopes, changes = [], []
    for name, step in STEPS.items():
        more, less = moved(true.bell, name, step), moved(true.bell, name, -step)
        slopes.append((more.rise(*xy.T) - less.rise(*xy.T)) / (2 * step))
        a, b = (
            measure("pocket", bell, layup.ply_outline, layup.truth.thickness_mm, layup.truth.cut_height_mm)
            for bell in (more, less)
        )
        changes.append([(a.area_mm2 - b.area_mm2), (a.peak_mm - b.peak_mm), (a.volume_mm3 - b.volume_mm3)])
        changes[-1] = np.array(changes[-1]) / (2 * step)
    slopes, changes = np.array(slopes), np.array(changes)
    scale = np.sqrt((slopes**2).mean(axis=1)) + 1e-12  # a round bell has no angle
    information = (slopes / scale[:, None] / noise_density(layup, xy) * CELL_MM**2) @ (slopes / scale[:, None]).T
    covariance = np.linalg.pinv(information, rcond=1e-9, hermitian=True)
    changes /= scale[:, None]
    area, peak, volume = np.sqrt(np.einsum("pk,pq,qk->k", changes, covariance, changes))
    return {"area": 100 * area / true.area_mm2, "peak": peak, "volume": 100 * volume / true.volume_mm3}


def window_errors(layup, true, smooth_mm):
    """Return the standard errors of area and volume, in %, for local quadratic fits in windows.

    A quadratic's weights over a window w, (9 - 15 (2x/w)²) / 4w, have a sum of squares of 2.25 / w. This share of the
    noise's density remains across the outline and shifts it by the noise over the slope.
    """
    cut = layup.truth.cut_height_mm
    corner, ahead = true.outline_mm, np.roll(true.outline_mm, -1, axis=0)
    at, length = (corner + ahead) / 2, np.hypot(*(ahead - corner).T)
    window = min(smooth_mm, true.area_mm2 / length.sum())
    _, slope_x, slope_y, rho = true.bell.rise_and_slopes(*at.T)
    free = np.abs(rho - cut_radius(true.bell.height_mm, cut - layup.truth.thickness_mm)) < 0.01  # not the ply's edge
    density, slope = noise_density(layup, at)[free], np.hypot(slope_x, slope_y)[free]
    shift = np.sum(density * 2.25 / window / slope**2 * length[free])
    both = np.sum(density / 2 / slope * length[free])  # half of the noise of a window at the outline lies inside
    inside = np.mean(noise_density(layup, grid_inside(layup, true.bell))) * true.area_mm2
    volume = cut**2 * shift + 2 * cut * both + inside
    return {"area": 100 * np.sqrt(shift) / true.area_mm2, "volume": 100 * np.sqrt(volume) / true.volume_mm3}
