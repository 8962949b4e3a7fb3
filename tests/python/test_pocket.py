from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import debulk
from debulk import pocket
from debulk.grid import Grid
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.minima.laid_pocket import lay_net
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.surface import HeightMap

ORIGIN = np.array([-10.0, 20.0])
THICKNESS = 0.3


def bells(*parameters: tuple[float, float, float, float], shape: tuple[int, int] = (240, 300)) -> Grid:
    """The higher of cos² bells (x, y, height, radius) on a 0.5 mm grid, a ply's thickness above the reference."""
    grid = Grid(np.zeros(shape, np.float32), ORIGIN, 0.5)
    x, y = np.meshgrid(grid.x_mm, grid.y_mm)
    for cx, cy, height, radius in parameters:
        bell = height * np.cos(np.pi / 2 * np.minimum(np.hypot(x - cx, y - cy) / radius, 1)) ** 2
        np.maximum(grid.values, bell.astype(np.float32), out=grid.values)
    grid.values[...] += np.float32(THICKNESS)
    return grid


def radius_at(level: float, height: float, radius: float) -> float:
    return float(2 / np.pi * np.arccos(np.sqrt(level / height)) * radius)


def test_finds_two_bells_in_order_of_area() -> None:
    found = pocket.segment(bells((20, 50, 5, 25), (90, 80, 8, 40)))
    assert [p.id for p in found.pockets] == [1, 2]
    large, small = found.pockets
    r = radius_at(2 - THICKNESS, 8, 40)
    assert large.area_mm2 == pytest.approx(np.pi * r**2, rel=1e-3)
    assert pocket.polygon_area(large.outline_mm) == large.area_mm2
    np.testing.assert_allclose(large.centroid_mm, (90, 80), atol=0.02)
    np.testing.assert_allclose(large.peak_position_mm, (90, 80), atol=0.5)
    np.testing.assert_allclose(large.box_mm, [[90 - r, 80 - r], [90 + r, 80 + r]], atol=0.05)
    assert large.peak_mm == pytest.approx(8.3, abs=0.01)
    assert small.peak_mm == pytest.approx(5.3, abs=0.01)
    assert large.measured_share == 1
    assert not large.touches_ply_edge
    assert not large.touches_unknown
    assert found.labels.values.dtype == np.int32
    assert set(np.unique(found.labels.values)) == {0, 1, 2}
    assert np.count_nonzero(found.labels.values == 1) * 0.25 == pytest.approx(large.area_mm2, rel=0.02)
    np.testing.assert_array_equal(found.labels.origin_mm, ORIGIN)
    r_volume = large.volume_mm3 / large.area_mm2
    assert 2 < r_volume < 8.3
    with pytest.raises(ValueError, match="read-only"):
        found.labels.values[0, 0] = 1


def test_says_what_was_dropped_and_why() -> None:
    found = pocket.segment(bells((20, 50, 5, 12), (90, 80, 2.5, 40), (20, 100, 1.69, 20)))
    assert found.pockets == []
    assert [d.reason for d in found.dropped] == ["peak", "area"]
    assert found.dropped[0].peak_mm == pytest.approx(2.8, abs=0.01)
    assert found.dropped[1].area_mm2 < 200
    loose = pocket.segment(bells((20, 50, 5, 12), (90, 80, 2.5, 40)), area_tol_mm2=20, peak_tol_mm=0.5)
    assert len(loose.pockets) == 2


def test_ends_at_the_edge_of_the_ply() -> None:
    heights = bells((60.1, 80, 8, 40))
    outline = [[0, 25], [60.1, 25], [60.1, 135], [0, 135]]
    whole, half = pocket.segment(heights).pockets[0], pocket.segment(heights, ply_outline=outline).pockets[0]
    assert half.area_mm2 == pytest.approx(whole.area_mm2 / 2, rel=3e-3)
    assert half.volume_mm3 == pytest.approx(whole.volume_mm3 / 2, rel=3e-3)
    assert half.touches_ply_edge
    assert np.isnan(pocket.segment(heights, ply_outline=outline).heights.values[100, 200])


def test_counts_measured_points_by_the_mask() -> None:
    plain = bells((60, 80, 8, 40))
    mask: NDArray[np.bool_] = np.ones(plain.values.shape, bool)
    mask[: int((80 - 20) / 0.5)] = False
    assert pocket.segment(plain).pockets[0].measured_share == 1.0
    (half,) = pocket.segment(HeightMap(plain.values, ORIGIN, 0.5, mask)).pockets
    assert half.measured_share == pytest.approx(0.5, abs=0.02)
    with pytest.raises(debulk.InputError, match="measured"):
        pocket.segment(HeightMap(plain.values, ORIGIN, 0.5, mask[1:]))


