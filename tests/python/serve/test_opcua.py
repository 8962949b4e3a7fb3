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
from debulk.serve.result import Result
from vision_client import AUTOMATIC, Standard

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
    both[0].quick.gate.set()
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
            await client.listen(period_ms=600_000)  # a verdict does not wait for it
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
            await client.end("VisionStateMachine/Halt")
            errors.append((await client.start(cell.scan))[1])
            while await client.state("VisionStateMachine") != "Halted":
                await asyncio.sleep(0.01)
            assert cell.post().status == 503
            await client.end("VisionStateMachine/Reset")
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
    cell.service.on_change.append(lambda news: isinstance(news, Result) and ended.setdefault(news.id, time.time()))

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


def ways(client):
    """Return the transitions that a client heard of, and that each names its states."""
    events = [event for _, event in client.events]
    for event in events:
        assert event.Transition.Text.startswith(f"{event.FromState.Text}To{event.ToState.Text}")
    return [event.Transition.Text for event in events]


def test_each_transition_is_an_event_by_its_name_in_the_standard(vision):
    cell, url = vision
    nothing = ua.BinaryIdBaseDataType(Id="")

    async def asked():
        async with Standard(url) as client:
            await client.listen("StateChangedEventType")
            await client.start(cell.scan)
            await client.heard(2)
            cell.done(cell.post())
            await client.heard(4)
            cell.quick.gate.clear()
            await client.start(cell.scan)
            await client.heard(5)
            assert await client.end(f"{AUTOMATIC}/Abort") == 0
            await client.heard(6)
            cell.quick.gate.clear()
            await client.start(cell.scan)
            await client.heard(7)
            recipe = await client.call("RecipeManagement/UnprepareRecipe", nothing, nothing)
            assert recipe[1] == -409  # a job runs by it
            assert await client.end(f"{AUTOMATIC}/Stop") == 0
            cell.quick.gate.set()
            await client.heard(8)
            assert (await client.call("RecipeManagement/UnprepareRecipe", nothing, nothing))[1] == 0
            assert not await (await client.node("RecipeManagement/Recipe/IsPrepared")).read_value()
            errors = [(await client.start(cell.scan))[1], -cell.post().status]
            errors.append((await client.call("RecipeManagement/UnprepareRecipe", nothing, nothing))[1])
            errors.append(await client.call("RecipeManagement/Recipe/Unprepare"))
            await client.heard(9)
            assert await client.call("RecipeManagement/Recipe/Prepare") == [True, 0]
            await client.heard(10)
            assert await client.end("VisionStateMachine/Halt") == 0
            await client.heard(11)
            with pytest.raises(ua.UaStatusCodeError) as inactive:
                await client.state(AUTOMATIC)
            assert inactive.value.code == ua.StatusCodes.BadStateNotActive
            assert await client.end("VisionStateMachine/Reset") == 0
            await client.heard(13)
            assert await client.state(AUTOMATIC) == "Ready"
            known = {
                node.nodeid
                for kind in ("VisionStateMachineType", "VisionAutomaticModeStateMachineType")
                for node in await client.client.get_node(await client.type(kind)).get_children()
            }
            assert {getattr(event, "Transition/Id") for _, event in client.events} <= known
            return ways(client), errors

    heard, errors = asyncio.run(asked())
    assert heard == [
        "ReadyToSingleExecution", "SingleExecutionToReadyAuto",
        "ReadyToSingleExecutionAuto", "SingleExecutionToReadyAuto",
        "ReadyToSingleExecution", "SingleExecutionToReadyAbort",
        "ReadyToSingleExecution", "SingleExecutionToReadyStop",
        "ReadyToInitializedRecipe", "InitializedToReadyRecipe",
        "OperationalToHalted", "HaltedToPreoperational", "PreoperationalToOperationalAuto",
    ]  # fmt: skip
    assert errors == [-503, -503, -409, -409]


def test_a_continuous_job_takes_what_comes_into_its_folder_until_it_is_stopped(vision):
    cell, url = vision
    folder = cell.folder / "dropped"
    folder.mkdir()
    scan = cell.scan.read_bytes()
    (folder / "old.npy").write_bytes(scan)

    async def asked():
        async with Standard(url) as client, Standard(url) as other:
            await client.listen()
            await other.listen("StateChangedEventType")
            job, error = await client.start(folder, meas="7", method="StartContinuous")
            assert error == 0
            errors = [
                (await client.start(folder, method="StartContinuous"))[1],
                (await client.start(cell.scan))[1],
                (await client.start("/etc", method="StartContinuous"))[1],
            ]
            for name in ("a.npy", ".hidden.npy", "notes.dat", "b.npy"):
                (folder / name).write_bytes(scan)
            await client.heard(2)
            (folder / "a.npy").write_bytes(scan + b"")  # scanned anew, under the old name
            os.utime(folder / "a.npy", (1, 1))
            await client.heard(3)
            assert await client.state(AUTOMATIC) == "ContinuousExecution"
            (folder / "last.npy").write_bytes(scan)
            assert await client.end(f"{AUTOMATIC}/Stop") == 0
            (folder / "late.npy").write_bytes(scan)
            await client.heard(4)
            await other.heard(2)
            (folder / "later.npy").write_bytes(scan)
            job_2, error = await client.start(folder, method="StartContinuous")
            assert error == 0
            cell.quick.gate.clear()
            for name in ("c.npy", "d.npy"):
                (folder / name).write_bytes(scan)

            async def both():
                return cell.service.running is not None and cell.service.waiting == 1

            await client.until(both)
            assert await client.end(f"{AUTOMATIC}/Abort") == 0
            await client.heard(6)
            await other.heard(4)
            return job, job_2, errors, [event for _, event in client.events], ways(other)

    job, job_2, errors, events, heard = asyncio.run(asked())
    assert errors == [-409, -409, -403]
    assert [event.JobId for event in events] == 4 * [job] + 2 * [job_2]
    assert [event.MeasId.Id for event in events] == 4 * ["7"] + 2 * ["3"]
    assert len({event.ResultId.Id for event in events}) == 6
    assert [count for count, _, _ in cell.quick.seen] == 5 * [100]  # the scan that waited was not inspected
    assert "Abort of OPC UA" in events[-1].Message.Text and events[-1].ResultState == 4
    assert heard == [
        "ReadyToContinuousExecution", "ContinuousExecutionToReadyStop",
        "ReadyToContinuousExecution", "ContinuousExecutionToReadyAbort",
    ]  # fmt: skip


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
