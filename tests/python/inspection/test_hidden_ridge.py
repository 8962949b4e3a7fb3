"""What a debulked ply's cells may hide: folds of a generator of its own, read by rows of cells and by whole scans."""

import math

import numpy as np
import pytest

import debulk
from debulk._core.surface import row_medians
from debulk.inspection.hidden_ridge import OFF_CREST, OFF_CREST_OF_MEDIAN, ROWS, Hidden, read, width
from debulk.page.comparison import page
from debulk.page.measured_ridges import measured_ridges
from debulk.recipe import Recipe
from debulk.section import fold
from debulk.surface import median
from debulk.verdict import Verdict

LIMIT_MM = Recipe().verdict.max_ridge_mm
EXCESSES_MM = 0.003, 0.01, 0.03, 0.06, 0.2, 0.6
HEIGHTS = {}


def section(excess_mm):
    """Return the minimiser's own fold: (M, 2) points of its section."""
    if excess_mm not in HEIGHTS:
        HEIGHTS[excess_mm] = fold(excess_mm, 40.0, Recipe(), segments=400).points_mm
    return HEIGHTS[excess_mm]


def ridge(excess_mm, x, y, turn, off=0.0, half_length=1e9):
    """Return the height of a straight ridge through (off, 0), turned, which tapers as its bump does."""
    points = section(excess_mm)
    along_it, across = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn) - off
    taper = np.cos(np.pi / 2 * np.minimum(np.abs(along_it) / half_length, 1.0)) ** (16 / 7)
    return np.interp(across, points[:, 0], points[:, 1]) * taper


def readings(heights):
    return read(debulk.Grid(heights, np.zeros(2), 1.0)).values


def distances(turn, off, size=41):
    y, x = np.mgrid[:size, :size] - size // 2
    return np.abs(y * math.cos(turn) - x * math.sin(turn) - off)


@pytest.mark.parametrize("cells", ROWS)
def test_some_row_lies_within_half_a_cell_of_a_crest(cells):
    """The median of a falling function of the distance is that of the median distance."""
    middle = (slice(14, 27),) * 2
    worst = max(
        -row_medians(-distances(turn, off).astype(np.float32), cells, 1)[middle].max()
        for turn in np.linspace(0, np.pi, 49)
        for off in np.linspace(0, 1, 9)
    )
    assert 0.45 < worst <= OFF_CREST + 1e-9


def test_a_median_over_five_by_five_reads_a_crest_up_to_one_cell_and_a_half_away():
    worst = 0.0
    for turn in np.linspace(0, np.pi, 25):
        for off in np.linspace(0, 1, 5):
            away = debulk.Grid(distances(turn, off).astype(np.float32), np.zeros(2), 1.0)
            worst = max(worst, float(median(away, 5).values[14:27, 14:27].min()))
    assert worst == pytest.approx(OFF_CREST_OF_MEDIAN, abs=1e-3)


@pytest.mark.parametrize("cell_mm", [0.3, 0.5, 1.0, 2.0, 3.0, 4.0])
def test_no_ridge_is_higher_than_its_cells_allow(cell_mm):
    """Ridges of six heights at any angle, place and noise, seen by points: none is higher than the upper end."""
    rng = np.random.default_rng(3)
    cells = max(9, round(36 / cell_mm))
    y, x = (np.mgrid[:cells, :cells] - (cells - 1) / 2) * cell_mm
    inside = np.hypot(x, y) < 16
    hidden = Hidden(Recipe(), cell_mm, 0.0)
    for excess_mm in EXCESSES_MM:
        for _ in range(6):
            off, noise_mm = rng.uniform(-3, 3), rng.choice([0.0, 0.02, 0.05])
            heights = 0.25 + ridge(excess_mm, x, y, rng.uniform(0, np.pi), off, 16.0)
            seen = (heights + rng.normal(0, noise_mm, x.shape)).astype(np.float32)
            true = 0.25 + section(excess_mm)[:, 1].max()
            assert hidden.highest_mm(readings(seen), inside, width(inside)) > true - 0.01


