"""The bill of materials names everything that is compiled in, linked or imported, with version and licence."""

import json
import runpy
from pathlib import Path

import numpy as np

from debulk import _core

bill = runpy.run_path(str(Path(__file__).parents[2] / "cmake" / "bill.py"))["bill"]


def test_every_part_has_a_version_and_a_licence():
    tree = json.loads(bill())
    assert (tree["bomFormat"], tree["specVersion"]) == ("CycloneDX", "1.5")
    parts = {part["name"]: part for part in tree["components"] if part["type"] == "library"}
    assert {"Ipopt", "PCL", "Eigen", "NLopt", "MUMPS", "SCOTCH", "Boost", "OpenCV", "NumPy"} <= parts.keys()
    assert all(part["version"] and part["licenses"][0]["license"] for part in parts.values())
    assert parts["Eigen"]["version"] == _core.build_versions()["Eigen"]
    assert parts["NumPy"]["purl"] == f"pkg:pypi/numpy@{np.__version__}"
    assert parts["Ipopt"]["licenses"] == [{"license": {"id": "EPL-1.0"}}]
    assert parts["MUMPS"]["licenses"] == [{"license": {"name": "CeCILL-C"}}]
    assert not {"pytest", "MuJoCo", "GoogleTest", "CMake"} & parts.keys()
    assert not any("(" in name or "," in name for name in parts)
