from __future__ import annotations

import doctest
from collections.abc import Callable
from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.typing import NDArray

import debulk
import debulk.net
import debulk.surface
from debulk.net import drape, fibre_net, surface_area

Floats = NDArray[np.float64]
Reference = debulk.surface.Reference


def ellipse(a: float, b: float, count: int = 120) -> Floats:
    t = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.c_[a * np.cos(t), b * np.sin(t)]


def sampled(height: Callable[[Floats, Floats], Floats], half: float = 90.0, spacing: float = 2.0) -> Reference:
    x = np.arange(-half, half + spacing / 2, spacing)
    return Reference(height(*np.meshgrid(x, x)), (-half, -half), spacing)


def bell(x: Floats, y: Floats) -> Floats:
    r = np.hypot(x / 1.3, y)
    return np.where(r < 40, 9 * np.cos(np.pi * r / 80) ** 2, 0.0)


@pytest.fixture(scope="module")
def mold() -> Reference:
    return sampled(lambda x, y: 0 * x)


@pytest.fixture(scope="module")
def ply() -> Reference:
    return sampled(bell)


def test_fibre_net_is_a_net_of_about_100_nodes_with_consistent_fields(ply: Reference, mold: Reference) -> None:
    outline = ellipse(52, 40)
    net = fibre_net(ply, mold, (0, 0), (10, 95), outline_mm=outline)
    n = len(net.nodes_mm)
    assert abs(n - 100) <= 3
    assert net.nodes_mm.shape == (n, 3) and net.neighbours.shape == (n, 4) and net.lattice.shape == (n, 2)
    assert net.kinds.shape == net.inside.shape == net.shear_deg.shape == (n,)
    assert net.neighbours.dtype == net.edges.dtype == np.int32
    assert net.kinds.dtype == np.int8 and net.inside.dtype == np.bool_
    lengths = np.linalg.norm(np.subtract(*net.nodes_mm[net.edges.T]), axis=1)
    np.testing.assert_allclose(lengths, net.spacing_mm, rtol=1e-9)
    np.testing.assert_allclose(net.nodes_mm[:, 2], ply.height(net.nodes_mm[:, :2]), atol=1e-10)
    for there, back in ((0, 1), (1, 0), (2, 3), (3, 2)):
        i = np.flatnonzero(net.neighbours[:, there] >= 0)
        np.testing.assert_array_equal(net.neighbours[net.neighbours[i, there], back], i)
    assert 2 * len(net.edges) == np.count_nonzero(net.neighbours >= 0)
    within = (net.nodes_mm[:, 0] / 52) ** 2 + (net.nodes_mm[:, 1] / 40) ** 2 < 1
    assert np.count_nonzero(net.inside != within) <= 1  # the outline is a polygon
    np.testing.assert_array_equal(net.kinds, np.where(net.inside, 0, 1))
    assert net.open_ends.size == 0
    assert np.all((net.shear_deg >= 0) & (net.shear_deg < 20))
    flat = np.pi * 52 * 40
    assert flat < net.area_mm2 < 1.2 * flat
    assert net.area_mm2 == pytest.approx(surface_area(ply, outline), rel=1e-12)


def test_the_plys_edge_frees_nodes_and_ends_the_net(ply: Reference, mold: Reference) -> None:
    edge = [(-80, -80), (20, -80), (20, 80), (-80, 80)]
    net = fibre_net(ply, mold, (0, 0), (0, 90), outline_mm=ellipse(52, 40), ply_outline=edge)
    assert net.nodes_mm[:, 0].max() <= 20
    assert np.count_nonzero(net.kinds == 2) > 5 and np.count_nonzero(net.kinds == 1) > 5
    assert net.nodes_mm[net.kinds == 2, 0].min() >= 20 - 20
    assert net.open_ends.size == 0
    rms = fibre_net(ply, mold, (0, 0), (0, 90), outline_mm=ellipse(52, 40), rms_outline_mm=ellipse(20, 20))
    assert 0 < np.count_nonzero(rms.inside) < 30


def test_options_reach_the_core(ply: Reference, mold: Reference) -> None:
    outline = ellipse(52, 40)
    assert abs(len(fibre_net(ply, mold, (5, 3), (0, 90), outline_mm=outline, node_target=250).nodes_mm) - 250) <= 8
    given = fibre_net(ply, mold, (5, 3), (0, 90), 7.5, outline)
    assert given.spacing_mm == 7.5
    plane = fibre_net(ply, mold, (5, 3), (20, 110), 7.5, outline, paths="vertical_plane")
    path = plane.nodes_mm[plane.lattice[:, 1] == 0]
    np.testing.assert_allclose(path[:, 1] - 3, np.tan(np.radians(20)) * (path[:, 0] - 5), atol=1e-9)
    high = fibre_net(ply, mold, (0, 0), (0, 90), 6.0, ellipse(20, 15))
    assert high.open_ends.size > 0
    assert fibre_net(ply, mold, (0, 0), (0, 90), 6.0, ellipse(20, 15), mold_tol_mm=10).open_ends.size == 0
    assert len(fibre_net(ply, mold, (0, 0), (0, 90)).nodes_mm) == pytest.approx(100, abs=5)  # the whole grid
    with pytest.raises(FrozenInstanceError):
        given.spacing_mm = 1.0  # type: ignore[misc]


def test_the_same_net_every_time(ply: Reference, mold: Reference) -> None:
    one, other = (fibre_net(ply, mold, (0, 0), (10, 95), outline_mm=ellipse(52, 40)) for _ in range(2))
    assert one.nodes_mm.tobytes() == other.nodes_mm.tobytes()
    assert one.neighbours.tobytes() == other.neighbours.tobytes()


