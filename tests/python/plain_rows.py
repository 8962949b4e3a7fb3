"""The plain way to match rectified rows, against which the scanner is measured: every pixel that can be searched."""

import numpy as np

MOST_STEP_RAD = 2.0  # between neighbours that are interpolated
MOST_BACK_PIXELS = 1.5


def resampled(phase, x, y):
    """Interpolate between four pixels, or take the nearest one where one of the four has no phase."""
    tall, wide = phase.shape
    inside = (x >= 0) & (y >= 0) & (x <= wide - 1) & (y <= tall - 1)
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    i, j = np.minimum(x.astype(int), wide - 2), np.minimum(y.astype(int), tall - 2)
    u, v = x - i, y - j
    four = np.stack([phase[j, i], phase[j, i + 1], phase[j + 1, i], phase[j + 1, i + 1]])
    value = (np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v]) * four).sum(axis=0)
    value = np.where(
        np.ptp(four, axis=0) <= MOST_STEP_RAD, value, phase[np.rint(y).astype(int), np.rint(x).astype(int)]
    )
    return np.where(inside, value, np.nan)


def disparity(left, right, rectified, rows):
    """Columns in the left row minus those in the right one, (len(rows), W); NaN where search or way back fails."""
    maps = [part[rows] for part in rectified.maps]
    first, second = resampled(left, *maps[:2]), resampled(right, *maps[2:])
    return np.stack([_matched(a, b) for a, b in zip(first, second, strict=True)])


def _matched(left, right):
    out = np.full(len(left), np.nan)
    own = np.flatnonzero(np.isfinite(left))
    if len(own) < 2 or np.isfinite(right).sum() < 2:
        return out
    x = _find(right, left[own])
    nearest = np.rint(np.where(np.isfinite(x), x, 0)).astype(int)
    known = np.flatnonzero(np.isfinite(right))
    back = _find(left, np.interp(nearest, known, right[known]))
    fine = np.abs(back - own) <= MOST_BACK_PIXELS
    out[own[fine]] = (own - x)[fine]
    return out


def _find(row, phases):
    """Search the only place at which a row, linear between neighbours, has a phase; gaps of one pixel are bridged."""
    known = np.flatnonzero(np.isfinite(row))
    a, b = known[:-1], known[1:]
    fine = (b - a <= 2) & (np.abs(row[b] - row[a]) <= MOST_STEP_RAD) & (row[a] != row[b])
    a, b = a[fine], b[fine]
    part = (phases[:, None] - row[a]) / (row[b] - row[a])
    there = (part >= 0) & (part <= 1)
    place = a + (b - a) * part
    first = np.where(there, place, np.inf).min(axis=1, initial=np.inf)
    last = np.where(there, place, -np.inf).max(axis=1, initial=-np.inf)
    only = there.any(axis=1) & (last - first <= 8)
    return np.where(only, 0.5 * (np.where(only, first, 0) + np.where(only, last, 0)), np.nan)
