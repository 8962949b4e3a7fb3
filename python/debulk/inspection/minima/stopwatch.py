"""Milliseconds per step of the evaluation of a pocket."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Stopwatch:
    """Milliseconds per step, without those of the steps nested in it."""

    split_ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time the body as a part of the step."""
        began, before_ms = time.perf_counter(), sum(self.split_ms.values())
        yield
        within_ms = sum(self.split_ms.values()) - before_ms
        self.split_ms[name] = self.split_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - began) - within_ms

    def figures(self) -> dict[str, Any]:
        """Return the times as a report has them."""
        return {"runtime_ms": sum(self.split_ms.values()), "runtime_split_ms": self.split_ms}
