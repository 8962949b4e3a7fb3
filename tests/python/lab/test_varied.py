"""The second family of layups: its truth against brute force, its rays against marching, and what may be chosen."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from debulk import InputError, scenes
from lab.varied import MISTAKES, bumps, faults, given_right, molds, placing, varied_layup
from lab.varied.fibres import HELD_MM, excess
from lab.varied.ply import Ply
from lab.varied.polygons import distance, inside
from lab.varied.regions import label_regions, measure
from lab.varied.rendering import Clamp, Stage
from lab.varied.seeing import random_camera

SQUARE = np.array([(-200.0, -200.0), (200.0, -200.0), (200.0, 200.0), (-200.0, 200.0)])
SMALL = (320, 240)


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


@pytest.fixture(scope="module")
def layup():
    return varied_layup(
        5, SMALL, mold="saddle", pockets=["lobes", "ring", "gaussians", "edge"], severity="any", borders=0, clamp=False
    )


# --- the truth ---


def test_areas_volumes_and_peaks_against_a_fine_grid(layup):
    truth = layup.truth
    assert len(truth.pockets) >= 3
    for p in truth.pockets:
        low, high = p.outline_mm.min(axis=0) - 3, p.outline_mm.max(axis=0) + 3
        step = float(max(high - low)) / 1500
        x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step))
        height = truth.ply_height_above_mold(np.stack([x, y], axis=-1))
        mine = (height > truth.cut_height_mm) & inside(
            np.mean(p.outline_mm, axis=0) + 1.05 * (p.outline_mm[::10] - np.mean(p.outline_mm, axis=0)), x, y
        )
        assert p.area_mm2 == pytest.approx(mine.sum() * step**2, rel=2e-3)
        assert p.volume_mm3 == pytest.approx(height[mine].sum() * step**2, rel=2e-3)
        assert p.peak_mm == pytest.approx(height[mine].max(), abs=1e-3)
        assert truth.ply_height_above_mold(p.centre_mm) == pytest.approx(p.peak_mm, abs=1e-9)
        at_edge = np.abs(distance(layup.ply_outline, *p.outline_mm.T)) < 1.0
        assert p.touches_ply_edge == at_edge.any()
        rim = truth.ply_height_above_mold(p.outline_mm[~at_edge])
        assert np.abs(rim - truth.cut_height_mm).max() < 1e-3


def test_area_and_volume_of_a_paraboloid():
    """10 - r²/90 above 2 is a disc of r² = 720 with a mean height of 6."""
    labels = label_regions(lambda x, y: 10 - (x * x + y * y) / 90, SQUARE, 2.0)
    found = measure(lambda x, y: 10 - (x * x + y * y) / 90, SQUARE, 2.0, labels, 1)
    assert found.area_mm2 == pytest.approx(720 * np.pi, rel=1e-4)
    assert found.volume_mm3 == pytest.approx(720 * np.pi * 6, rel=1e-4)
    assert found.peak_mm == pytest.approx(10, abs=1e-6)


def test_points_inside_are_the_same_where_the_sides_are_split_into_many():
    star = np.array([(0, -9), (2, -2), (9, 0), (2, 2), (0, 9), (-2, 2), (-9, 0), (-2, -2)], dtype=float)
    ahead, share = np.roll(star, -1, axis=0), np.arange(16)[:, None] / 16
    many = np.concatenate([(1 - share) * a + share * b for a, b in zip(star, ahead, strict=True)])
    x, y = np.random.default_rng(0).uniform(-10, 10, (2, 60, 80))
    x[0], y[1] = np.nan, np.nan
    found = inside(many, x, y)
    assert same(found, inside(star, x, y)) and found.shape == x.shape
    assert found[2:].mean() == pytest.approx(72 / 400, abs=0.02) and not found[:2].any()


def test_area_of_a_pocket_that_the_edge_cuts():
    """The same disc about a point on the edge: half of it."""
    labels = label_regions(lambda x, y: 10 - ((x - 200) ** 2 + y * y) / 90, SQUARE, 2.0)
    found = measure(lambda x, y: 10 - ((x - 200) ** 2 + y * y) / 90, SQUARE, 2.0, labels, 1)
    assert found.area_mm2 == pytest.approx(360 * np.pi, rel=2e-3)
    assert found.touches_ply_edge


def test_excess_length_against_quadrature(layup):
    """The longest fibre of each pocket off the edge, by adaptive quadrature of the two curves' arc lengths."""
    truth = layup.truth
    tested = 0
    for p in truth.pockets:
        if p.touches_ply_edge:
            continue
        rows = []
        for angle in np.deg2rad(layup.fibre_angles_deg):
            fibre = np.array([np.cos(angle), np.sin(angle)])
            left = np.array([-fibre[1], fibre[0]])
            along, across = p.outline_mm @ fibre, p.outline_mm @ left
            u = np.arange(along.min() - 150, along.max() + 150, 0.5)
            for line in np.linspace(across.min(), across.max(), 121):
                rows += _stretches(truth, fibre, left * line, u, (along.min(), along.max()))
        rough, fibre, start, first, last = max(rows, key=lambda row: row[0])
        best = quad(lambda u: _more(truth, fibre, start, u), first, last, limit=500, epsabs=1e-5)[0]  # noqa: B023
        assert best == pytest.approx(rough, rel=0.02)
        assert p.excess.any_mm == pytest.approx(best, rel=0.02)
        tested += 1
    assert tested >= 2


