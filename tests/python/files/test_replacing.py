"""A file that is replaced is there whole, old or new, with its permissions, whatever ends the process."""

import os
import signal
import stat
import subprocess
import sys

import pytest

from debulk import InputError
from debulk.files.replacing import replacing

# Writes a megabyte after the other beside the place, says how far it is, and never ends by itself.
WRITER = """
import sys
from pathlib import Path
from debulk.files.replacing import replacing
with replacing(Path(sys.argv[1])) as temporary, temporary.open("w") as file:
    while True:
        file.write("new" * 350_000)
        file.flush()
        print("written", flush=True)
"""


def test_a_killed_writer_leaves_the_old_file(tmp_path):
    place = tmp_path / "layup.json"
    place.write_text("old")
    with subprocess.Popen([sys.executable, "-c", WRITER, str(place)], stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        for _ in range(3):
            assert writer.stdout.readline() == "written\n"
        writer.send_signal(signal.SIGKILL)
        assert writer.wait() == -signal.SIGKILL
    assert place.read_text() == "old"
    with replacing(place) as temporary:
        temporary.write_text("new")
    assert place.read_text() == "new"


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o640])
def test_a_replaced_file_keeps_its_permissions(tmp_path, mode):
    place = tmp_path / "layup.html"
    place.write_text("old")
    place.chmod(mode)
    with replacing(place) as temporary:
        temporary.write_text("new")
    assert (stat.S_IMODE(place.stat().st_mode), place.read_text()) == (mode, "new")


def test_a_link_keeps_pointing(tmp_path):
    (tmp_path / "archive").mkdir()
    real = tmp_path / "archive" / "layup-7.json"
    real.write_text("old")
    link = tmp_path / "latest.json"
    link.symlink_to(os.path.join("archive", "layup-7.json"))
    with replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink() and real.read_text() == "new"
    assert sorted(p.name for p in tmp_path.rglob("*.part")) == []


def test_a_failed_writer_leaves_nothing(tmp_path):
    place = tmp_path / "layup.csv"
    place.write_text("old")
    with pytest.raises(RuntimeError, match="half way"), replacing(place) as temporary:
        temporary.write_text("ne")
        raise RuntimeError("half way")
    assert [p.name for p in tmp_path.iterdir()] == ["layup.csv"] and place.read_text() == "old"
    with pytest.raises(InputError, match="cannot be written"), replacing(tmp_path / "no" / "a.csv") as temporary:
        temporary.write_text("x")
