"""What the standard's methods do. Error is 0, or the negative of the status that HTTP would answer with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from asyncua import ua

from debulk.serve.asked import Inspection, of_query
from debulk.serve.opcua.continuous import Continuous, scans_in
from debulk.serve.opcua.nodes import Nodes
from debulk.serve.opcua.results import FIELDS, job_id, recipe_id, result_data, variant
from debulk.serve.opcua.states import AUTOMATIC, EXECUTING, MACHINE, States
from debulk.serve.refusal import Refusal
from debulk.serve.result import Result
from debulk.serve.service import Service
from debulk.serve.threads import in_thread

_HALTED = "the service was halted by OPC UA; the method Reset ends that"
_UNPREPARED = "the recipe was unprepared by OPC UA; the method PrepareRecipe ends that"


class Methods:
    """The methods of a vision system over a service.

    `on_change` is called with the word by which a method's transition is named, when it has changed the states.
    """

    def __init__(self, service: Service, recipe_sha256: str, states: States, on_change: Callable[[str], None]) -> None:
        self.service, self._recipe, self._states = service, recipe_sha256, states
        self._on_change = on_change

    async def link(self, server: Any, nodes: Nodes) -> None:
        """Have the nodes' methods answered."""
        for path, method in {
            f"{MACHINE}/Halt": self.halt,
            f"{MACHINE}/Reset": self.reset,
            f"{AUTOMATIC}/StartSingleJob": self.start_single_job,
            f"{AUTOMATIC}/StartContinuous": self.start_continuous,
            f"{AUTOMATIC}/Abort": self.abort,
            f"{AUTOMATIC}/Stop": self.stop,
            "RecipeManagement/GetRecipeListFiltered": self.recipes,
            "RecipeManagement/PrepareRecipe": self.prepare,
            "RecipeManagement/UnprepareRecipe": self.unprepare,
            "RecipeManagement/Recipe/Prepare": self.prepare_this,
            "RecipeManagement/Recipe/Unprepare": self.unprepare_this,
            "ResultManagement/GetResultById": self.result,
            "ResultManagement/GetResultComponentsById": self.components,
            "ResultManagement/GetResultListFiltered": self.results,
        }.items():
            server.link_method(await nodes.at(path), method)

    # --- the state machines ---

    async def halt(self, _parent: Any, *_: Any) -> list[Any]:
        """Accept no more scans, also none by HTTP; what runs is ended, and what waits is not inspected."""
        self.service.closed = _HALTED
        await self._end("Abort")
        self.service.withdraw(_HALTED)
        self._states.machine = "Halted"
        self._on_change("")
        return [_int(0)]

    async def reset(self, _parent: Any, *_: Any) -> list[Any]:
        """End whatever runs, and be as at the start."""
        await self._end("Abort")
        self.service.withdraw("ended by the method Reset of OPC UA")
        self._states.machine = "Preoperational"
        self._on_change("")
        self.service.closed, self._states.prepared = "", True
        self._states.machine = "Operational"
        self._on_change("Auto")
        return [_int(0)]

    async def abort(self, _parent: Any, *_: Any) -> list[Any]:
        """End the running job; scans of it that have no result yet are INVALID."""
        await self._end("Abort")
        return [_int(0)]

    async def stop(self, _parent: Any, *_: Any) -> list[Any]:
        """Let the running job end: what has been scanned gets its result."""
        await self._end("Stop")
        return [_int(0)]

    async def _end(self, how: str) -> None:
        states, job = self._states, self._states.continuous
        if states.mode not in EXECUTING:
            return
        states.ended_by = how
        if job is not None:
            await (job.stop() if how == "Stop" else job.abort())
        if how == "Abort":
            if job is not None:
                self.service.withdraw("ended by the method Abort of OPC UA", job.scans)
            if self.service.running is not None:
                self.service.running.inspector.cancel()
        self._on_change(how)

    async def start_single_job(self, _parent: Any, meas: Any, *given: Any) -> list[Any]:
        """Inspect the file that the first parameter names; the others are NAME=VALUE, as of the HTTP call."""
        try:
            if self._states.continuous is not None:
                raise Refusal(409, "a continuous job runs")
            job = self.service.submit(self._asked(*given))
        except Refusal as refusal:
            return [job_id(""), _int(-refusal.status)]
        self._states.ask_for(job.id, job.id, _id(meas))
        return [job_id(job.id), _int(0)]

    async def start_continuous(self, _parent: Any, meas: Any, *given: Any) -> list[Any]:
        """Inspect each scan that comes into the folder that the first parameter names; the others are as for one."""
        states = self._states
        try:
            asked = self._asked(*given)
            folder = self.service.folders.folder(asked.path or "")
            before = await in_thread(scans_in, folder)
            self.service.check_room()
            self.service.inspectors.get(asked.inspector)
            if states.mode != "Ready":
                raise Refusal(409, f"the automatic mode is {states.mode}, not Ready")
        except Refusal as refusal:
            return [job_id(""), _int(-refusal.status)]
        number = self.service.new_id()
        states.continuous = Continuous(
            self.service,
            number,
            folder,
            asked,
            before,
            took=lambda scan: states.ask_for(scan, number, _id(meas)),
            looked=lambda: self._on_change("Auto"),
        )
        self._on_change("")
        return [job_id(number), _int(0)]

    def _asked(self, part: Any, recipe: Any, _product: Any, parameters: Any) -> Inspection:
        """Return what a job's parameters ask for."""
        words = [str(_plain(one)) for one in parameters.Value or []]
        pairs = [word.partition("=") for word in words[1:]]
        if not self._is_ours(_id(recipe)):
            raise Refusal(404, f"the recipe {_id(recipe)[:40]} is not the one that is prepared")
        fields = {"path": words[0] if words else "", **{name: value for name, _, value in pairs}}
        return of_query(Inspection, {"part": _id(part), **fields})

    # --- recipes ---

    async def recipes(self, _parent: Any, external: Any, *_: Any) -> list[Any]:
        """Return the recipe that is in use."""
        found = [recipe_id(self._recipe)] if self._is_ours(_id(external)) else []
        return [ua.Variant(True), _count(len(found)), _count(0), _list(found), _int(0)]

    async def prepare(self, _parent: Any, external: Any, internal: Any) -> list[Any]:
        """Prepare the recipe of the service's start, or answer that another is not here."""
        error = self._prepared(True, _id(internal) or _id(external))
        return [ua.Variant(recipe_id(self._recipe)), ua.Variant(not error), _int(error)]

    async def unprepare(self, _parent: Any, external: Any, internal: Any) -> list[Any]:
        """Accept no more scans, also none by HTTP, until the recipe is prepared again."""
        error = self._prepared(False, _id(internal) or _id(external))
        return [ua.Variant(recipe_id(self._recipe)), _int(error)]

    async def prepare_this(self, _parent: Any) -> list[Any]:
        """Do the same by the recipe's own method."""
        error = self._prepared(True, "")
        return [ua.Variant(not error), _int(error)]

    async def unprepare_this(self, _parent: Any) -> list[Any]:
        """Do the same by the recipe's own method."""
        return [_int(self._prepared(False, ""))]

    def _prepared(self, wanted: bool, recipe: str) -> int:
        """Have the recipe prepared or not; return 0, -404 for another recipe, or -409 where the state allows it not."""
        states = self._states
        if not self._is_ours(recipe):
            return -404
        needed = states.mode in EXECUTING or self.service.waiting
        if not states.mode or not (wanted or (states.prepared and not needed)):
            return -409
        states.prepared = wanted
        self.service.closed = "" if wanted else _UNPREPARED
        self._on_change("Recipe")
        return 0

    def _is_ours(self, wanted: str) -> bool:
        return wanted in ("", self._recipe[:16], self._recipe)

    # --- results ---

    async def result(self, _parent: Any, result_id: Any, timeout: Any) -> list[Any]:
        """Return a result, for which is waited up to so many milliseconds."""
        found, error = await self._result(_id(result_id), timeout)
        return [_count(0), ua.Variant(self._data(found) if found else _nothing()), _int(error)]

    async def components(self, _parent: Any, result_id: Any, timeout: Any) -> list[Any]:
        """Return the parts of a result one by one."""
        found, error = await self._result(_id(result_id), timeout)
        data = self._data(found) if found else _nothing()
        none = ua.Variant(ua.BinaryIdBaseDataType(Id=""))
        told = {name: variant(name, getattr(data, name)) for name in FIELDS}
        return [
            ua.Variant(False),  # no file
            _count(0),  # no handle
            told["IsPartial"],
            ua.Variant(False),  # not simulated
            *(told[name] for name in ("ResultState", "MeasId", "PartId")),
            none,  # external recipe
            told["InternalRecipeId"],
            ua.Variant(ua.ProductIdDataType(Id="")),
            none,  # external configuration
            *(told[name] for name in ("InternalConfigurationId", "JobId", "CreationTime", "ProcessingTimes")),
            told["ResultContent"],
            _int(error),
        ]

    async def results(self, _parent: Any, state: Any, meas: Any, part: Any, *more: Any) -> list[Any]:
        """Return the results of a part, a measurement, a job and a state, the oldest first; what is empty is any."""
        job, most, start = more[5], more[6].Value or 100, more[7].Value
        wanted_state = state.Value
        found = [
            data
            for data in map(self._data, list(self.service.results.values()))
            if wanted_state in (0, data.ResultState)
            and _id(meas) in ("", data.MeasId.Id)
            and _id(part) in ("", data.PartId.Id)
            and _id(job) in ("", data.JobId.Id)
        ]
        some = found[start : start + most]
        complete = start + len(some) >= len(found)
        return [ua.Variant(complete), _count(len(some)), _count(0), _list(some), _int(0)]

    async def _result(self, number: str, timeout: Any) -> tuple[Result | None, int]:
        try:
            found = await self.service.result(number, min(max(timeout.Value / 1e3, 0.0), 60.0))
        except Refusal as refusal:
            return None, -refusal.status
        return found, 0 if found else -408

    def _data(self, result: Result) -> Any:
        return result_data(result, *self._states.job_of(result.id))


def _nothing() -> Any:
    """Return a result that says by its state, 0, that there is none."""
    return ua.ResultDataType(
        MeasId=ua.MeasIdDataType(),
        PartId=ua.PartIdDataType(),
        InternalConfigurationId=ua.BinaryIdBaseDataType(),
        ProcessingTimes=ua.ProcessingTimesDataType(),
    )


def _id(given: Any) -> str:
    return str(getattr(_plain(given), "Id", "") or "")


def _plain(given: Any) -> Any:
    return given.Value if isinstance(given, ua.Variant) else given


def _int(value: int) -> Any:
    return ua.Variant(value, ua.VariantType.Int32)


def _count(value: int) -> Any:
    return ua.Variant(value, ua.VariantType.UInt32)


def _list(values: list[Any]) -> Any:
    return ua.Variant(values, ua.VariantType.ExtensionObject, is_array=True)
