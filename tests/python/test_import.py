"""`import debulk` stays light: what is heavy is imported where it is first needed."""

import subprocess
import sys

HEAVY = {"cv2", "jinja2", "matplotlib", "open3d", "pydantic", "rich", "scipy", "typer"}


def test_importing_the_package_loads_nothing_heavy(tmp_path):
    script = "import sys, debulk; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    done = subprocess.run([sys.executable, "-W", "error", "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stdout.split())
    assert "debulk" in loaded
    assert loaded & HEAVY == set()