def test_a_hole_hides_no_ridge_that_stands_out_of_it_and_any_that_lies_in_it():
    y, x = (np.mgrid[:61, :61] - 30) * 1.0
    inside, hidden, flat = np.hypot(x, y) < 28, Hidden(Recipe(), 1.0, 0.0), np.full(x.shape, 0.25, np.float32)
    said = {}
    for name, hole in {"round": np.hypot(x, y) < 5, "slit": np.abs(y) < 1, "band": np.abs(y) < 4}.items():
        seen = np.where(hole, np.float32(np.nan), flat)
        said[name] = hidden.highest_mm(readings(seen), inside, width(inside))
    assert said["round"] < said["slit"] < 0.4 and said["band"] > LIMIT_MM
    assert hidden.highest_mm(readings(np.full_like(flat, np.nan)), inside, width(inside)) == math.inf


@pytest.mark.parametrize("every", [3, 5])
def test_lines_that_were_not_seen_do_not_part_a_ridge_in_the_foot(every):
    """Parts shorter than a quarter of a ridge counted as none: a ridge of 0.96 mm was bounded by 0.37 mm."""
    y, x = (np.mgrid[:61, :61] - 30) * 1.0
    inside, foot = np.hypot(x, y) < 14, np.hypot(x, y) < 28
    heights = 0.25 + ridge(0.2, x - 21, y, np.pi / 2, 0.0, 12.0)
    seen = np.where((y % every == 0) & (np.abs(x) > 14), np.nan, heights).astype(np.float32)
    assert Hidden(Recipe(), 1.0, 0.0).highest_mm(readings(seen), foot, width(inside)) > heights.max() - 0.01


@pytest.mark.parametrize("cell_mm", [1.0, 2.0])
def test_a_hole_in_the_foot_hides_the_fold_that_lies_in_it(cell_mm):
    """What was not seen beside the outline stood no higher than what was seen: a fold of 1.3 mm was bounded by 0.3."""
    n = round(34 / cell_mm)
    y, x = np.mgrid[-n : n + 1, -n : n + 1] * cell_mm
    inside, foot, hidden = np.hypot(x, y) < 12, np.hypot(x, y) < 30, Hidden(Recipe(), cell_mm, 0.0)
    fold = 0.25 + ridge(0.4, x - 21, y, np.pi / 2, 0.0, 12.0)
    for over, least in ((fold, fold.max()), (np.full_like(fold, 0.25), LIMIT_MM)):
        seen = np.where((np.abs(x - 21) < 5) & (np.abs(y) < 12), np.nan, over).astype(np.float32)
        assert hidden.highest_mm(readings(seen), foot, width(inside)) > least
    for small in (np.hypot(x - 21, y) < 3, (x % 7 == 0) & (y % 7 == 0)):
        seen = np.where(small, np.nan, 0.25).astype(np.float32)
        assert hidden.highest_mm(readings(seen), foot, width(inside)) < 0.5


def test_no_hole_on_a_ridge_hides_more_than_its_bound():
    """Holes of any form on the crests of ridges of a pocket's width: 17 of the 60 were higher than what was said."""
    y, x = np.mgrid[-34:35, -34:35] * 1.0
    inside, foot, hidden = np.hypot(x, y) < 15, np.hypot(x, y) < 27, Hidden(Recipe(), 1.0, 0.0)
    rng = np.random.default_rng(5)
    for _ in range(60):
        excess_mm, turn, slant = rng.choice(EXCESSES_MM[3:]), *rng.uniform(0, np.pi, 2)
        at, off, radius, ratio = rng.uniform(-17, 17, 2), rng.uniform(-3, 3, 2), rng.uniform(1, 9), rng.uniform(1, 3)
        dx, dy = x - at[0], y - at[1]
        heights = 0.25 + ridge(excess_mm, dx, dy, turn, 0.0, width(inside) / 2)
        long = (dx - off[0]) * math.cos(slant) + (dy - off[1]) * math.sin(slant)
        deep = (dy - off[1]) * math.cos(slant) - (dx - off[0]) * math.sin(slant)
        seen = np.where(np.hypot(long / ratio, deep) < radius / math.sqrt(ratio), np.nan, heights).astype(np.float32)
        true = 0.25 + section(excess_mm)[:, 1].max()
        assert hidden.highest_mm(readings(seen), foot, width(inside)) > true - 0.02


