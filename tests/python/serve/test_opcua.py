"""The OPC UA server against a client that knows the standard's names only: browse names, types, methods, events."""

import asyncio
import dataclasses
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from asyncua import ua

import vision_client
from cells import Running
from debulk import InputError, Recipe, Report, Verdict
from debulk.results.approval import recipe_hash
from debulk.serve.opcua.server import MachineVision
from vision_client import Standard

ROOT = Path(__file__).resolve().parents[3]
NODESET = Path(os.environ.get("DEBULK_NODESET", ROOT / "build/nodesets/Opc.Ua.MachineVision.NodeSet2.xml"))

pytestmark = pytest.mark.skipif(not NODESET.is_file(), reason="the standard's nodeset is not here: make nodeset")


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as one:
        return one.getsockname()[1]


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Return a service with an OPC UA server in its loop, and the server's address."""
    cell = Running(tmp_path_factory.mktemp("opcua"))
    url = f"opc.tcp://127.0.0.1:{free_port()}/debulk"

    async def made():
        server = MachineVision(cell.service, NODESET, url)
        await server.start()
        return server

    server = asyncio.run_coroutine_threadsafe(made(), cell.loop).result(120)
    yield cell, url
    asyncio.run_coroutine_threadsafe(server.stop(), cell.loop).result(30)
    cell.stop()


@pytest.fixture
def vision(both):
    both[0].quick.report = Report(verdict=Verdict.CEASE, reason="no pocket", pockets=(), recipe=Recipe().model_dump())
    both[0].quick.seen.clear()
    both[0].service.results.clear()
    return both


