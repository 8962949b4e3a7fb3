"""The doctor: its facts are facts, its self-test can fail."""

import numpy as np
import pytest
from typer.testing import CliRunner

import debulk
from debulk import _core, solve
from debulk.cli import app
from debulk.doctor import DoctorReport, doctor, memory_bandwidth, self_test

pytestmark = pytest.mark.program


@pytest.fixture(scope="module")
def found() -> DoctorReport:
    return doctor()


def test_facts(found):
    assert found.passed
    assert found.versions["debulk"] == debulk.__version__
    assert found.versions["numpy"] == np.__version__
    assert found.versions["Ipopt"].startswith("3.")
    assert {"Eigen", "PCL", "Boost", "compiler", "Python"} <= set(found.versions)
    assert found.threads == _core.default_threads() >= 1
    assert found.cores >= 1
    assert found.instruction_set.startswith(("x86-64-v", "no x86-64"))
    assert 0.05 < found.bandwidth_gb_s < 5000


def test_licences_of_everything_linked(found):
    licences = {entry.what: entry.licence for entry in found.licences}
    assert licences["Eigen"] == "MPL-2.0"
    assert licences["Ipopt"] == "EPL-1.0"
    assert any("MUMPS" in what for what in licences)
    assert (found.licence_folder / "LICENSE").read_text().lstrip().startswith("Apache License")


def test_the_self_test_carries_its_certificate_and_is_the_same_again(found):
    again = self_test()
    bits = [test.detail.split("bits ")[1] for test in (found.tests[0], again[0])]
    assert bits[0] == bits[1]
    assert "certified" in found.tests[0].detail


def test_text(found):
    out = found.text()
    for words in ("debulk ", "self-test: passed", "GB/s", "MPL-2.0", "bits"):
        assert words in out
    assert out.count("\n") > 20
    folded = found.text(80)
    assert folded.split() == out.split()  # no path is broken
    assert all(len(line) <= 80 or "/" in line for line in folded.splitlines())


def test_a_fault_is_told_not_thrown(monkeypatch):
    def broken(*_args, **_more):
        raise RuntimeError("no such library")

    monkeypatch.setattr(solve, "minimise", broken)
    done = CliRunner().invoke(app, ["doctor"])
    assert done.exit_code == 70
    assert "FAILED net, sheet, solver: RuntimeError: no such library" in done.stdout


def test_bandwidth_of_a_small_array():
    assert memory_bandwidth(1 << 20, 2) > 0