def _stretches(truth, fibre, start, u, within):
    """Stretches of a line off the mold that cross a pocket: excess by the midpoint rule, line, and ends."""
    gap = truth.ply_height_above_mold(start + u[:, None] * fibre) - truth.thickness_mm
    off = np.concatenate([[False], gap > 1e-3, [False]])
    firsts, lasts = np.flatnonzero(~off[:-1] & off[1:]), np.flatnonzero(off[:-1] & ~off[1:])
    rows = []
    for first, last in zip(firsts, lasts, strict=True):
        high = gap[first:last] + truth.thickness_mm > truth.cut_height_mm
        inner = (u[first:last] >= within[0]) & (u[first:last] <= within[1])
        if (high & inner).any():
            ends = u[first] - 1, u[last - 1] + 1
            middles = np.arange(ends[0], ends[1], 0.5) + 0.25
            rows.append((float(0.5 * _more(truth, fibre, start, middles).sum()), fibre, start, *ends))
    return rows


def _more(truth, fibre, start, u):
    """Length of the ply's curve less that of the mold's, per mm along a line."""
    u = np.asarray(u)[..., None]

    def slope(height):
        return (height(start + (u + 1e-4) * fibre) - height(start + (u - 1e-4) * fibre)) / 2e-4

    mold = slope(truth.mold_height)
    return np.hypot(1, mold + slope(truth.ply_height_above_mold)) - np.hypot(1, mold)


def test_a_fibre_near_the_edge_is_not_held():
    """A cylinder's segment 60 mm wide: its foot 45 mm from the edge is held, 30 mm from it is not."""

    def found(centre):
        bump = bumps.Wrinkle("wrinkle", (centre, 0.0), np.pi / 2, 5.0, 30.0, np.inf, 3.0)
        ply = Ply(molds.Mold("flat", (lambda x, y: 0 * x,)), SQUARE, 0.3, (bump,))
        labels = label_regions(ply.height_above_mold, SQUARE, 2.0)
        box = label_regions(ply.height_above_mold, SQUARE, 0.303).box(1)
        return excess(ply.height_above_mold, ply.mold.height, SQUARE, 0.3, (0.0, 90.0), labels, 1, box)

    far, near = found(200 - 30 - HELD_MM - 5), found(200 - 30 - HELD_MM + 10)
    exact = quad(lambda v: np.hypot(1, 5 * 6 * v / 900 * (1 - v * v / 900) ** 2) - 1, -30, 30)[0]
    assert far.held_mm == pytest.approx(exact, rel=1e-3)
    assert near.any_mm == pytest.approx(exact, rel=1e-3)
    assert near.held_mm == 0
    assert far.angle_deg == 0


def test_what_was_unseen_is_counted():
    whole = varied_layup(7, SMALL, mold="dome", pockets=3, holes_mm=[], clamp=False, noise=())
    holed = varied_layup(7, SMALL, mold="dome", pockets=3, holes_mm=[100.0] * 8, clamp=False, noise=())
    assert [p.area_mm2 for p in whole.truth.pockets] == [p.area_mm2 for p in holed.truth.pockets]
    assert whole.truth.ply_seen_share > 0.97
    lost = np.isfinite(whole.scan[..., 2]).mean() - np.isfinite(holed.scan[..., 2]).mean()
    assert lost > 0.005
    assert holed.truth.ply_seen_share < whole.truth.ply_seen_share - lost


# --- what is seen ---


