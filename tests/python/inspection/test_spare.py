"""What a net has to spare is measured when a fold may reach it, and once."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from debulk.inspection.spare import SpareNet
from debulk.net import Net
from debulk.results.report import ExcessReport


def test_the_excess_is_measured_once_and_only_when_it_is_asked_for() -> None:
    asked = []

    def measure() -> ExcessReport:
        asked.append(1)
        return cast(ExcessReport, SimpleNamespace(length_mm=0.6, missed_mm=0.1, at_spacing_mm=0.5, uncertainty_mm=0.02))

    recipe: Any = None  # says how uncertain an excess is that is not known
    spare = SpareNet(cast(Net, None), 5.0, np.zeros((0, 2)), 0.0, 0.5, measure)
    assert not asked
    assert spare.scale == pytest.approx(1.6)
    assert spare.most_mm(recipe) == pytest.approx(0.5 * 1.6 + 2 * 0.02)
    assert len(asked) == 1