def test_drape_tells_fibre_angles() -> None:
    plane = sampled(lambda x, y: 0.2 * x - 0.1 * y)
    net = drape(plane, (10, -20), (30, 100), 6.0)
    xy = np.random.default_rng(1).uniform(-90, 90, (4, 25, 2))
    np.testing.assert_allclose(net.angles_deg(xy), np.broadcast_to([30.0, 100.0], (4, 25, 2)), atol=1e-7)
    assert np.isnan(net.angles_deg((500, 0))).all()
    assert net.angles_deg((0, 0)).shape == (2,)
    assert net.inside.sum() == pytest.approx(180 * 180 / 36, rel=0.15)
    # A dome of radius R shears the net by u v / R² (to first order) where it is u and v along the fibres from the seed.
    dome = sampled(lambda x, y: np.sqrt(300.0**2 - x**2 - y**2))
    ply = drape(dome, (0, 0), (0, 90), 3.0, outline_mm=ellipse(80, 80))
    cells = np.abs(ply.lattice).prod(axis=1)
    off_paths = ply.inside & (cells > 0)  # on a path the shear changes its sign
    np.testing.assert_allclose(ply.shear_deg[off_paths], np.degrees(cells[off_paths] * (3.0 / 300) ** 2), atol=0.02)
    assert ply.shear_deg[ply.inside].max() > 1.9
    for xy in [(50, 50), (-50, 50), (-20, -70)]:  # by symmetry, the diagonals stay the fibres' bisectors
        there, mirrored = ply.angles_deg([xy, xy[::-1]])
        np.testing.assert_allclose(there, 90 - mirrored[::-1], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"centre_mm": (np.nan, 0)}, "centre_mm"),
        ({"centre_mm": (70, 0)}, "centre_mm"),
        ({"centre_mm": (1, 2, 3)}, "centre_mm"),
        ({"angles_deg": (10, 15)}, "angles_deg"),
        ({"angles_deg": (10, 190)}, "angles_deg"),
        ({"angles_deg": 45}, "angles_deg"),
        ({"spacing_mm": 0}, "spacing_mm"),
        ({"spacing_mm": -3.0}, "spacing_mm"),
        ({"outline_mm": [(0, 0), (1, 1)]}, "outline_mm"),
        ({"outline_mm": np.zeros((0, 2))}, "outline_mm"),
        ({"outline_mm": np.zeros((5, 3))}, "outline_mm"),
        ({"outline_mm": [(-9, -9), (9, np.nan), (0, 9)]}, "outline_mm"),
        ({"outline_mm": [(-9, -9), (0, 0), (9, 9)]}, "outline_mm"),
        ({"ply_outline": np.zeros((0, 2))}, "ply_outline"),
        ({"ply_outline": [(10, -90), (90, -90), (90, 90)]}, "centre_mm"),
        ({"rms_outline_mm": [(0, 0)]}, "rms_outline_mm"),
        ({"edge_tol_mm": -1}, "edge_tol_mm"),
        ({"mold_tol_mm": 0}, "mold_tol_mm"),
        ({"node_target": 3}, "node_target"),
        ({"paths": "straight"}, "paths"),
    ],
)
def test_bad_input_is_named(ply: Reference, mold: Reference, change: dict[str, object], named: str) -> None:
    arguments: dict[str, object] = {"centre_mm": (0, 0), "angles_deg": (0, 90), "outline_mm": ellipse(52, 40)}
    with pytest.raises(debulk.InputError, match=f"^{named}: expected "):
        fibre_net(ply, mold, **(arguments | change))  # type: ignore[arg-type]


def test_bad_surfaces_are_named(mold: Reference) -> None:
    heights = np.zeros((9, 9))
    with pytest.raises(debulk.InputError, match=r"^surface: expected a debulk.surface.Reference, but got an array"):
        fibre_net(heights, mold, (0, 0), (0, 90))  # type: ignore[arg-type]
    with pytest.raises(debulk.InputError, match=r"^reference: "):
        fibre_net(mold, heights, (0, 0), (0, 90))  # type: ignore[arg-type]
    with pytest.raises(debulk.InputError, match=r"^surface: "):
        drape(heights, (0, 0), (0, 90), 5)  # type: ignore[arg-type]
    with pytest.raises(debulk.InputError, match=r"^surface: "):
        surface_area(heights, ellipse(9, 9))  # type: ignore[arg-type]


def test_bad_drapes_are_named(mold: Reference) -> None:
    with pytest.raises(debulk.InputError, match=r"^seed_mm: "):
        drape(mold, (200, 0), (0, 90), 5)
    with pytest.raises(debulk.InputError, match=r"^angles_deg: "):
        drape(mold, (0, 0), (0, 180), 5)
    with pytest.raises(debulk.InputError, match=r"^spacing_mm: "):
        drape(mold, (0, 0), (0, 90), 1e-3)
    with pytest.raises(debulk.InputError, match=r"^outline_mm: "):
        drape(mold, (0, 0), (0, 90), 5, [(0, 0), (1, 1)])
    with pytest.raises(debulk.InputError, match=r"^xy_mm: "):
        drape(mold, (0, 0), (0, 90), 5).angles_deg([1, 2, 3])
    with pytest.raises(debulk.InputError, match=r"^outline_mm: "):
        surface_area(mold, [(0, 0), (1, 1)])


def test_examples_run() -> None:
    failed, run = doctest.testmod(debulk.net)
    assert run > 10 and failed == 0
