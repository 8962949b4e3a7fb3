"""The service's state as plain data, for the operator's screen, for programs and for Prometheus."""

from __future__ import annotations

import dataclasses
import resource
from itertools import islice
from pathlib import Path
from typing import Any

from debulk.results.trace import now_utc
from debulk.serve.service import Service
from debulk.verdict import Verdict

_SHOWN = 20


def overview(service: Service) -> dict[str, Any]:
    """Return the newest result in full, the last twenty in short, and what is being done."""
    last = list(islice(reversed(service.results.values()), _SHOWN))
    short = ("id", "verdict", "sign", "reason", "part", "ply", "finished_utc", "record")
    running = service.running
    return {
        "run": service.run,
        "now_utc": now_utc(),
        "newest": dataclasses.asdict(last[0]) if last else None,
        "last": [{name: getattr(one, name) for name in short} for one in last],
        "running": {"id": running.id, "part": running.part, "ply": running.ply} if running else None,
        "waiting": service.waiting,
        "inspectors": service.inspectors.names(),
    }


def health(service: Service) -> dict[str, Any]:
    """Return whether the service can take a scan, and what it is at."""
    ready = any(state == "ready" for state in service.inspectors.names().values())
    return {
        "ok": ready and not service.blocked and not service.closed,
        "started_utc": service.started_utc,
        "running": service.running is not None,
        "hanging": service.hanging,
        "closed": service.closed,
        "waiting": service.waiting,
        "most_waiting": service.most_waiting,
        "inspectors": service.inspectors.names(),
    }


def metrics(service: Service) -> str:
    """Return the figures that Prometheus reads."""
    verdicts = [f'debulk_inspections_total{{verdict="{v.name}"}} {service.counts[v.name]}' for v in Verdict]
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    lines = [
        "# TYPE debulk_inspections_total counter",
        *verdicts,
        "# TYPE debulk_queue_full_total counter",
        f"debulk_queue_full_total {service.counts['full']}",
        "# TYPE debulk_inspection_seconds summary",
        f"debulk_inspection_seconds_sum {service.seconds:.6f}",
        f"debulk_inspection_seconds_count {sum(service.counts[v.name] for v in Verdict)}",
        "# TYPE debulk_waiting gauge",
        f"debulk_waiting {service.waiting}",
        "# TYPE debulk_hanging gauge",
        f"debulk_hanging {service.hanging}",
        "# TYPE process_resident_memory_bytes gauge",
        f"process_resident_memory_bytes {pages * resource.getpagesize()}",
    ]
    return "\n".join(lines) + "\n"
