import dataclasses

import numpy as np
import pytest

from debulk.results.smoothing import smoothing, smoothing_line

SQUARE = np.array([[-50.0, -40], [250, -40], [250, 160], [-50, 160]])


def crest(turn_deg):
    """A line of 40 mm through (100, 50) that runs so many degrees from +x."""
    way = np.array([np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg)), 0])
    return np.array([100.0, 50, 3]) + np.outer([-20, -5, 20], way)


def ridged(report, turn_deg, mirrored_deg=None):
    """A pocket whose crest runs so, though the section of its net runs along +x."""
    pocket = report.pockets[1]
    ridge = dataclasses.replace(
        pocket.ridges[0],
        polyline_mm=crest(turn_deg),
        direction_deg=turn_deg,
        mirrored_mm=None if mirrored_deg is None else crest(mirrored_deg),
        mirrored_deg=mirrored_deg,
        excess_mm=0.72,
    )
    nodes = pocket.net.nodes_mm.copy()
    nodes[:3, :2] = [[90.0, 50], [100, 50], [110, 50]]
    net = dataclasses.replace(pocket.net, nodes_mm=nodes)
    return dataclasses.replace(pocket, net=net, ridge_nodes=np.array([0, 1, 2]), ridges=(ridge, *pocket.ridges))


@pytest.mark.parametrize(
    ("crest_deg", "across", "edge", "away"),
    [
        (90, 0, None, 150.0),  # as far to the left as to the right
        (0, 90, (100.0, -40.0), 90.0),
        (179.9, 90, (100.0, -40.0), 90.0),
        (135, 45, (10.0, -40.0), 90 * 2**0.5),
        (45, 135, (190.0, -40.0), 90 * 2**0.5),
    ],
)
def test_the_way_is_across_the_crest_and_the_edge_the_nearest_that_way(report, crest_deg, across, edge, away):
    found = smoothing(ridged(report, crest_deg), SQUARE)
    assert found.directions_deg == (pytest.approx(across, abs=0.2),)
    assert found.away_mm == pytest.approx(away, abs=0.01)
    if edge is not None:
        assert found.edge_mm == pytest.approx(edge, abs=0.2)
    assert smoothing_line(found).startswith(
        f"fibres are up to 0.72 mm too long: push across the worst ridge, at {across}°; "
    )


def test_of_two_crests_that_are_as_likely_both_ways_are_said_and_the_nearer_edge(report):
    found = smoothing(ridged(report, 100, 10), SQUARE)
    assert found.directions_deg == (10, 100)
    assert found.away_mm == pytest.approx(90 / np.sin(np.radians(80)))
    assert "at 10° or 100°; the nearest edge that way is 91 mm off" in smoothing_line(found)


def test_a_way_that_rounds_to_half_a_turn_is_none(report):
    assert "at 0°" in smoothing_line(smoothing(ridged(report, 89.8), None))


def test_without_an_outline_no_edge_is_named(report):
    found = smoothing(ridged(report, 30), None)
    assert found.edge_mm is None and "edge" not in smoothing_line(found)


def test_without_a_ridge_nothing_is_said(report):
    assert report.pockets[4].ridges == ()
    assert smoothing(report.pockets[4], SQUARE) is None
    assert smoothing(report.pockets[5], SQUARE) is None
