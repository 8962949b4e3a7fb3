import dataclasses

import numpy as np
import pytest

from debulk.results.smoothing import smoothing, smoothing_line

SQUARE = np.array([[-50.0, -40], [250, -40], [250, 160], [-50, 160]])


def ridged(report, turn_deg):
    """A pocket at (100, 50) with a section that runs so many degrees from +x."""
    pocket = report.pockets[1]
    outline = pocket.outline_mm - np.array(pocket.centroid_mm) + [100, 50]
    nodes = pocket.net.nodes_mm.copy()
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    nodes[:3, :2] = np.array([100.0, 50]) + np.outer([-10, 0, 10], [c, s])
    net = dataclasses.replace(pocket.net, nodes_mm=nodes)
    return dataclasses.replace(pocket, outline_mm=outline, net=net, ridge_nodes=np.array([0, 1, 2]))


@pytest.mark.parametrize(
    ("turn", "direction", "edge", "away"),
    [
        (0, 0, None, 150.0),  # as far to the left as to the right
        (90, 90, (100.0, -40.0), 90.0),
        (-90, 90, (100.0, -40.0), 90.0),
        (180, 0, None, 150.0),
        (45, 45, (10.0, -40.0), 90 * 2**0.5),
        (135, -45, (190.0, -40.0), 90 * 2**0.5),
    ],
)
def test_the_direction_is_the_sections_and_the_edge_the_nearest_that_way(report, turn, direction, edge, away):
    found = smoothing(ridged(report, turn), SQUARE)
    assert round(found.direction_deg) % 180 == direction % 180
    assert found.away_mm == pytest.approx(away)
    if edge is not None:
        assert found.edge_mm == pytest.approx(edge)
    assert f"{direction}°" in smoothing_line(found) and "-90°" not in smoothing_line(found)
    assert found.excess_mm == report.pockets[1].excess_length_mm


def test_without_an_outline_no_edge_is_named(report):
    found = smoothing(ridged(report, 30), None)
    assert found.edge_mm is None and "edge" not in smoothing_line(found)


def test_without_a_ridge_nothing_is_said(report):
    assert smoothing(report.pockets[1], SQUARE) is None
    assert smoothing(report.pockets[5], SQUARE) is None
