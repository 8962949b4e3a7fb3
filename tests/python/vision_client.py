"""A client of OPC 40100-1 that knows the standard's names only; as a program it runs one job and prints what came.

python vision_client.py URL SCAN
"""

import asyncio
import json
import logging
import sys
import time

from asyncua import Client, ua

NAMESPACE = "http://opcfoundation.org/UA/MachineVision"
AUTOMATIC = "VisionStateMachine/AutomaticModeStateMachine"


class Standard:
    """A client that finds everything by the standard's names."""

    def __init__(self, url):
        self.client = Client(url, timeout=30)
        self.events = []

    async def __aenter__(self):
        await self.client.connect()
        self.space = await self.client.get_namespace_index(NAMESPACE)
        await self.client.load_data_type_definitions()
        kind = await self.type("VisionSystemType")
        for found in await self.client.nodes.objects.get_children():
            if await found.read_node_class() is ua.NodeClass.Object and await found.read_type_definition() == kind:
                self.system = found
        return self

    async def __aexit__(self, *_):
        await self.client.disconnect()

    async def type(self, name, base=58):
        for child in await self.client.get_node(ua.NodeId(base)).get_referenced_nodes(45, ua.BrowseDirection.Forward):
            if (await child.read_browse_name()) == ua.QualifiedName(name, self.space):
                return child.nodeid
            if found := await self.type(name, child.nodeid.Identifier) if not child.nodeid.NamespaceIndex else None:
                return found
        return None

    async def node(self, path):
        names = (name if ":" in name else f"{self.space}:{name}" for name in path.split("/"))
        return await self.system.get_child(list(names))

    async def call(self, path, *arguments):
        parent, _, name = path.rpartition("/")
        return await (await self.node(parent)).call_method(f"{self.space}:{name}", *arguments)

    async def state(self, path):
        return (await (await self.node(f"{path}/0:CurrentState")).read_value()).Text

    async def start(self, path, part="A-17", meas="3", recipe="", more=(), method="StartSingleJob"):
        words = ua.Variant([ua.Variant(str(word)) for word in (path, *more)], ua.VariantType.Variant, is_array=True)
        return await self.call(
            f"{AUTOMATIC}/{method}",
            ua.MeasIdDataType(Id=meas),
            ua.PartIdDataType(Id=part),
            ua.BinaryIdBaseDataType(Id=recipe),
            ua.ProductIdDataType(Id=""),
            words,
        )

    async def listen(self, kind="ResultReadyEventType", period_ms=10):
        kinds = await self.type(kind, 2041)
        handler = type("Handler", (), {"event_notification": lambda _, event: self.events.append((time.time(), event))})
        subscription = await self.client.create_subscription(period_ms, handler())
        await subscription.subscribe_events(self.system, kinds, queuesize=20_000)

    async def end(self, path):
        """Call a method that takes a cause and its description, such as Abort; return its error."""
        return await self.call(path, ua.Variant(0, ua.VariantType.Int32), "a test")

    async def until(self, what, most_s=30):
        end = time.monotonic() + most_s
        while not (found := await what()):
            assert time.monotonic() < end, "it did not happen"
            await asyncio.sleep(0.02)
        return found

    async def heard(self, count, most_s=60):
        end = time.monotonic() + most_s
        while len(self.events) < count:
            assert time.monotonic() < end, f"{len(self.events)} of {count} events came"
            await asyncio.sleep(0.01)


async def a_job(url, scan):
    """Start a job, and return what the event and the method say of its result."""
    async with Standard(url) as client:
        await client.listen()
        assert await client.state("VisionStateMachine") == "Operational"
        assert await client.state(AUTOMATIC) == "Ready"
        job, error = await client.start(scan, more=["deadline_s=5"])
        assert error == 0
        await client.heard(1)
        _, event = client.events[0]
        assert event.JobId == job
        _, result, error = await client.call("ResultManagement/GetResultById", event.ResultId, 0)
        assert error == 0
        return plain(event), plain(result)


def plain(result):
    """Return the fields of an event or of a result as JSON's types."""
    return {
        **{name: getattr(result, name).Id for name in ("ResultId", "JobId", "PartId", "MeasId")},
        "state": result.ResultState,
        "partial": result.IsPartial,
        "recipe": result.InternalRecipeId.Hash.hex(),
        "algorithm": result.InternalRecipeId.HashAlgorithm,
        "content": [getattr(one, "Value", one) for one in result.ResultContent],
    }


if __name__ == "__main__":
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    print(json.dumps(asyncio.run(a_job(*sys.argv[1:]))))
