"""The states of a vision system, by the standard's names, and the transitions between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from debulk.serve.opcua.continuous import Continuous
from debulk.serve.result import Job, Result
from debulk.serve.service import KEPT, Service

MACHINE = "VisionStateMachine"
AUTOMATIC = f"{MACHINE}/AutomaticModeStateMachine"
EXECUTING = ("SingleExecution", "ContinuousExecution")


@dataclass(frozen=True)
class Change:
    """A state machine enters a state; `transition` names the way, empty: it becomes active or inactive."""

    machine: str
    old: str
    new: str
    """`old`, `new`: empty if the machine is inactive."""
    transition: str
    job: str
    """The job that runs, or ran last."""


@dataclass
class States:
    """Follows a service; what only OPC UA's methods change stands here."""

    service: Service
    machine: str = "Operational"
    """State of the whole; that of the automatic mode follows from all else."""
    prepared: bool = True
    continuous: Continuous | None = None
    ended_by: str = "Auto"
    """Method that ends the running job: Stop, Abort, or neither."""
    job: str = ""
    started: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Scans that a method asked for, each with its job and that job's MeasId."""
    _at: dict[str, str] = field(default_factory=dict)

    def ask_for(self, scan: str, job: str, meas: str) -> None:
        """Remember which job a scan belongs to, as long as its result can be asked for."""
        self.started[scan] = (job, meas)
        while len(self.started) > KEPT + self.service.most_waiting + 1:
            self.started.pop(next(iter(self.started)))

    def job_of(self, scan: str) -> tuple[str, str]:
        """Return the job of a scan, and its MeasId; a scan that came by HTTP is a job of its own."""
        return self.started.get(scan, (scan, ""))

    @property
    def mode(self) -> str:
        """State of the automatic mode; empty while it is inactive."""
        if self.machine != "Operational":
            return ""
        if self.continuous is not None:
            return "ContinuousExecution"
        if self.service.running is not None:
            return "SingleExecution"
        ready = self.prepared and "ready" in self.service.inspectors.names().values()
        return "Ready" if ready else "Initialized"

    def changes(self, news: Job | Result | None = None, cause: str = "Auto") -> Iterator[Change]:
        """Yield what has changed since the last call; `cause` is the method's word in the transition's name."""
        if self.continuous is not None:
            if isinstance(news, Result):
                self.continuous.scans.discard(news.id)
            self.job = self.continuous.job
            if self.continuous.ended:
                self.continuous = None
        if isinstance(news, Job) and self.mode == "SingleExecution":
            self.job = self.job_of(news.id)[0]
            cause = "" if news.id in self.started else "Auto"
        yield from self._way(MACHINE, self.machine, cause)
        mode, old = self.mode, self._at.get(AUTOMATIC, "")
        if old and mode and len({old, mode, "Ready"}) == 3:  # no transition leads there directly
            yield from self._way(AUTOMATIC, "Ready", "Auto")
        yield from self._way(AUTOMATIC, mode, cause)

    def _way(self, machine: str, new: str, cause: str) -> Iterator[Change]:
        old = self._at.get(machine)
        if old == new:
            return
        self._at[machine] = new
        if old in EXECUTING:
            cause, self.ended_by = self.ended_by, "Auto"
        yield Change(machine, old or "", new, f"{old}To{new}{cause}" if old and new else "", self.job)