@pytest.mark.parametrize("mold", molds.KINDS)
def test_points_lie_on_the_surfaces(mold):
    scene = varied_layup(
        3, SMALL, mold=mold, pockets=["gaussians", "wrinkle"], noise=(), holes_mm=[], clamp=False, borders=1
    )
    assert scene.truth.mold_kind == mold
    t = scene.mold_from_scanner
    f, cx, cy = scene.camera
    for cloud, lifted in ((scene.scan, True), (scene.reference, False)):
        seen = np.isfinite(cloud[..., 2])
        assert seen.mean() > 0.8
        v, u = np.nonzero(seen)
        assert np.abs(cloud[seen][:, 0] / cloud[seen][:, 2] * f + cx - u).max() < 1e-2
        assert np.abs(cloud[seen][:, 1] / cloud[seen][:, 2] * f + cy - v).max() < 1e-2
        p = cloud[seen].astype(float) @ t[:3, :3].T + t[:3, 3]
        z = scene.truth.mold_height(p[:, :2])
        if lifted:
            z = z + scene.truth.ply_height_above_mold(p[:, :2])
        edges = scene.truth.ply.mold.part_outline
        far = np.abs(distance(scene.ply_outline, *p[:, :2].T)) > 0.5
        if edges is not None:
            far &= np.abs(distance(edges, *p[:, :2].T)) > 0.5
        off = np.abs(p[:, 2] - z)[far]
        assert np.quantile(off, 0.999) < 0.5  # white noise of 0.06 at most, on slopes of 45 degrees and more


@pytest.mark.parametrize("mold", ["flanks", "step", "ribs"])
def test_first_hits_against_marching(mold):
    """Steep ground, a tall thin wrinkle and a tilted camera: no ray may pass through matter."""
    rng = np.random.default_rng(4)
    ground = molds.make_mold(rng, mold, SQUARE)
    wrinkle = bumps.Wrinkle("thin", (20.0, 10.0), 1.0, 8.0, 4.0, 80.0, 2.5)
    ply = Ply(ground, SQUARE, 0.3, (wrinkle,))
    stage = Stage(random_camera(rng, (200, 150), SQUARE, 30.0), np.array([900.0, 0.0, 2000.0]), ply, None)
    depth = stage.scan.depth
    dx, dy, dz = stage.camera.directions()
    seen = np.argwhere(np.isfinite(depth))
    for j, i in seen[rng.choice(len(seen), 400, replace=False)]:
        t = np.linspace(depth[j, i] - 60, depth[j, i] - 1e-3, 4000)
        x, y, z = (stage.camera.centre[k] + t * d[j, i] for k, d in enumerate((dx, dy, dz)))
        free = z - np.where(inside(SQUARE, x, y), ply.top(x, y), ground.height(x, y))
        assert free.min() > -1e-3
        end = stage.camera.centre + depth[j, i] * np.array([dx[j, i], dy[j, i], dz[j, i]])
        top = np.where(inside(SQUARE, *end[:2]), ply.top(*end[:2]), ground.height(*end[:2]))
        assert end[2] == pytest.approx(float(top), abs=1e-4)


def test_a_clamp_hides_what_is_behind_it():
    rng = np.random.default_rng(0)
    ply = Ply(molds.Mold("flat", (lambda x, y: 0 * x,)), SQUARE, 0.3, ())
    clamp = Clamp((150.0, 0.0), 0.3, 60.0, 20.0, 25.0)
    stage = Stage(random_camera(rng, (400, 300), SQUARE, 0.0), np.array([500.0, 0.0, 2000.0]), ply, clamp)
    view = stage.scan
    top = view.clamped & np.isfinite(view.depth)
    x, y = stage.at(view.depth)
    u = np.cos(0.3) * (x[top] - 150) + np.sin(0.3) * y[top]
    assert top.sum() > 100
    assert np.abs(u).max() <= 60 + 1e-6
    dz = stage.camera.directions()[2]
    assert np.allclose(stage.camera.centre[2] + view.depth[top] * dz[top], 25.0)
    assert not np.isfinite(view.depth[view.clamped & ~top]).any()


# --- choices ---


def test_the_same_seed_the_same_bits():
    one, two, other = (varied_layup(seed, (128, 96)) for seed in (9, 9, 10))
    assert same(one.scan, two.scan)
    assert same(one.reference, two.reference)
    assert same(one.mold_from_scanner, two.mold_from_scanner)
    assert one.truth.pockets[0].excess == two.truth.pockets[0].excess
    assert not same(one.scan, other.scan)