def test_feet_come_down_to_the_mold() -> None:
    feet = pocket.feet(pocket.segment(bells((60, 80, 8, 40))))
    assert feet.mold_tol_mm == 0.2
    assert feet.noise_mm < 1e-3
    foot = feet.feet[0]
    assert foot.id == 1
    assert foot.closed
    assert not foot.parted
    assert foot.area_mm2 == pytest.approx(np.pi * radius_at(0.2, 8, 40) ** 2, rel=4e-3)
    noisy = bells((60, 80, 8, 40))
    noisy.values[...] += np.random.default_rng(1).normal(0, 0.1, noisy.values.shape).astype(np.float32)
    assert pocket.height_noise(noisy) == pytest.approx(0.1, rel=0.05)
    assert pocket.feet(pocket.segment(noisy)).mold_tol_mm == pytest.approx(0.3, rel=0.05)


def test_patch_joins_the_net_surface_to_the_reference() -> None:
    surface = pytest.importorskip("debulk.surface")
    reference = surface.Reference(np.full((8, 8), 5.0), (-100, -100), 50.0)
    found = pocket.segment(bells((60, 80, 8, 40)))
    feet = pocket.feet(found)
    patch = pocket.patch(found, feet, 1, reference, margin_mm=25)
    excess = patch.surface.values - patch.reference.values
    assert patch.closed
    np.testing.assert_allclose(patch.reference.values, 5)
    assert excess.max() == pytest.approx(8, abs=0.02)
    assert excess.min() == 0
    assert np.all(excess[[0, -1]] == 0)
    assert np.all(excess[:, [0, -1]] == 0)
    assert patch.surface.origin_mm[0] <= patch.outline_mm[:, 0].min() - 25
    glued = pocket.patch(found, feet, 1, reference, mode="paper")
    np.testing.assert_array_equal(glued.outline_mm, found.pockets[0].outline_mm)
    step = glued.surface.values - glued.reference.values
    assert step[step > 0].min() >= 1.9
    with pytest.raises(debulk.InputError, match="mode"):
        pocket.patch(found, feet, 1, reference, mode="glue")  # type: ignore[arg-type]
    with pytest.raises(debulk.InputError, match="pocket_id"):
        pocket.patch(found, feet, 2, reference)


def test_polygon_helpers() -> None:
    square = [[0, 0], [2, 0], [2, 2], [0, 2]]
    assert pocket.polygon_area(square) == 4
    assert pocket.inside(square, [[1, 1], [3, 1]]).tolist() == [True, False]
    np.testing.assert_allclose(pocket.distance_to_outline(square, [[1, 1], [5, 6]]), [1, 5])
    with pytest.raises(debulk.InputError, match="xy_mm"):
        pocket.inside(square, [1, 1])
    with pytest.raises(debulk.InputError, match="outline_mm"):
        pocket.polygon_area([[1, 2, 3]])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("cut_height_mm", 0.0),
        ("cut_height_mm", float("nan")),
        ("area_tol_mm2", -1.0),
        ("peak_tol_mm", -0.1),
        ("edge_tol_mm", -1.0),
        ("bridge_mm", float("inf")),
        ("ply_outline", [[0, 0], [1, 1]]),
        ("ply_outline", [[0, 0, 0], [1, 1, 1]]),
        ("ply_outline", [[0, 0], [1, 0], [float("nan"), 1]]),
    ],
)
def test_names_a_wrong_option(name: str, value: Any) -> None:
    with pytest.raises(debulk.InputError, match=name):
        pocket.segment(bells(), **{name: value})


def test_names_a_wrong_height_map() -> None:
    with pytest.raises(debulk.InputError, match=r"height_map: expected a debulk\.Grid, but got an array"):
        pocket.segment(np.zeros((5, 5)))  # type: ignore[arg-type]
    with pytest.raises(debulk.InputError, match="height_map"):
        pocket.segment(Grid(np.zeros((5, 5, 2), np.float32), ORIGIN, 1.0))
    with pytest.raises(debulk.InputError, match="origin_mm"):
        pocket.segment(Grid(np.zeros((5, 5), np.float32), np.zeros(3), 1.0))
    with pytest.raises(debulk.InputError, match="spacing"):
        pocket.segment(Grid(np.zeros((5, 5), np.float32), ORIGIN, 0.0))
    found = pocket.segment(bells((60, 80, 8, 40)))
    for option in ({"thickness_mm": -1.0}, {"mold_tol_mm": 0.0}, {"smooth_mm": -1.0}, {"noise_mm": float("nan")}):
        with pytest.raises(debulk.InputError, match=next(iter(option))):
            pocket.feet(found, **option)
    with pytest.raises(debulk.InputError, match="below the cut height"):
        pocket.feet(found, mold_tol_mm=1.9)


def test_feet_and_nets_end_when_stopped() -> None:
    stop = debulk._core.Stop()
    stop.cancel()
    found = pocket.segment(bells((90, 80, 8, 40)))
    with pytest.raises(debulk._core.Stopped):
        pocket.feet(found, stop=stop)
    feet, mold = pocket.feet(found), debulk.surface.Reference(np.zeros((8, 8)), (-50, -50), 50.0)
    given = FoundPocket(1, found, feet, 0, None), PlyOnMold(mold, None, np.array([0.0, 90.0]), debulk.Recipe())
    with pytest.raises(debulk._core.Stopped):
        lay_net(*given, stop)
    assert len(lay_net(*given).nodes_mm) > 90
