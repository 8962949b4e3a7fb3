"""The OPC UA server beside the service: its states follow the service's, and each result is an event."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from typing import Any

from asyncua import Server, ua

from debulk import InputError
from debulk.results.approval import recipe_hash
from debulk.serve.opcua.methods import Methods
from debulk.serve.opcua.nodes import load_types, made
from debulk.serve.opcua.results import FIELDS, job_id, recipe_id, result_data, variant
from debulk.serve.opcua.states import AUTOMATIC, EXECUTING, MACHINE, Change, States
from debulk.serve.result import Job, Result
from debulk.serve.service import Service

log = logging.getLogger("debulk")

_TYPES = {MACHINE: "VisionStateMachineType", AUTOMATIC: "VisionAutomaticModeStateMachineType"}
_EVENTS = ("JobStarted", "Ready", "ResultReady", "RecipePrepared", "StateChanged")


class MachineVision:
    """A vision system of OPC 40100-1, called VisionSystem, over a service in whose event loop it runs.

    `nodeset` is the file of the standard's types, Opc.Ua.MachineVision.NodeSet2.xml, which the OPC Foundation gives
    away; `endpoint` is where to listen, such as "opc.tcp://127.0.0.1:4840/debulk".
    """

    def __init__(self, service: Service, nodeset: Path, endpoint: str) -> None:
        self._service, self._nodeset, self._endpoint = service, nodeset, endpoint
        self._recipe = recipe_hash(service.cell.recipe.model_dump())
        self._states = States(service)
        self._methods = Methods(service, self._recipe, self._states, lambda cause: self._note(None, cause))
        self._prepared = False
        self._news: asyncio.Queue[Change | Result | bool] = asyncio.Queue()
        self._server = Server()
        self._work: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Make the nodes and listen; an `InputError` if the nodeset is another file, or the address cannot be used."""
        if not self._nodeset.is_file():
            raise InputError(f"--nodeset: there is no file {self._nodeset}")
        server = self._server
        await server.init()
        server.set_endpoint(self._endpoint)
        server.set_server_name("debulk")
        server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        space = await load_types(server, self._nodeset)
        self._nodes = nodes = await made(server, space, "VisionSystem")
        await self._prepare_recipe()
        await self._methods.link(server, nodes)
        self._parts = {machine: await nodes.parts(kind) for machine, kind in _TYPES.items()}
        self._machines = {machine: await nodes.at(machine) for machine in _TYPES}
        self._events = {
            name: [
                await server.get_event_generator(await nodes.type(f"{name}EventType"), node)
                for node in (nodes.system, server.nodes.server)  # whichever a client listens to
            ]
            for name in _EVENTS
        }
        try:
            await server.start()
        except OSError as error:
            raise InputError(f"--opcua {self._endpoint}: cannot be listened to: {error}") from None
        self._service.on_change.append(self._note)
        self._note(None)
        self._work = asyncio.ensure_future(self._follow())

    async def stop(self) -> None:
        """Stop listening."""
        if self._work is not None:
            self._service.on_change.remove(self._note)
            if self._states.continuous is not None:
                await self._states.continuous.abort()
            self._work.cancel()
            await asyncio.gather(self._work, return_exceptions=True)
            await self._server.stop()

    def _note(self, news: Job | Result | None, cause: str = "Auto") -> None:
        """Have clients told what is new, in this order: a result, whether the recipe is prepared, and the states."""
        if isinstance(news, Result):
            self._news.put_nowait(news)
        if self._prepared is not self._states.prepared:
            self._prepared = self._states.prepared
            self._news.put_nowait(self._prepared)
        for change in self._states.changes(news, cause):
            self._news.put_nowait(change)

    async def _follow(self) -> None:
        """Tell what happens, one after the other: no result is left out, however fast they come."""
        while True:
            news = await self._news.get()
            try:
                match news:
                    case Result():
                        await self._tell_result(news)
                    case Change():
                        await self._tell_change(news)
                    case _:
                        await self._tell_prepared(news)
                if isinstance(news, Result) or self._news.empty():
                    await self._publish()
            except Exception:  # the next result must be told all the same
                log.exception("a fault of debulk's while OPC UA was told of %s", news)

    async def _publish(self) -> None:
        """Send events now, not at the next publishing interval.

        A client that has not asked again since its last ones gets these when it asks; to try meanwhile would let its
        subscription expire.
        """
        for subscription in list(self._server.iserver.subscription_service.subscriptions.values()):
            if not getattr(subscription, "_publish_cycles_count", 1):
                await subscription.publish_results()

    async def _tell_result(self, result: Result) -> None:
        data = result_data(result, *self._states.job_of(result.id))
        fields = {name: variant(name, getattr(data, name)) for name in FIELDS}
        await self._fire("ResultReady", f"{result.verdict}: {result.reason}", **fields)

    async def _tell_change(self, change: Change) -> None:
        parts, machine = self._parts[change.machine], self._machines[change.machine]
        await self._write_state(machine, change.new, parts)
        if not change.transition:
            return
        fields = {"SourceNode": ua.Variant(machine.nodeid), "SourceName": ua.Variant(change.machine.split("/")[-1])}
        names = {"FromState": change.old, "ToState": change.new, "Transition": change.transition}
        for field, name in names.items():
            fields |= {field: ua.Variant(ua.LocalizedText(name)), f"{field}/Id": ua.Variant(parts[name])}
        await self._fire("StateChanged", change.transition, **fields)
        if change.new in EXECUTING:
            await self._fire("JobStarted", f"job {change.job}", JobId=job_id(change.job))
        elif change.old in EXECUTING:
            await self._fire("Ready", "ready", JobId=job_id(change.job))

    async def _tell_prepared(self, prepared: bool) -> None:
        await (await self._nodes.at("RecipeManagement/Recipe/IsPrepared")).write_value(prepared)
        if prepared:
            await self._fire("RecipePrepared", "prepared", InternalId=ua.Variant(recipe_id(self._recipe)))

    async def _fire(self, event: str, message: str, **fields: ua.Variant) -> None:
        for generator in self._events[event]:
            for name, value in fields.items():
                generator.event.add_property(name, value.Value, value.VariantType)
            await generator.trigger(message=message)

    async def _write_state(self, machine: Any, name: str, parts: dict[str, Any]) -> None:
        """Write a state, or that the machine is not active, which is the standard's way for one below another."""
        current = await machine.get_child(["0:CurrentState"])
        for node, value in (
            (current, ua.Variant(ua.LocalizedText(name))),
            (await current.get_child(["0:Id"]), ua.Variant(parts.get(name, ua.NodeId()), ua.VariantType.NodeId)),
        ):
            status = ua.StatusCode(ua.StatusCodes.Good if name else ua.StatusCodes.BadStateNotActive)
            await node.write_value(ua.DataValue(value, status))

    async def _prepare_recipe(self) -> None:
        management = await self._nodes.at("RecipeManagement")
        kind = await self._nodes.type("RecipeType")
        space = self._nodes.space
        await management.add_object(space, "Recipe", objecttype=kind.nodeid, instantiate_optional=False)
        await (await self._nodes.at("RecipeManagement/Recipe/InternalId")).write_value(recipe_id(self._recipe))
