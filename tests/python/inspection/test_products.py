"""Products without BLAS: the right figures, and no thread of its own beside an inspection."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from debulk.inspection.clouds.products import affine, product

INSPECT = """
import os
import time
import numpy as np
ours = str(os.getpid())
before = [t for t in os.listdir("/proc/self/task") if t != ours]  # what numpy started: BLAS's
import debulk
layup = debulk.scenes.layup(seed=4, pixels=(1280, 960))
inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
ran = lambda: sum(int(open(f"/proc/self/task/{t}/schedstat").read().split()[0]) for t in before)
time.sleep(1)  # the inspector's preparation may have woken them: they go to sleep a little later
start = ran()
inspector.inspect(layup.scan)
print(len(before), ran() - start)
"""


@pytest.mark.parametrize("shape", [(7,), (7, 1), (7, 4)])
def test_products(shape):
    rng = np.random.default_rng(1)
    rows, factors = rng.standard_normal((5000, 7)), rng.standard_normal(shape)
    np.testing.assert_allclose(product(rows, factors), rows @ factors, rtol=0, atol=1e-12)


def test_products_of_no_rows():
    assert product(np.empty((0, 3)), np.eye(3)).shape == (0, 3)


@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="only Linux tells how long a thread ran")
def test_an_inspection_leaves_the_threads_of_blas_asleep():
    told = subprocess.run(
        [sys.executable, "-c", INSPECT],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=True,
    )
    threads, ns = map(int, told.stdout.split())
    if not threads:
        pytest.skip("a numpy whose BLAS starts no threads when it is imported")
    assert ns == 0


def test_a_plane_in_closed_form_is_that_of_least_squares():
    rng = np.random.default_rng(5)
    places, values = rng.normal(300.0, 40.0, (500, 2)), rng.normal(0.0, 1.0, (500, 2))
    expected = np.linalg.lstsq(np.column_stack([places, np.ones(500)]), values, rcond=None)[0]
    assert np.allclose(affine(places, values), expected, rtol=1e-9, atol=1e-9)


def test_places_on_one_line_or_at_one_place_have_the_slope_that_they_tell():
    along = np.linspace(-1.0, 1.0, 9)[:, None]
    line = np.hstack([3.0 * along, 4.0 * along]) + 100.0  # the slope is 2 per mm along the line
    assert np.allclose(affine(line, 10.0 * along)[:2, 0], (1.2, 1.6))
    assert np.array_equal(affine(np.ones((4, 2)), np.full((4, 1), 7.0))[:, 0], (0.0, 0.0, 7.0))