def test_six_flying_pixels_in_a_row_are_no_ridge():
    flat = np.full((41, 41), 0.25, np.float32)
    hidden, inside = Hidden(Recipe(), 0.8, 0.0), np.ones(flat.shape, bool)
    lowest = hidden.highest_mm(readings(flat), inside, width(inside))
    for pixels in ((slice(20, 21), slice(10, 16)), (slice(20, 22), slice(10, 15))):
        heights = flat.copy()
        heights[pixels] = 9.0
        assert hidden.highest_mm(readings(heights), inside, width(inside)) < lowest + 0.1


# --- whole scans: lists of points on a turned lattice over a curved mold ---

OUTLINE = np.array([(20, 20), (180, 20), (180, 180), (20, 180)], dtype=float)


def lattice(pitch_mm, turn, rng):
    n = round(300 / pitch_mm)
    j, i = np.mgrid[:n, :n] - n // 2
    x, y = (
        np.array([i * math.cos(turn) - j * math.sin(turn), i * math.sin(turn) + j * math.cos(turn)]) * pitch_mm
    ) + 100
    x, y = x + rng.uniform(0, pitch_mm), y + rng.uniform(0, pitch_mm)
    kept = (x > 0) & (x < 200) & (y > 0) & (y < 200)
    return x[kept], y[kept], -((x[kept] - 100) ** 2) / 4000 - (y[kept] - 100) ** 2 / 6000


def cloud(pitch_mm, turn, rng, above):
    x, y, z = lattice(pitch_mm, turn, rng)
    ply = (np.abs(x - 100) < 80) & (np.abs(y - 100) < 80)
    return np.column_stack([x, y, z + np.where(ply, above(x - 100, y - 100), 0.0) + rng.normal(0, 0.03, x.size)])


def inspected(pitch_mm, rng):
    """Return an inspector and its report of a pocket of 30 by 22 mm, 4.5 mm high."""
    reference = cloud(pitch_mm, 0.3, rng, lambda x, y: 0.0 * x)
    before = cloud(
        pitch_mm, 0.9, rng, lambda x, y: 0.3 + 4.5 * np.cos(np.pi / 2 * np.minimum(np.hypot(x / 30, y / 22), 1)) ** 2
    )
    inspector = debulk.Inspector(None, reference, OUTLINE)
    return inspector, inspector.inspect(before)


@pytest.mark.layup
def test_a_fold_in_a_pockets_foot_beside_its_outline_creases():
    """It was no outcome: 4 of 4 folds of 1 mm that stood there were measured as CEASE."""
    rng = np.random.default_rng(8)
    inspector, report = inspected(1.0, rng)
    (known,) = report.pockets
    place_mm = np.array([[100.0, 100.0], [123.0, 100.0]])  # the pocket's middle, and the fold's
    assert debulk.pocket.inside(known.outline_mm, place_mm).tolist() == [True, False]
    assert debulk.pocket.inside(known.foot_outline_mm, place_mm).all()
    after = cloud(1.0, 1.7, rng, lambda x, y: 0.25 + ridge(0.2, x - 23, y, np.pi / 2, 0.0, 12.0))
    p = inspector.compare(report, after).pockets[0]
    assert p.measured is Verdict.CREASE and "peak" in p.reason
    assert LIMIT_MM < p.measured_peak_range_mm[0] < 0.25 + section(0.2)[:, 1].max()


