"""The layers of the tests: every test is in one, and the summary says how long each took.

The folder decides (`FOLDERS`, otherwise ``unit``), unless the test or its file is marked with a layer. A test that
uses the fixture ``layup`` or ``browser`` is in the layer of that name. In the layer ``unit`` no virtual layup can be
made, so that its tests stay quick: whoever makes one is told to mark the test.
"""

from __future__ import annotations

from collections import defaultdict

import pytest

LAYERS = {
    "unit": "one function or room by itself, without a virtual layup: make quick",
    "program": "whole programs: the command line, examples, processes of their own",
    "layup": "virtual layups, from the scan to the verdict",
    "browser": "the pages in Chromium",
}
FOLDERS = {"cli": "program", "inspection": "layup", "lab": "layup", "scenes": "layup", "serve": "program"}


def layer_of(item: pytest.Item) -> str:
    """Return the layer of a test."""
    marked = [mark.name for mark in item.iter_markers() if mark.name in LAYERS]
    used = [name for name in ("browser", "layup") if name in getattr(item, "fixturenames", ())]
    return (*marked, *used, FOLDERS.get(item.path.parent.name, "unit"))[0]


class Layers:
    """Marks tests with their layers, keeps unit tests from making layups, and adds up the times."""

    def __init__(self) -> None:
        self.now = ""
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.tests: defaultdict[str, int] = defaultdict(int)
        self._watch()

    def _watch(self) -> None:
        from debulk.scenes import Layup
        from lab.varied import VariedLayup

        for kind in (Layup, VariedLayup):
            kind.__init__ = self._watched(kind.__init__)  # type: ignore[method-assign]

    def _watched(self, made):
        def init(layup, *args, **named):
            assert self.now != "unit", "a unit test makes a virtual layup: mark it with @pytest.mark.layup"
            made(layup, *args, **named)

        return init

    @pytest.hookimpl(tryfirst=True)  # before -m chooses by them
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Mark every test."""
        for item in items:
            layer = layer_of(item)
            if item.get_closest_marker(layer) is None:
                item.add_marker(layer)
            item.user_properties.append(("layer", layer))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item):
        """Note the layer of the test that runs."""
        self.now = dict(item.user_properties)["layer"]
        try:
            return (yield)
        finally:
            self.now = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up; under xdist the reports of all workers come here."""
        layer = dict(report.user_properties)["layer"]
        self.seconds[layer] += report.duration
        self.tests[layer] += report.when == "call"

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say how long each layer took."""
        for layer in LAYERS:
            if self.tests[layer]:
                terminalreporter.write_line(
                    f"layer {layer:8} {self.tests[layer]:5} tests {self.seconds[layer]:8.1f} s of a core"
                )
