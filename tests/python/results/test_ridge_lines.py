"""Ridges on a net of 5 by 4 nodes, 10 mm apart: number 5 j + i."""

import dataclasses

import numpy as np
import pytest

from debulk.results.report import PocketNet
from debulk.results.ridge_lines import ridge_lines

LAID = 0.25


def pocket_with(report, peaks, bridges=()):
    i, j = (a.ravel() for a in np.meshgrid(np.arange(5), np.arange(4)))
    number = np.pad(np.arange(20).reshape(4, 5), 1, constant_values=-1)
    neighbours = np.stack([number[1:-1, 2:], number[1:-1, :-2], number[2:, 1:-1], number[:-2, 1:-1]], axis=-1)
    nodes = np.column_stack([10.0 * i, 10.0 * j, np.zeros(20)])
    gap, post = np.zeros(20), np.full(20, LAID)
    gap[list(peaks)], post[list(peaks)] = 3.0, 0.9
    gap[list(bridges)] = post[list(bridges)] = 0.7
    net = PocketNet(
        nodes_mm=nodes, neighbours=neighbours.reshape(20, 4), kinds=np.zeros(20), edges=[(0, 1)],
        inside=np.ones(20),
    )  # fmt: skip
    return dataclasses.replace(
        report.pockets[0], net=net, debulked_mm=nodes, debulked_gap_mm=gap, post_processed_gap_mm=post,
        initial_gap_mm=gap, ridge_nodes=None,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("peaks", "expected"),
    [
        ((), []),
        ((6, 7, 8), [(6, 7), (7, 8)]),
        ((1, 6, 11), [(1, 6), (6, 11)]),
        ((5, 11, 17), [(5, 11), (11, 17)]),  # to the north-east
        ((15, 11, 7), [(7, 11), (11, 15)]),  # to the south-east
        ((6, 7, 12), [(6, 7), (7, 12)]),  # round a corner, not across it
        ((0, 13), [(0,), (13,)]),  # alone
    ],
)
def test_peaks_beside_one_another_are_joined_once(report, peaks, expected):
    lines = ridge_lines(pocket_with(report, peaks))
    found = [tuple(sorted(int(x / 10 + 5 * (y / 10)) for x, y in line)) for line in lines]
    assert sorted(found) == sorted(expected)


def test_a_bridge_is_no_ridge(report):
    assert ridge_lines(pocket_with(report, (), bridges=(6, 7))) == ()
    assert len(ridge_lines(pocket_with(report, (16,), bridges=(6, 7)))) == 1


def test_without_a_minimum_nothing_says_where_it_stands(report):
    assert ridge_lines(report.pockets[5]) == ()
    assert ridge_lines(dataclasses.replace(report.pockets[0], post_processed_gap_mm=None)) == ()