def test_a_job_by_the_standards_names_alone(vision):
    """The client is a process of its own, which learns all types from the server."""
    cell, url = vision
    cell.quick.report = dataclasses.replace(cell.quick.report, verdict=Verdict.CREASE, reason="made up")
    client = Path(vision_client.__file__)
    ran = subprocess.run([sys.executable, client, url, cell.scan], capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    event, result = json.loads(ran.stdout.splitlines()[-1])
    assert event == result
    assert event["PartId"] == "A-17" and event["MeasId"] == "3" and event["state"] == 1
    assert event["content"][:3] == [2, "CREASE", "made up"]
    assert event["recipe"] == recipe_hash(Recipe().model_dump()) and event["algorithm"] == "SHA-256"
    assert event["JobId"] in cell.service.results
    assert cell.quick.seen[0][2] == {"part": "A-17"}


@pytest.mark.parametrize("verdict", Verdict)
def test_an_evaluation_is_the_standards(vision, verdict):
    """ResultEvaluationEnum: 0 undefined, 1 OK, 2 not OK, 3 not decidable."""
    cell, url = vision
    cell.quick.report = Report(verdict=verdict, reason="made up", pockets=())

    async def asked():
        async with Standard(url) as client:
            await client.listen()
            cell.post(part="by HTTP")
            await client.heard(1)
            return client.events[0][1]

    event = asyncio.run(asked())
    wanted = {Verdict.CEASE: 1, Verdict.CREASE: 2, Verdict.UNDECIDED: 3, Verdict.INVALID: 0}[verdict]
    assert getattr(event.ResultContent[0], "Value", event.ResultContent[0]) == wanted
    assert event.PartId.Id == "by HTTP"


def test_what_cannot_be_done_is_an_error_and_no_job(vision):
    cell, url = vision

    async def asked():
        async with Standard(url) as client:
            errors = [
                (await client.start("/etc/passwd"))[1],
                (await client.start(cell.folder / "away.npy"))[1],
                (await client.start(cell.scan, recipe="another"))[1],
                (await client.start(cell.scan, more=["deadline=5"]))[1],
            ]
            _, nothing, error = await client.call("ResultManagement/GetResultById", ua.ResultIdDataType(Id="x"), 0)
            errors += [error, nothing.ResultState]
            await client.call("VisionStateMachine/Halt", ua.Variant(0, ua.VariantType.Int32), "a test")
            errors.append((await client.start(cell.scan))[1])
            while await client.state("VisionStateMachine") != "Halted":
                await asyncio.sleep(0.01)
            assert cell.post().status == 503
            await client.call("VisionStateMachine/Reset", ua.Variant(0, ua.VariantType.Int32), "a test")
            errors.append((await client.start(cell.scan))[1])
            return errors

    assert asyncio.run(asked()) == [-403, -404, -404, -400, -404, 0, -503, 0]


def test_results_can_be_found_and_the_recipe_is_known_by_its_hash(vision):
    cell, url = vision

    async def asked():
        async with Standard(url) as client:
            for part in ("A", "B", "A"):
                cell.done(cell.post(part=part))
            none = ua.BinaryIdBaseDataType(Id="")
            number = ua.Variant(0, ua.VariantType.UInt32)
            filters = (
                ua.Variant(0, ua.VariantType.Int32), ua.MeasIdDataType(), ua.PartIdDataType(Id="A"), none, none, none,
                none, ua.ProductIdDataType(), ua.JobIdDataType(), number, number, ua.Variant(0, ua.VariantType.Int32),
            )  # fmt: skip
            found = await client.call("ResultManagement/GetResultListFiltered", *filters)
            parts = await client.call(
                "ResultManagement/GetResultComponentsById", found[3][0].ResultId, ua.Variant(0, ua.VariantType.Int32)
            )
            prepared = await client.call("RecipeManagement/PrepareRecipe", none, found[3][0].InternalRecipeId)
            other = await client.call("RecipeManagement/PrepareRecipe", none, ua.BinaryIdBaseDataType(Id="another"))
            listed = await client.call(
                "RecipeManagement/GetRecipeListFiltered", none, ua.ProductIdDataType(),
                ua.Variant(2, ua.VariantType.Int32), number, number, ua.Variant(0, ua.VariantType.Int32),
            )  # fmt: skip
            recipe = await client.node("RecipeManagement/Recipe/InternalId")
            return found, parts, prepared, other, listed, await recipe.read_value()

    found, parts, prepared, other, listed, recipe = asyncio.run(asked())
    assert (found[0], found[1], found[4]) == (True, 2, 0)
    assert [one.PartId.Id for one in found[3]] == ["A", "A"]
    assert parts[6].Id == "A" and parts[-1] == 0 and parts[4] == 1
    assert (prepared[1], prepared[2], other[1], other[2]) == (True, 0, False, -404)
    assert listed[3] == [recipe] and listed[4] == 0


def test_no_event_is_lost_and_each_is_quick(vision):
    """Scans come as fast as the service takes them; the latency is from the result to the client's handler."""
    cell, url = vision
    count, ended = 300, {}
    cell.service.on_result.append(lambda result: ended.setdefault(result.id, time.time()))

    async def asked():
        async with Standard(url) as client:
            await client.listen()
            for _ in range(count):
                while cell.post().status != 202:
                    await asyncio.sleep(0.01)
                await asyncio.sleep(0)
            await client.heard(count)
            return client.events

    events = asyncio.run(asked())
    assert [event.JobId.Id for _, event in events] == list(ended)
    late_ms = sorted(1e3 * (came - ended[event.JobId.Id]) for came, event in events)
    assert late_ms[count // 2] < 1000, late_ms[:: count // 10]  # bench/serve/events.py measures it


def test_another_file_is_no_nodeset(running, tmp_path):
    cell = running()
    other = tmp_path / "other.xml"
    other.write_text("<UANodeSet xmlns='http://opcfoundation.org/UA/2011/03/UANodeSet.xsd'/>")
    server = MachineVision(cell.service, other, f"opc.tcp://127.0.0.1:{free_port()}/")
    with pytest.raises(InputError, match=r"--nodeset .*other\.xml: expected Opc\.Ua\.MachineVision"):
        asyncio.run_coroutine_threadsafe(server.start(), cell.loop).result(60)


def test_the_command_serves_both(tmp_path):
    url = f"opc.tcp://127.0.0.1:{free_port()}/debulk"
    call = "from debulk.cli import main; main()"
    words = ["serve", "--port", "0", "--opcua", url, "--nodeset", str(NODESET)]
    process = subprocess.Popen([sys.executable, "-c", call, *words], cwd=tmp_path, stdout=subprocess.PIPE, text=True)

    async def state():
        async with Standard(url) as client:
            return await client.state("VisionStateMachine"), await client.state(vision_client.AUTOMATIC)

    try:
        assert process.stdout.readline().startswith("debulk: http://")
        assert asyncio.run(state()) == ("Operational", "Initialized")  # no inspector is there yet
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
        process.stdout.close()
