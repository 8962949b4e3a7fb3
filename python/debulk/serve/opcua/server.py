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
from debulk.serve.result import Job, Result
from debulk.serve.service import Service

log = logging.getLogger("debulk")


class MachineVision:
    """A vision system of OPC 40100-1, called VisionSystem, over a service in whose event loop it runs.

    `nodeset` is the file of the standard's types, Opc.Ua.MachineVision.NodeSet2.xml, which the OPC Foundation gives
    away; `endpoint` is where to listen, such as "opc.tcp://127.0.0.1:4840/debulk".
    """

    def __init__(self, service: Service, nodeset: Path, endpoint: str) -> None:
        self._service, self._nodeset, self._endpoint = service, nodeset, endpoint
        self._recipe = recipe_hash(service.cell.recipe.model_dump())
        self._methods = Methods(service, self._recipe, self._refresh)
        self._news: asyncio.Queue[Job | Result | None] = asyncio.Queue()
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
        await self._methods.link(server, nodes)
        await self._prepare_states()
        await self._prepare_recipe()
        self._events = {
            name: [
                await server.get_event_generator(await nodes.type(name), node)
                for node in (nodes.system, server.nodes.server)  # whichever a client listens to
            ]
            for name in ("JobStartedEventType", "ReadyEventType", "ResultReadyEventType")
        }
        try:
            await server.start()
        except OSError as error:
            raise InputError(f"--opcua {self._endpoint}: cannot be listened to: {error}") from None
        self._service.on_start.append(self._news.put_nowait)
        self._service.on_result.append(self._news.put_nowait)
        self._refresh()
        self._work = asyncio.ensure_future(self._follow())

    async def stop(self) -> None:
        """Stop listening."""
        if self._work is not None:
            self._work.cancel()
            await asyncio.gather(self._work, return_exceptions=True)
            await self._server.stop()

    def _refresh(self) -> None:
        """Have the states written anew."""
        self._news.put_nowait(None)

    async def _follow(self) -> None:
        """Tell what happens, one after the other: no result is left out, however fast they come."""
        while True:
            news = await self._news.get()
            try:
                await self._tell(news)
                await self._write_states()
            except Exception:  # the next result must be told all the same
                log.exception("a fault of debulk's while OPC UA was told of %s", news)

    async def _tell(self, news: Job | Result | None) -> None:
        match news:
            case Job():
                await self._fire("JobStartedEventType", f"inspects {news.scan.name}", JobId=job_id(news.id))
            case Result():
                data = result_data(news, self._methods.meas_id(news.id))
                fields = {name: variant(name, getattr(data, name)) for name in FIELDS}
                await self._fire("ResultReadyEventType", f"{news.verdict}: {news.reason}", **fields)
                await self._fire("ReadyEventType", "ready", JobId=job_id(news.id))

    async def _fire(self, event: str, message: str, **fields: ua.Variant) -> None:
        for generator in self._events[event]:
            for name, value in fields.items():
                generator.event.add_property(name, value.Value, value.VariantType)
            await generator.trigger(message=message)

    async def _prepare_states(self) -> None:
        nodes, machine = self._nodes, "VisionStateMachine"
        automatic = f"{machine}/AutomaticModeStateMachine"
        self._states: dict[str, tuple[Any, Any, dict[str, Any]]] = {}
        for path, kind, names in (
            (machine, "VisionStateMachineType", ("Operational", "Halted")),
            (automatic, "VisionAutomaticModeStateMachineType", ("Initialized", "Ready", "SingleExecution")),
        ):
            states = {name: (await nodes.state(kind, name)).nodeid for name in names}
            current = await nodes.at(f"{path}/0:CurrentState")
            self._states[path] = (current, await current.get_child(["0:Id"]), states)

    async def _write_states(self) -> None:
        """Write both states: the machine's, and that of its automatic mode."""
        service = self._service
        ready = "ready" in service.inspectors.names().values()
        mode = "SingleExecution" if service.running else "Ready" if ready else "Initialized"
        for (current, identity, states), name in zip(
            self._states.values(), ("Halted" if service.halted else "Operational", mode), strict=True
        ):
            await current.write_value(ua.LocalizedText(name))
            await identity.write_value(states[name], ua.VariantType.NodeId)

    async def _prepare_recipe(self) -> None:
        management = await self._nodes.at("RecipeManagement")
        kind = await self._nodes.type("RecipeType")
        recipe = await management.add_object(
            self._nodes.space, "Recipe", objecttype=kind.nodeid, instantiate_optional=False
        )
        space = self._nodes.space
        identity = await recipe.get_child([f"{space}:InternalId"])
        await identity.write_value(recipe_id(self._recipe))
        await (await recipe.get_child([f"{space}:IsPrepared"])).write_value(True)
