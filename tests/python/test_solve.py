"""The solve and its certificate, checked by a second hand: scipy's least squares on plain formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from debulk import InputError, Recipe, net, scenes, sheet, solve, surface


def bell_pocket(height=6.0, radius=40.0, seed=0, away=0.0):
    """A net on a bell over a gently curved mold, as the pipeline would lay it."""
    x = np.arange(-90.0, 91.0, 2.0)
    xx, yy = np.meshgrid(x, x)
    mold = xx**2 / 8000 + yy**2 / 6000
    r = np.hypot(xx, yy)
    bell = np.where(r < radius, height * np.cos(np.pi * r / (2 * radius)) ** 2, 0.0)
    origin = (away - 90.0, 0.5 * away - 90.0)
    reference = surface.Reference(mold + away, origin, 2.0)
    ply = surface.Reference(mold + bell + away, origin, 2.0)
    angle = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    outline = 0.93 * radius * np.column_stack([np.cos(angle), np.sin(angle)]) + (away, 0.5 * away)
    laid = net.fibre_net(
        ply, reference, (away + 0.3, 0.5 * away - 0.2), (10.0 + seed, 100.0 + seed), outline_mm=outline
    )
    model = sheet.Sheet(laid.nodes_mm, laid.neighbours, laid.kinds, laid.spacing_mm, laid.area_mm2, reference)
    return laid, model, reference


@pytest.fixture(scope="module", params=["interior_point", "ipopt"])
def solved(request):
    laid, model, reference = bell_pocket()
    return laid, model, reference, solve.minimise(model, request.param)


def test_is_certified(solved):
    _, _, _, solution = solved
    assert solution.certified, solution.certificate.failure
    assert solution.status == "converged"
    assert solution.energy_mj < 0


@pytest.mark.parametrize(
    ("term", "settings"),
    [
        ("torsion", {"material": {"torsion_n_mm": 0.36}}),
        ("in_plane_bending", {"material": {"in_plane_bending_n_mm": 36.0}}),
        ("tack", {"material": {"tack_n_mm3": 1.0}}),
        ("vacuum", {"loads": {"pressure_direction": "normal"}}),
    ],
)
def test_an_optional_term_is_there_if_asked_for_and_leaves_the_minimum_certified(term, settings):
    laid, plain, reference = bell_pocket()
    kinds = np.where((laid.kinds == 1) & (laid.nodes_mm[:, 0] > 0), 2, laid.kinds)  # half the rim at the ply's edge
    of = (laid.nodes_mm, laid.neighbours, kinds, laid.spacing_mm, laid.area_mm2, reference)
    model = sheet.Sheet(*of, Recipe(**settings))
    assert set(model.terms(model.start_mm)) == {*plain.terms(plain.start_mm), term}
    solution = solve.minimise(model)
    assert solution.certified, solution.certificate.failure
    terms = model.terms(solution.nodes_mm)
    assert terms[term] > 0
    signed = [-mj if name in ("gravity", "vacuum") else mj for name, mj in terms.items()]
    assert solution.energy_mj == pytest.approx(sum(signed), rel=1e-9)
    assert solution.energy_mj != pytest.approx(solve.minimise(sheet.Sheet(*of)).energy_mj, rel=1e-9)


def test_kkt_error_by_a_second_hand(solved):
    laid, model, reference, solution = solved
    x = solution.nodes_mm
    movable = np.flatnonzero(laid.kinds != 1)
    place = {node: 3 * k for k, node in enumerate(movable)}
    columns = []
    for i, j in laid.edges:
        column = np.zeros(3 * len(movable))
        along = (x[i] - x[j]) / np.linalg.norm(x[i] - x[j])
        if i in place:
            column[place[i] : place[i] + 3] = along
        if j in place:
            column[place[j] : place[j] + 3] = -along
        columns.append(column)
    lengths = len(columns)
    gaps = model.gaps(x)
    for node in movable:
        if gaps[node] <= 1e-3:
            column = np.zeros(3 * len(movable))
            column[place[node] : place[node] + 3] = (*-reference.gradient(x[node, :2]), 1.0)
            columns.append(column)
    gradient = model.gradient(x)[movable].ravel()
    matrix = np.array(columns).T
    lower = np.r_[np.full(lengths, -np.inf), np.zeros(matrix.shape[1] - lengths)]
    fit = lsq_linear(matrix, gradient, bounds=(lower, np.inf), tol=1e-14, max_iter=2000)
    residual = np.abs(gradient - matrix @ fit.x).max() / model.nodal_force_n
    assert residual < 1e-4
    assert solution.kkt_error < 1e-4
    assert gaps[movable].min() > -1e-3
    assert np.abs(model.lengths(x) / laid.spacing_mm - 1).max() == pytest.approx(solution.length_error, abs=1e-12)


@pytest.mark.slow
def test_no_small_move_within_the_constraints_lowers_the_energy(solved):
    """Tangential moves projected back on the constraints by Newton: a minimum, felt by hand."""
    laid, model, _, solution = solved
    rng = np.random.default_rng(1)
    movable = laid.kinds != 1
    for _ in range(5):
        x = solution.nodes_mm.copy()
        x[movable] += 1e-3 * rng.standard_normal((movable.sum(), 3))
        for _ in range(30):
            d = x[laid.edges[:, 0]] - x[laid.edges[:, 1]]
            length = np.linalg.norm(d, axis=1)
            jacobian = np.zeros((len(d), x.size))
            for k, (i, j) in enumerate(laid.edges):
                jacobian[k, 3 * i : 3 * i + 3] = d[k] / length[k]
                jacobian[k, 3 * j : 3 * j + 3] = -d[k] / length[k]
            jacobian[:, np.repeat(~movable, 3)] = 0
            x += np.linalg.lstsq(jacobian, laid.spacing_mm - length, rcond=1e-10)[0].reshape(-1, 3)
            below = np.maximum(0, -model.gaps(x)) * movable
            x[:, 2] += below
            if not below.any() and np.abs(model.lengths(x) / laid.spacing_mm - 1).max() < 1e-10:
                break
        assert np.abs(model.lengths(x) / laid.spacing_mm - 1).max() < 1e-8
        assert model.energy(x) > solution.energy_mj - 1e-4


def test_the_initial_net_and_a_truncated_solve_are_not_certified():
    laid, model, _ = bell_pocket()
    initial = solve.certify(model, laid.nodes_mm)
    assert not initial.certified
    assert "first-order" in initial.failure
    for method in solve.methods():
        truncated = solve.minimise(model, method, max_iterations=5)
        assert truncated.status == "iteration_limit"
        assert not truncated.certified


def test_a_moved_solution_is_not_certified():
    laid, model, _ = bell_pocket()
    x = solve.minimise(model).nodes_mm
    for what, change in [("length", (0.5, 0, 0)), ("penetration", (0, 0, -0.5))]:
        moved = x.copy()
        inner = np.flatnonzero(laid.kinds == 0)
        moved[inner[np.argmin(model.gaps(x)[inner])]] += change
        certificate = solve.certify(model, moved)
        assert not certificate.certified
        assert what in certificate.failure


def test_starts_are_seeded_and_ordered():
    _, model, _ = bell_pocket(height=8.0)
    one = solve.minimise(model, starts=4, seed=7)
    same = solve.minimise(model, starts=4, seed=7)
    other = solve.minimise(model, starts=4, seed=8)
    assert len(one.minima) == 4
    assert all(a.nodes_mm.tobytes() == b.nodes_mm.tobytes() for a, b in zip(one.minima, same.minima, strict=True))
    assert one.minima[0].nodes_mm.tobytes() == other.minima[0].nodes_mm.tobytes()
    assert one.minima[1].nodes_mm.tobytes() != other.minima[1].nodes_mm.tobytes()
    assert one.energy_mj == min(m.energy_mj for m in one.minima if m.certified)


def test_both_methods_find_minima_of_like_energy():
    """Many minima lie close together: the methods need not find the same one, but neither may be far off."""
    for seed in range(3):
        _, model, _ = bell_pocket(height=5.0, radius=45.0, seed=20 * seed)
        own, ipopt = (solve.minimise(model, m, starts=3) for m in ("interior_point", "ipopt"))
        assert own.certified
        assert ipopt.certified
        assert own.energy_mj == pytest.approx(ipopt.energy_mj, rel=0.05)


def test_ten_kilometres_from_the_origin():
    _, here, _ = bell_pocket()
    laid, there, _ = bell_pocket(away=1e7)
    solution = solve.minimise(there, starts=2)
    assert solution.certified, solution.certificate.failure
    assert solution.energy_mj == pytest.approx(
        solve.minimise(here, starts=2).energy_mj, rel=0.1
    )  # another net, a hair away
    assert solution.nodes_mm[laid.kinds == 1].tobytes() == laid.nodes_mm[laid.kinds == 1].tobytes()


def test_a_deadline_stops_the_solve():
    _, model, _ = bell_pocket()
    late = solve.minimise(model, deadline_s=1e-9)
    assert late.status == "deadline"
    assert not late.certified


def test_one_movable_node_between_four_fixed_ones_is_refused():
    reference = surface.Reference(np.zeros((4, 4)), (-20.0, -20.0), 15.0)
    nodes = [[0, 0, 0], [5, 0, 0], [-5, 0, 0], [0, 5, 0], [0, -5, 0]]
    neighbours = [[1, 2, 3, 4], [-1, 0, -1, -1], [0, -1, -1, -1], [-1, -1, -1, 0], [-1, -1, 0, -1]]
    model = sheet.Sheet(nodes, neighbours, [0, 1, 1, 1, 1], 5.0, 50.0, reference)
    solution = solve.minimise(model)
    assert solution.status == "too_few_movable_nodes"
    assert not solution.certified


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"method": "newton"}, "method"),
        ({"starts": 0}, "starts"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"stiffness": -1.0}, "stiffness"),
        ({"start": np.zeros((3, 3))}, "one point a node"),
        ({"start": np.zeros((3, 2))}, "(N, 3)"),
    ],
)
def test_bad_options_are_named(change, word):
    _, model, _ = bell_pocket()
    with pytest.raises(InputError) as caught:
        solve.minimise(model, **change)
    assert word in str(caught.value)


def test_sheet_names_what_is_wrong():
    reference = surface.Reference(np.zeros((4, 4)), (-20.0, -20.0), 15.0)
    nodes = np.array([[0.0, 0, 0], [5, 0, 0], [10, 0, 0]])
    neighbours = np.array([[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]])
    for given, word in [
        ((nodes[:, :2], neighbours, [1, 0, 1], 5.0, 100.0), "nodes_mm"),
        ((nodes, neighbours[:2], [1, 0, 1], 5.0, 100.0), "neighbours"),
        ((nodes, neighbours, [1, 0, 3], 5.0, 100.0), "kinds"),
        ((nodes, neighbours, [1, 0], 5.0, 100.0), "kinds"),
        ((nodes, neighbours, [1, 0, 1], -5.0, 100.0), "spacing_mm"),
        ((nodes, neighbours, [1, 0, 1], 5.0, 0.0), "area_mm2"),
    ]:
        with pytest.raises(InputError, match=word):
            sheet.Sheet(*given, reference)


@pytest.mark.layup
def test_all_pockets_of_a_layup_are_refereed_by_ipopt():
    from debulk import Recipe, inspect

    layup = scenes.layup(4, (640, 480))
    report = inspect(
        layup.scan,
        layup.reference,
        Recipe(solve={"method": "ipopt", "starts": 1}),
        layup.ply_outline,
        mold_from_scanner=layup.mold_from_scanner,
    )
    assert all(p.solve.certified for p in report.pockets)