def test_a_choice_leaves_the_rest_as_it_was():
    one = varied_layup(9, (128, 96), noise=())
    two = varied_layup(9, (128, 96), noise=("banding", "quantised"))
    assert one.truth.bumps == two.truth.bumps
    assert same(one.ply_outline, two.ply_outline)
    assert not same(one.scan, two.scan)


@pytest.mark.parametrize("kind", placing.SHAPES)
def test_every_kind_of_pocket_can_be_had(kind):
    rng = np.random.default_rng(1)
    outline = 2 * SQUARE
    for _ in range(5):
        group = placing.with_excess(placing.SHAPES[kind](rng), 1.5, (0.0, 90.0), 3.4)
        placed = placing.place(rng, kind, group, outline, [])
        assert placed is not None
        ply = Ply(molds.Mold("flat", (lambda x, y: 0 * x,)), outline, 0.3, tuple(placed))
        labels = label_regions(ply.height_above_mold, outline, 2.0)
        assert labels.values.max() >= 1
        x, y = np.meshgrid(np.linspace(-400, 400, 801), np.linspace(-400, 400, 801))
        assert same(ply.gap(x, y), ply.gap_in_image(x, y))
        box = np.array(placed[0].box)
        out = (x < box[0]) | (x > box[2]) | (y < box[1]) | (y > box[3])
        assert placed[0].gap(x[out], y[out]).max(initial=0) < 1e-2  # a box holds the whole foot


def test_random_layups_draw_every_kind():
    kinds, noise = set(), set()
    for seed in range(400):
        kinds.add(str(np.random.default_rng([seed, 1]).choice(list(molds.KINDS))))
        drawn = faults.random_noise(np.random.default_rng([seed, 6]))
        noise |= {name for name, value in vars(drawn).items() if value}
    assert kinds == set(molds.KINDS)
    assert noise == set(vars(faults.Noise()))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"seed": -1}, "seed: expected"),
        ({"pixels": (32, 64)}, "pixels: expected"),
        ({"mold": "wall"}, "mold: expected one of saddle"),
        ({"pockets": ["bell"]}, "pockets: expected one of gaussians"),
        ({"severity": "mild"}, "severity: expected"),
        ({"noise": ["pink"]}, "noise: expected"),
    ],
)
def test_what_cannot_be_chosen_is_named(arguments, words):
    with pytest.raises(InputError, match=words):
        varied_layup(**arguments)


# --- mistakes ---


@pytest.fixture(scope="module", params=["first", "varied"])
def any_layup(request):
    if request.param == "first":
        return scenes.layup(1, SMALL)
    return varied_layup(2, SMALL, clamp=True)


def test_mistakes_have_names_of_their_own():
    names = [m.name for m in MISTAKES]
    assert len(set(names)) == len(names) > 35


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda m: m.name)
def test_a_mistake_changes_something_and_always_the_same(mistake, any_layup):
    right = given_right(any_layup)
    wrong, again = mistake.apply(any_layup, 3), mistake.apply(any_layup, 3)
    changed = [
        name for name in vars(right) if name != "note" and not _equal(getattr(right, name), getattr(wrong, name))
    ]
    assert changed
    assert all(_equal(getattr(wrong, name), getattr(again, name)) for name in vars(right))
    assert same(right.scan, any_layup.scan)  # the layup itself stays as it was


def _equal(a, b):
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return type(a) is type(b) and same(a, b)
    return bool(a == b)


def test_an_offset_lifts_the_scan_along_the_molds_z(any_layup):
    up = next(m for m in MISTAKES if m.name == "a metre up")
    right, wrong = given_right(any_layup), up.apply(any_layup, 0)
    rise = wrong.in_mold(wrong.scan) - right.in_mold(right.scan)
    assert np.nanmax(np.abs(rise - [0, 0, 1000])) < 1e-2


def test_the_next_layer_lies_a_thickness_off(any_layup):
    mistake = next(m for m in MISTAKES if m.name == "reference of another ply")
    right, wrong = given_right(any_layup), mistake.apply(any_layup, 1)
    rise = (wrong.in_mold(wrong.reference) - right.in_mold(right.reference))[..., 2]
    assert np.nanmedian(np.abs(rise)) == pytest.approx(any_layup.truth.thickness_mm, abs=1e-3)


def test_mistakes_can_be_added_up(any_layup):
    by_name = {m.name: m for m in MISTAKES}
    first = by_name["hole over a pocket"].apply(any_layup, 0)
    both = by_name["pose forgotten"].apply(any_layup, 0, given=first)
    assert both == replace(first, mold_from_scanner=None)
