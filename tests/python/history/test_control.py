"""The rules of the control charts: what each of them points at, and how often by chance."""

import numpy as np
import pytest

from debulk import InputError
from debulk.history.control import BY_CHANCE, RULES, control

STILL = np.tile([-1.0, 1.0, -0.5, 0.5], 25)  # mean 0, mean moving range 1.49


def after(*figures):
    chart = control(np.concatenate([STILL, figures]), baseline=100)
    return {name: np.flatnonzero(found).tolist() for name, found in chart.signals.items() if found.any()}, chart


def test_the_limits_are_those_of_the_first_figures():
    _, chart = after(50.0, 60.0)
    moving = np.abs(np.diff(STILL)).mean() / 1.128
    assert chart.middle == pytest.approx(0.0) and chart.sigma == pytest.approx(moving)
    assert chart.limits == pytest.approx((-3 * moving, 3 * moving))


@pytest.mark.parametrize(
    ("figures", "expected"),
    [
        ([3.9], {}),
        ([4.0], {"beyond": [100]}),
        ([-4.0], {"beyond": [100]}),
        ([2.7, 0.1, 2.7], {"two of three": [102]}),
        ([2.7, 2.7], {"two of three": [101]}),
        ([2.7, -2.7], {}),
        ([2.7, 0.1, -0.1, 2.7], {}),
        ([-2.7, 0.1, -2.7], {"two of three": [102]}),
        ([-0.2, *[0.3, 0.2] * 4, 0.3], {"shift": [109]}),
        ([-0.2, *[0.3, 0.2] * 4], {}),
        ([0.2, *[-0.3, -0.2] * 5], {"shift": [109, 110]}),
        ([0.4, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5], {"trend": [106]}),
        ([0.4, 0.0, 0.1, 0.2, 0.3, 0.4, 0.1], {}),
    ],
)
def test_a_rule_points_where_it_should(figures, expected):
    assert after(*figures)[0] == expected


def test_layups_without_a_figure_are_passed_over():
    with_gaps = np.insert(np.concatenate([STILL, [9.0]]), [3, 50], np.nan)
    chart = control(with_gaps, baseline=100)
    assert np.flatnonzero(chart.signals["beyond"]).tolist() == [102]


def test_few_or_equal_figures_point_at_nothing():
    few = control(np.append(np.arange(18.0), 1e9))
    assert few.limits is None and not any(found.any() for found in few.signals.values())
    still = control(np.append(np.ones(100), 1e9), baseline=100)
    assert not any(found.any() for found in still.signals.values())
    with pytest.raises(InputError, match="baseline: expected at least 20"):
        control(STILL, baseline=5)


def test_chance_is_as_frequent_as_the_page_says():
    figures = np.random.default_rng(3).normal(size=200_000)
    signals = control(figures, baseline=100_000).signals
    assert list(signals) == list(RULES)
    assert np.any(list(signals.values()), axis=0).mean() == pytest.approx(BY_CHANCE, rel=0.1)
