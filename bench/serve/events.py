"""Counts the OPC UA events of 10 000 results, and measures how late they come to a client in another process.

python bench/serve/events.py NODESET > bench/serve/events.txt
chrt --rr 1 python bench/serve/events.py NODESET 300 >> bench/serve/events.txt

First the results are given as fast as the server takes them, then twenty a second. The clock is the machine's, which
both processes read. The machine was busy with other programs, some fifteen on two cores; before those goes what is
started by chrt.
"""

import asyncio
import logging
import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from asyncua import Client, ua

from debulk.recipe import Recipe
from debulk.results.approval import recipe_hash
from debulk.serve.folders import Folders
from debulk.serve.inspectors import Cell
from debulk.serve.opcua.nodes import NAMESPACE, Nodes
from debulk.serve.opcua.server import MachineVision
from debulk.serve.result import Result
from debulk.serve.service import Service

URL = "opc.tcp://127.0.0.1:48655/debulk"


def serve(nodeset: Path, orders, given) -> None:
    """Give as many results as are ordered, so many a second (0: at once), and note when."""

    async def run() -> None:
        service = Service(Cell(Recipe()), Folders([Path(tempfile.gettempdir())]))
        vision = MachineVision(service, nodeset, URL)
        await vision.start()
        given.put(None)
        recipe, made = recipe_hash(Recipe().model_dump()), 0
        while order := await asyncio.to_thread(orders.get):
            count, rate = order
            times = []
            for _ in range(count):
                made += 1
                now = time.strftime("%Y-%m-%dT%H:%M:%S.000Z", time.gmtime())
                result = Result(
                    f"r-{made}", "CREASE", "x", "made up", "A", "1", "default", "s", now, now, 0.5, recipe=recipe
                )
                times.append((result.id, time.time()))
                for say in service.on_change:
                    say(result)
                await asyncio.sleep(1 / rate if rate else 0)
            given.put(times)
        await vision.stop()

    asyncio.run(run())


async def listen(count: int, orders, given) -> None:
    """Order results, and print what came."""
    heard: list[tuple[str, float]] = []

    class Handler:
        def event_notification(self, event) -> None:
            heard.append((event.ResultId.Id, time.time()))

    async with Client(URL, timeout=60) as client:
        space = await client.get_namespace_index(NAMESPACE)
        await client.load_data_type_definitions()
        nodes = Nodes(client, space, client.nodes.objects)
        kind = await nodes.type("ResultReadyEventType")
        subscription = await client.create_subscription(10, Handler())
        await subscription.subscribe_events(ua.ObjectIds.Server, kind, queuesize=count)
        for many, rate in ((count, 0), (min(count, 600), 20)):
            heard.clear()
            orders.put((many, rate))
            times = await asyncio.to_thread(given.get)
            end = time.monotonic() + 600
            while len(heard) < many and time.monotonic() < end:
                await asyncio.sleep(0.05)
            sent = dict(times)
            late_ms = [1e3 * (came - sent[name]) for name, came in heard]
            same = [name for name, _ in heard] == [name for name, _ in times]
            pace = f"{rate} a second" if rate else "at once"
            print(f"{many} results, {pace}: {len(heard)} events, in their order: {same}", flush=True)
            if rate:
                picked = (f"{q} % {np.percentile(late_ms, q):.1f}" for q in (50, 95, 99, 100))
                print(f"ms from the result to the client: {', '.join(picked)}", flush=True)
    orders.put(None)


def main() -> None:
    """Run server and client."""
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    nodeset, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    context = multiprocessing.get_context("spawn")
    orders, given = context.Queue(), context.Queue()
    server = context.Process(target=serve, args=(nodeset, orders, given), daemon=True)
    server.start()
    given.get(timeout=300)
    asyncio.run(listen(count, orders, given))
    server.join(30)


if __name__ == "__main__":
    main()
