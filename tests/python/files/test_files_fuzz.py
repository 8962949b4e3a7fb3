"""Whatever becomes of a file: a cloud or one InputError, and no more memory than the file's size warrants."""

import os
import random
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cloud_files as made
from debulk import InputError, files

HERE = Path(__file__).resolve().parent
POINTS = np.random.default_rng(1).normal(0, 300, (5, 8, 3)).astype(np.float32)
POINTS[1, 2:5] = np.nan
FILES = [
    *made.all_kinds(POINTS),
    *made.of_producers(POINTS),
    *made.unorganised_of_producers(POINTS),
    ("leica.ptx", made.ptx(np.where(np.isfinite(POINTS).all(axis=2)[..., None], POINTS, 0))),
]
BIG = (
    b"4294967295",
    b"-1",
    b"99999999999",
    b"0",
    b"1e9",
    b"nan",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b" ",
    b"\n",
    b",",
)


def check(path, data):
    """Load the bytes; say whether they were a cloud."""
    path.write_bytes(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", files.CloudWarning)
            points = files.load_cloud(path)
    except InputError as error:
        assert str(error).startswith(str(path)) and "\n" not in str(error)
        return False
    assert points.ndim in (2, 3) and points.shape[-1] == 3 and points.size
    assert points.flags.c_contiguous and points.nbytes <= 1100 * len(data)
    if points.dtype == np.float64:  # all points lie far away along an axis
        flat = np.abs(points.reshape(-1, 3))
        assert (np.fmin.reduce(flat) > 2**15).any() and np.nanmax(flat) <= 1e10
    else:
        assert points.dtype == np.float32 and np.nanmax(np.abs(points)) <= 1e7
    return True


def mutated(data, changes):
    data = bytearray(data)
    for kind, place, value in changes:
        if not data:
            break
        # Headers decide: half of the changes are made near the start.
        at = int(place * (min(len(data), 300) if value % 2 else len(data)))
        match kind:
            case "byte":
                data[min(at, len(data) - 1)] = value % 256
            case "bit":
                data[min(at, len(data) - 1)] ^= 1 << value % 8
            case "cut":
                del data[at:]
            case "drop":
                del data[at : at + 1 + value % 40]
            case "repeat":
                data[at:at] = data[at : at + 1 + value % 200]
            case "number":
                data[at : at + value % 6] = BIG[value % len(BIG)]
    return bytes(data)


KINDS = ("byte", "bit", "cut", "drop", "repeat", "number")
CHANGE = st.tuples(st.sampled_from(KINDS), st.floats(0, 1), st.integers(0, 1 << 16))


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(file=st.sampled_from(FILES), changes=st.lists(CHANGE, max_size=5))
def test_changed_files_give_a_cloud_or_one_error(tmp_path, file, changes):
    name, data = file
    assert check(tmp_path / name, mutated(data, changes)) or changes


@pytest.mark.parametrize(("name", "data"), FILES, ids=[name for name, _ in FILES])
def test_files_cut_anywhere(tmp_path, name, data):
    text = name.endswith(made.TEXT_ENDINGS) and not name.startswith(
        "counted"
    )  # whose end, at a line's, nobody can tell
    for length in [*range(0, len(data), 11), len(data) - 1]:
        loaded = check(tmp_path / name, data[:length])
        # The last newline of a text may be missing, and so may the zeros that pad a file.
        spare = 4096 if name == "padded.pcd" else 20 if name.startswith(("ascii", "counted", "leica")) else 0
        assert not loaded or text or length >= len(data) - spare


ROUNDS = int(os.environ.get("DEBULK_FUZZ_ROUNDS", "1500"))


def many_rounds(folder, rounds, seed):
    """Change files at random; return how many were clouds still."""
    rng = random.Random(seed)
    clouds = 0
    for _ in range(rounds):
        name, data = rng.choice(FILES)
        changes = [(rng.choice(KINDS), rng.random(), rng.randrange(1 << 16)) for _ in range(rng.randrange(1, 6))]
        clouds += check(Path(folder) / name, mutated(data, changes))
    return clouds


@pytest.mark.program
def test_no_change_makes_a_reader_take_much_memory(tmp_path):
    script = (
        "import resource, sys\n"
        f"sys.path[:0] = [{str(HERE)!r}, {str(HERE.parent)!r}]\n"
        "import test_files_fuzz as fuzz\n"
        "[fuzz.check(fuzz.Path(sys.argv[1]) / name, data) for name, data in fuzz.FILES]\n"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024\n"
        f"before = peak(); clouds = fuzz.many_rounds(sys.argv[1], {ROUNDS}, 7); after = peak()\n"
        "print(clouds, after - before)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    clouds, grown_mb = map(float, done.stdout.split())
    assert 0 < clouds < ROUNDS
    assert grown_mb < 40