@pytest.mark.layup
@pytest.mark.parametrize("pitch_mm", [1.0, 2.0, 3.0])
def test_a_fold_in_the_foot_between_the_points_of_a_scan_is_no_cease(pitch_mm):
    """At 2 mm, folds of 0.6 to 1.3 mm were read as 0.3 to 0.5 mm in 24 of 24 scans, and nothing bounded them."""
    rng = np.random.default_rng(8)
    inspector, report = inspected(pitch_mm, rng)
    for excess_mm, off, turn in [(0.1, 21, 1.6), (0.1, 25, 1.9), (0.2, 23, 1.6), (0.4, 25, 1.6)]:
        after = cloud(
            pitch_mm,
            rng.uniform(0, 3),
            rng,
            lambda x, y, e=excess_mm, o=off, t=turn: 0.25 + ridge(e, x - o, y, t, 0, 12),
        )
        p = inspector.compare(report, after).pockets[0]
        assert p.measured is not Verdict.CEASE
        assert 0.25 + section(excess_mm)[:, 1].max() < p.measured_peak_range_mm[1] + 0.02
    for flying in (0.0, 0.005):
        points = cloud(pitch_mm, rng.uniform(0, 3), rng, lambda x, y: 0.25 + 0.0 * x)
        points[rng.random(len(points)) < flying, 2] += 5
        assert inspector.compare(report, points).pockets[0].measured is Verdict.CEASE


@pytest.mark.layup
@pytest.mark.parametrize(("off", "near"), [(28, True), (45, True), (-60, False)])
def test_a_ridge_beside_a_pocket_is_told(off, near):
    """Beside the foot, which ends 26 mm from the pocket's middle, nothing was looked for: CEASE, and no word of it."""
    rng = np.random.default_rng(8)
    inspector, report = inspected(1.0, rng)
    after = cloud(1.0, 0.4, rng, lambda x, y: 0.25 + ridge(0.4, x - off, y, np.pi / 2, 0.0, 14.0))
    comparison = inspector.compare(report, after)
    (one,), (pocket,) = comparison.standing, comparison.pockets
    assert np.hypot(one.place_mm[0] - 100 - off, one.place_mm[1] - 100) < 2.5
    assert LIMIT_MM < one.height_mm < 0.25 + section(0.4)[:, 1].max() and 8 < one.length_mm < 28
    assert (
        comparison.headline.endswith("1 ridge beside the pockets") and "where no pocket was" in comparison.warnings[0]
    )
    assert pocket.measured is (Verdict.UNDECIDED if near else Verdict.CEASE)
    assert ("look whether it came of this pocket" in pocket.reason) == near
    shown = page(comparison)
    assert (
        'class="banner crease"' in shown and measured_ridges(comparison.height_map, [pocket.outline_mm], LIMIT_MM) == ""
    )
    assert shown.count('class="ridge-measured" d="M') == 2  # in the map, and its meaning


@pytest.mark.layup
@pytest.mark.parametrize("pitch_mm", [1.0, 2.0, 3.0])
def test_a_ridge_between_the_points_of_a_scan_is_no_cease(pitch_mm):
    """At 2 and 3 mm the median over five cells reads a ridge of 0.73 mm below the limit."""
    rng = np.random.default_rng(8)
    inspector, report = inspected(pitch_mm, rng)
    excess_mm = 0.1
    true = 0.25 + section(excess_mm)[:, 1].max()
    assert 0.7 < true < 0.9
    measured = []
    for _ in range(6):
        turn, off = rng.uniform(0, np.pi), rng.uniform(-2, 2)
        after = cloud(
            pitch_mm, rng.uniform(0, 2), rng, lambda x, y, t=turn, o=off: 0.25 + ridge(excess_mm, x, y, t, o, 25.0)
        )
        measured.append(inspector.compare(report, after).pockets[0])
    for p in measured:
        low, high = p.measured_peak_range_mm
        assert low <= p.measured_peak_mm < high and low < true < high + 0.02
        assert p.measured is not Verdict.CEASE
        assert p.measured is Verdict.CREASE or "scan finer" in p.reason
    if pitch_mm > 1:
        assert max(p.measured_peak_mm for p in measured) < LIMIT_MM
    flat = inspector.compare(report, cloud(pitch_mm, 0.5, rng, lambda x, y: 0.25 + 0.0 * x)).pockets[0]
    assert flat.measured is Verdict.CEASE and flat.measured_peak_range_mm[1] < LIMIT_MM
