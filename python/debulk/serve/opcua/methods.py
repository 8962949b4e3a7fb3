"""What the standard's methods do. Error is 0, or the negative of the status that HTTP would answer with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from asyncua import ua

from debulk.serve.asked import Inspection, of_query
from debulk.serve.opcua.nodes import Nodes
from debulk.serve.opcua.results import FIELDS, job_id, recipe_id, result_data, variant
from debulk.serve.refusal import Refusal
from debulk.serve.result import Result
from debulk.serve.service import KEPT, Service

_NOT_HERE = -501


class Methods:
    """The methods of a vision system over a service."""

    def __init__(self, service: Service, recipe_sha256: str, on_change: Callable[[], None]) -> None:
        self.service, self._recipe = service, recipe_sha256
        self._on_change = on_change
        self._meas_ids: dict[str, str] = {}

    async def link(self, server: Any, nodes: Nodes) -> None:
        """Have the nodes' methods answered."""
        automatic = "VisionStateMachine/AutomaticModeStateMachine"
        for path, method in {
            "VisionStateMachine/Halt": self.halt,
            "VisionStateMachine/Reset": self.reset,
            f"{automatic}/StartSingleJob": self.start_single_job,
            f"{automatic}/StartContinuous": self.start_continuous,
            f"{automatic}/Abort": self.abort,
            f"{automatic}/Stop": self.abort,
            "RecipeManagement/GetRecipeListFiltered": self.recipes,
            "RecipeManagement/PrepareRecipe": self.prepare,
            "RecipeManagement/UnprepareRecipe": self.unprepare,
            "ResultManagement/GetResultById": self.result,
            "ResultManagement/GetResultComponentsById": self.components,
            "ResultManagement/GetResultListFiltered": self.results,
        }.items():
            server.link_method(await nodes.at(path), method)

    def meas_id(self, number: str) -> str:
        """Return the MeasId with which a job was started."""
        return self._meas_ids.get(number, "")

    # --- the state machines ---

    async def halt(self, _parent: Any, *_: Any) -> list[Any]:
        """Accept no more scans, also none by HTTP; what runs is ended."""
        self.service.halted = True
        return await self.abort(_parent)

    async def reset(self, _parent: Any, *_: Any) -> list[Any]:
        """Accept scans again."""
        self.service.halted = False
        self._on_change()
        return [_int(0)]

    async def abort(self, _parent: Any, *_: Any) -> list[Any]:
        """End the running inspection, whose result is INVALID."""
        if self.service.running is not None:
            self.service.running.inspector.cancel()
        self._on_change()
        return [_int(0)]

    async def start_single_job(
        self, _parent: Any, meas: Any, part: Any, recipe: Any, _product: Any, parameters: Any
    ) -> list[Any]:
        """Inspect the file that the first parameter names; the others are NAME=VALUE, as of the HTTP call."""
        try:
            words = [str(_plain(one)) for one in parameters.Value or []]
            pairs = [word.partition("=") for word in words[1:]]
            fields = {"path": words[0] if words else "", **{name: value for name, _, value in pairs}}
            if not self._is_ours(_id(recipe)):
                raise Refusal(404, f"the recipe {_id(recipe)[:40]} is not the one that is prepared")
            job = self.service.submit(of_query(Inspection, {"part": _id(part), **fields}))
        except Refusal as refusal:
            return [job_id(""), _int(-refusal.status)]
        self._meas_ids[job.id] = _id(meas)
        while len(self._meas_ids) > KEPT + self.service.most_waiting + 1:
            self._meas_ids.pop(next(iter(self._meas_ids)))
        return [job_id(job.id), _int(0)]

    async def start_continuous(self, _parent: Any, *_: Any) -> list[Any]:
        """Refuse: every scan is a job of its own."""
        return [job_id(""), _int(_NOT_HERE)]

    # --- recipes ---

    async def recipes(self, _parent: Any, external: Any, *_: Any) -> list[Any]:
        """Return the recipe that is in use."""
        found = [recipe_id(self._recipe)] if self._is_ours(_id(external)) else []
        return [ua.Variant(True), _count(len(found)), _count(0), _list(found), _int(0)]

    async def prepare(self, _parent: Any, external: Any, internal: Any) -> list[Any]:
        """Answer that the recipe in use is prepared, or that another is not here."""
        ours = self._is_ours(_id(internal) or _id(external))
        return [ua.Variant(recipe_id(self._recipe)), ua.Variant(ours), _int(0 if ours else -404)]

    async def unprepare(self, _parent: Any, *_: Any) -> list[Any]:
        """Refuse: the recipe is that of the service's start."""
        return [ua.Variant(recipe_id(self._recipe)), _int(_NOT_HERE)]

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
        return result_data(result, self.meas_id(result.id))


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
