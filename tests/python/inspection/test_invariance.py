"""A minimum does not depend on where the mold stands, how the nodes are numbered, or on the unit of length."""

from types import SimpleNamespace

import numpy as np
import pytest

from debulk import Recipe, net, sheet, solve, surface

SPACING = 8.0


def ply_of(young_mpa=360.0, thickness_mm=0.3, density_kg_m3=1048.0):
    material = {**Recipe().material.model_dump(), "young_mpa": young_mpa, "thickness_mm": thickness_mm}
    material["density_kg_m3"] = density_kg_m3
    return SimpleNamespace(material=SimpleNamespace(**material), loads=Recipe().loads)


@pytest.fixture(scope="module", params=["dome", "saddle"])
def model(request):
    """A pocket of about a hundred nodes on a curved mold."""
    reach = 45.0
    x = SPACING / 4 * np.arange(-50, 51)
    xx, yy = np.meshgrid(x, x)
    mold = -(xx**2 + yy**2) / 800 if request.param == "dome" else (xx**2 - yy**2) / 600
    bump = 0.6 * SPACING * np.cos(np.pi / 2 * np.minimum(np.hypot(xx, yy) / reach, 1)) ** 2
    reference, ply = (surface.Reference(z, (x[0], x[0]), SPACING / 4) for z in (mold, mold + bump))
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    laid = net.fibre_net(
        ply,
        reference,
        (0.8, -1.6),
        (10, 100),
        spacing_mm=SPACING,
        outline_mm=reach * np.column_stack([np.cos(turn), np.sin(turn)]),
        mold_tol_mm=1e-3 * SPACING,
    )
    return sheet.Sheet(laid.nodes_mm, laid.neighbours, laid.kinds, SPACING, laid.area_mm2, reference, ply_of())


def moved(model):
    reference, by = model.reference, np.array([1024.0, -512.0, 64.0])
    mold = surface.Reference(reference.heights_mm + by[2], np.add(reference.origin_mm, by[:2]), reference.spacing_mm)
    return sheet.Sheet(model.start_mm + by, model.neighbours, model.kinds, SPACING, model.area_mm2, mold, ply_of()), 1.0


def turned(model):
    """A quarter turn: (x, y) to (-y, x)."""
    reference = model.reference
    x0, y0 = reference.origin_mm
    y1 = y0 + (reference.heights_mm.shape[0] - 1) * reference.spacing_mm
    mold = surface.Reference(reference.heights_mm[::-1].T.copy(), (-y1, x0), reference.spacing_mm)
    x, y, z = model.start_mm.T
    nodes = np.column_stack([-y, x, z])
    return sheet.Sheet(nodes, model.neighbours, model.kinds, SPACING, model.area_mm2, mold, ply_of()), 1.0


def renumbered(model):
    order = np.random.default_rng(0).permutation(len(model.start_mm))
    place = np.append(np.argsort(order), -1)  # place[-1]: of no neighbour
    return sheet.Sheet(
        model.start_mm[order],
        place[model.neighbours[order]],
        model.kinds[order],
        SPACING,
        model.area_mm2,
        model.reference,
        ply_of(),
    ), 1.0


def scaled(model):
    """All lengths doubled, under the same pressure and moduli: every energy is eightfold."""
    reference, k = model.reference, 2.0
    mold = surface.Reference(k * reference.heights_mm, np.multiply(k, reference.origin_mm), k * reference.spacing_mm)
    ply = ply_of(thickness_mm=k * 0.3, density_kg_m3=1048.0 / k)
    nodes, area = k * model.start_mm, k**2 * model.area_mm2
    return sheet.Sheet(nodes, model.neighbours, model.kinds, k * SPACING, area, mold, ply), k**3


@pytest.mark.parametrize("change", [moved, turned, renumbered, scaled])
def test_the_minimum_is_the_same(model, change):
    other, scale = change(model)
    assert other.energy(other.start_mm) == pytest.approx(scale * model.energy(model.start_mm), rel=1e-12)
    found, same = solve.minimise(model), solve.minimise(other)
    assert found.certified and same.certified
    assert found.energy_mj < model.energy(model.start_mm) - 1.0  # something happened
    assert same.energy_mj == pytest.approx(scale * found.energy_mj, rel=1e-9)


def test_another_ply_has_another_minimum(model):
    stiffer = sheet.Sheet(
        model.start_mm,
        model.neighbours,
        model.kinds,
        SPACING,
        model.area_mm2,
        model.reference,
        ply_of(young_mpa=3600.0),
    )
    assert solve.minimise(stiffer).energy_mj != pytest.approx(solve.minimise(model).energy_mj, rel=1e-6)
