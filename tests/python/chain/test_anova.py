"""Gauge studies against published worked examples, and components of variance against simulated ones."""

import numpy as np
import pytest

from debulk import InputError
from debulk.chain.anova import crossed
from debulk.chain.kappa import fleiss

# AIAG, Measurement Systems Analysis, 4th edition, chapter III: ten parts, three appraisers, three trials.
MSA = """
 0.29 -0.56 1.34 0.47 -0.80  0.02 0.59 -0.31 2.26 -1.36
 0.41 -0.68 1.17 0.50 -0.92 -0.11 0.75 -0.20 1.99 -1.25
 0.64 -0.58 1.27 0.64 -0.84 -0.21 0.66 -0.17 2.01 -1.31
 0.08 -0.47 1.19 0.01 -0.56 -0.20 0.47 -0.63 1.80 -1.68
 0.25 -1.22 0.94 1.03 -1.20  0.22 0.55  0.08 2.12 -1.62
 0.07 -0.68 1.34 0.20 -1.28  0.06 0.83 -0.34 2.19 -1.50
 0.04 -1.38 0.88 0.14 -1.46 -0.29 0.02 -0.46 1.77 -1.49
-0.11 -1.13 1.09 0.20 -1.07 -0.67 0.01 -0.56 1.45 -1.77
-0.15 -0.96 0.67 0.11 -1.45 -0.49 0.21 -0.49 1.87 -2.16
"""


def msa():
    return np.array(MSA.split(), dtype=float).reshape(3, 3, 10).transpose(2, 0, 1)


def test_the_worked_example_of_the_msa_manual():
    """Its ANOVA table, tables III-B 7a and 8: sums of squares, F, and the components, interaction pooled."""
    study = crossed(msa())
    rows = {row.name: row for row in study.table}
    assert (rows["parts"].df, rows["sessions"].df, rows["parts by sessions"].df) == (9, 2, 18)
    assert rows["parts"].ss == pytest.approx(88.3619, abs=5e-5)
    assert rows["sessions"].ss == pytest.approx(3.1673, abs=5e-5)
    assert rows["parts by sessions"].ss == pytest.approx(0.3590, abs=5e-5)
    assert rows["repeatability"].ss == pytest.approx(2.7589, abs=5e-5)
    assert rows["parts"].f == pytest.approx(492.291, abs=5e-3)
    assert rows["sessions"].f == pytest.approx(79.406, abs=5e-3)
    assert rows["parts by sessions"].f == pytest.approx(0.434, abs=5e-4)
    assert study.pooled
    assert study.repeatability == pytest.approx(0.199933, abs=5e-7)
    assert study.reproducibility == pytest.approx(0.226838, abs=5e-7)
    assert study.interaction == 0
    assert study.grr == pytest.approx(0.302373, abs=2e-6)  # the table adds rounded squares
    assert study.part == pytest.approx(1.042327, abs=5e-7)
    assert study.percent_grr == pytest.approx(27.86, abs=0.01)
    assert study.distinct == 4
    assert study.rating == "marginal"


def test_the_worked_example_of_fleiss():
    """Fourteen raters put ten subjects into five categories: kappa is 0.210."""
    counts = """0 0 0 0 14, 0 2 6 4 2, 0 0 3 5 6, 0 3 9 2 0, 2 2 8 1 1, 7 7 0 0 0, 3 2 6 3 0, 2 5 3 2 2, 6 5 2 1 0,
    0 2 2 3 7"""
    subjects = [[k for k, n in enumerate(map(int, row.split())) for _ in range(n)] for row in counts.split(",")]
    assert fleiss(subjects) == pytest.approx(0.210, abs=5e-4)
    assert fleiss([["cease", "cease"], ["cease", "cease"]]) is None


def test_an_interaction_that_is_there_is_not_pooled():
    rng = np.random.default_rng(3)
    parts, sessions, both = rng.normal(0, 5, (40, 1, 1)), rng.normal(0, 1, (1, 12, 1)), rng.normal(0, 2, (40, 12, 1))
    study = crossed(parts + sessions + both + rng.normal(0, 0.5, (40, 12, 5)), tolerance=30.0)
    assert not study.pooled
    assert study.repeatability == pytest.approx(0.5, rel=0.05)
    assert study.interaction == pytest.approx(2.0, rel=0.1)
    assert study.part == pytest.approx(5.0, rel=0.25)
    assert study.grr == pytest.approx(np.sqrt(study.repeatability**2 + study.reproducibility**2 + study.interaction**2))
    assert study.percent_tolerance == pytest.approx(20 * study.grr)


def test_one_session_tells_repeatability_alone():
    rng = np.random.default_rng(4)
    study = crossed(rng.normal(0, 3, (50, 1, 1)) + rng.normal(0, 0.2, (50, 1, 10)))
    assert [row.name for row in study.table] == ["parts", "repeatability"]
    assert study.repeatability == study.grr == pytest.approx(0.2, rel=0.05)
    assert study.rating == "acceptable"


@pytest.mark.parametrize(
    "values", [np.zeros((1, 3, 3)), np.zeros((3, 3, 1)), np.zeros((3, 3)), np.full((3, 3, 3), np.nan)]
)
def test_what_is_no_study_is_refused(values):
    with pytest.raises(InputError, match="values: expected finite ones"):
        crossed(values)
