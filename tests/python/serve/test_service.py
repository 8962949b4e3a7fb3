"""The service over HTTP, with an inspector that answers at once: its queue, its refusals, and what it survives."""

import http.client
import os
import re
import resource
import socket
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from debulk import InputError, Report, Verdict
from debulk.files.clouds import read_cloud
from debulk.history import History
from debulk.net import Draping
from debulk.recipe import Recipe
from debulk.serve import events, service
from debulk.serve.folders import Folders
from debulk.serve.inspectors import Cell
from debulk.serve.result import Result


def test_a_ply_draped_from_a_place_is_draped_from_there_along_other_angles():
    cell = Cell(Recipe(), fibre_angles_deg=Draping((1.0, 2.0)))
    assert cell.changed((45.0, 135.0), None).fibre_angles_deg == Draping((1.0, 2.0), (45.0, 135.0))
    assert cell.changed(None, None) is cell


def test_a_path_is_inspected_and_its_result_can_be_asked_for(running):
    cell = running(deadline_s=60.0)
    posted = cell.post(part="A-17", ply=3)
    result = cell.done(posted)
    assert (result["verdict"], result["passed"], result["part"], result["ply"]) == ("CEASE", True, "A-17", "3")
    assert [deed["do"] for deed in result["do"]] == ["draw the vacuum"]
    size, deadline, context = cell.quick.seen[0]
    assert size == 100 and 50 < deadline < 60 and context == {"part": "A-17", "ply": "3"}
    assert set(result) == set(Result.__dataclass_fields__)


def test_a_scan_is_sent_and_nothing_of_it_stays(running):
    cell = running()
    body = cell.scan.read_bytes()
    posted = cell.ask(
        "POST", "inspections?name=a.npy&part=B&deadline_s=5", body, Content_Type="application/octet-stream"
    )
    assert cell.done(posted)["part"] == "B"
    assert cell.quick.seen[0][1] < 5
    assert os.listdir(cell.spool) == []


def test_a_deadline_counts_from_when_the_scan_came(running):
    cell = running()
    cell.quick.gate.clear()
    cell.post()
    cell.wait_for(lambda: cell.quick.seen)
    cell.post(deadline_s=0.2)
    time.sleep(0.3)
    cell.quick.gate.set()
    cell.wait_for(lambda: len(cell.quick.seen) == 2)
    assert cell.quick.seen[1][1] == 1e-3


@pytest.mark.parametrize(
    ("report", "word"),
    [
        (InputError("the scan shows nothing"), "the scan shows nothing"),
        (RuntimeError("a bug"), "a fault of debulk's: see the log, and report it"),
    ],
)
def test_a_scan_that_cannot_be_inspected_is_invalid(running, monkeypatch, report, word):
    cell = running()

    def fail(*_, **__):
        raise report

    monkeypatch.setattr(cell.quick, "inspect", fail)
    result = cell.done(cell.post())
    assert (result["verdict"], result["refused"], result["passed"]) == ("INVALID", True, False)
    assert result["reason"] == word


def test_a_full_queue_says_when_to_come_back_and_then_takes_more(running):
    cell = running(most_waiting=2)
    cell.quick.gate.clear()
    first = cell.post()
    cell.wait_for(lambda: cell.quick.seen)
    waiting = [cell.post() for _ in range(2)]
    full = cell.post()
    assert full.status == 503 and full.headers["Retry-After"] == "1" and "2 scans wait already" in full.json["error"]
    assert "debulk_queue_full_total 1" in cell.ask("GET", "metrics").text
    cell.quick.gate.set()
    assert [cell.done(one)["verdict"] for one in (first, *waiting)] == ["CEASE"] * 3
    assert cell.post().status == 202


def test_a_client_that_still_sends_sees_why_it_is_refused(running):
    """One that closes afterwards, as urllib does, saw a connection that was reset."""
    cell = running(most_bytes=20_000_000, most_waiting=1)
    cell.quick.gate.clear()
    cell.post()
    cell.wait_for(lambda: cell.quick.seen)
    cell.post()
    body = bytes(16_000_000)
    full = [cell.ask("POST", "inspections?name=a.npy", body, **BYTES) for _ in range(3)]
    assert [(one.status, one.headers["Retry-After"]) for one in full] == [(503, "1")] * 3
    other = cell.ask("POST", "inspections?name=../a.npy", body, **BYTES)
    assert other.status == 400 and "name: expected letters" in other.json["error"]


def test_a_history_receives_every_report(running, tmp_path):
    history = History(tmp_path / "cell.sqlite")
    cell = running(history=history)
    cell.quick.report = Report(verdict=Verdict.CREASE, reason="made up", pockets=())
    cell.done(cell.post())
    assert history.report(1).reason == "made up"
    assert history.report(1).source["inspector"] == "default"


JSON = {"Content_Type": "application/json"}
BYTES = {"Content_Type": "application/octet-stream"}


@pytest.mark.parametrize(
    ("method", "path", "body", "headers", "status", "word"),
    [
        ("POST", "inspections", b"{", JSON, 400, "no JSON"),
        ("POST", "inspections", b"[]", JSON, 400, "expected a JSON object"),
        ("POST", "inspections", b"\xff\xfe", JSON, 400, "no JSON"),
        ("POST", "inspections", b"[" * 60_000, JSON, 400, "no JSON"),
        ("POST", "inspections", b"{}", JSON, 400, "expected a path"),
        ("POST", "inspections", b'{"path": "/etc/passwd"}', JSON, 403, "expected a file in a folder given by --folder"),
        ("POST", "inspections", b'{"path": "SCANS/../../etc/passwd"}', JSON, 403, "expected a file in a folder"),
        ("POST", "inspections", b'{"path": "SCANS/away.npy"}', JSON, 404, "there is no such file"),
        ("POST", "inspections", b'{"path": "SCANS/pipe"}', JSON, 404, "there is no such file"),
        ("POST", "inspections", b'{"path": "SCANS/link"}', JSON, 403, "expected a file in a folder"),
        ("POST", "inspections", b'{"path": "\\u0000"}', JSON, 403, "expected a file in a folder"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "inspector": "b"}', JSON, 404, "PUT /inspectors/b"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "deadline_s": NaN}', JSON, 400, "deadline_s: expected"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "deadline_s": -1}', JSON, 400, "greater than 0"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "deadline": 1}', JSON, 400, "did you mean deadline_s?"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "self": 1}', JSON, 400, "self"),
        ("POST", "inspections", b'{"path": "SCANS/scan.npy", "part": "\\ud800"}', JSON, 400, "part: expected text"),
        ("POST", "inspections", b"x" * 70_000, JSON, 413, "too large"),
        ("POST", "inspections?name=a.npy", b"x" * 100_001, BYTES, 413, "too large"),
        ("POST", "inspections?name=a.npy", b"", BYTES, 400, "no body"),
        ("POST", "inspections?name=../a.npy", b"x", BYTES, 400, "name: expected letters"),
        ("POST", "inspections", b"x", BYTES, 400, "expected ?name="),
        ("POST", "inspections?name=a.npy", b"x", {"Content_Type": "text/plain"}, 415, "Content-Type: expected"),
        ("GET", "inspections/1", None, {}, 404, "there is no inspection 1"),
        ("GET", "inspections/1?wait_s=nan", None, {}, 400, "wait_s: expected 0 to 60 seconds"),
        ("GET", "away", None, {}, 404, "GET /away: not found"),
        ("DELETE", "inspections", None, {}, 405, "method not allowed"),
        ("PUT", "inspectors/a%20b", b'{"reference": "x"}', JSON, 400, "letters, digits"),
        ("PUT", "inspectors/b", b'{"reference": "/etc/passwd"}', JSON, 403, "in a folder given by --folder"),
        ("PUT", "inspectors/b", b"{}", JSON, 400, "reference: expected a value"),
        ("PUT", "inspectors/b", b'{"reference": "x", "angles": [0, 90, 3]}', JSON, 400, "expected at most 2 values"),
        ("DELETE", "inspectors/b", None, {}, 404, "there is no b"),
        ("GET", "state", None, {"Host": "evil.example"}, 400, "Invalid host"),
    ],
)
def test_hostile_input_gives_one_clear_error(running, method, path, body, headers, status, word):
    cell = running()
    os.mkfifo(cell.folder / "pipe")
    (cell.folder / "link").symlink_to("/etc/passwd")
    answer = cell.ask(method, path, body and body.replace(b"SCANS", str(cell.folder).encode()), **headers)
    assert answer.status == status and word in answer.text, answer.text
    assert answer.json is None or ("\n" not in answer.json["error"] and list(answer.json) == ["error"])
    assert os.listdir(cell.spool) == [] and cell.quick.seen == []
    assert cell.done(cell.post())["passed"]


def test_a_file_that_is_no_scan_is_invalid_and_says_why(running):
    cell = running()
    cell.scan.write_bytes(b"no scan")
    result = cell.done(cell.post())
    assert result["verdict"] == "INVALID" and "scan.npy" in result["reason"]
    body = cell.ask("POST", "inspections?name=a.npy", b"no scan", **BYTES)
    assert str(cell.spool) not in cell.done(body)["reason"]


def test_a_client_that_is_killed_while_it_sends_leaves_nothing(running):
    cell = running(most_waiting=1)
    client = http.client.HTTPConnection("127.0.0.1", cell.port)
    client.putrequest("POST", "/inspections?name=a.npy")
    client.putheader("Content-Type", "application/octet-stream")
    client.putheader("Content-Length", "90000")
    client.endheaders()
    client.send(b"x" * 1000)
    cell.wait_for(lambda: os.listdir(cell.spool))
    assert cell.post().status == 503  # its place in the queue is taken
    client.close()
    cell.wait_for(lambda: not os.listdir(cell.spool))
    assert cell.done(cell.post())["passed"]


def test_a_full_disk_refuses_the_scan_and_nothing_else(running):
    """The limit on the size of files stands for a full disk: writing fails with an error of the system."""
    cell = running(most_bytes=10_000_000)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        full = cell.ask("POST", "inspections?name=a.npy", b"x" * 5_000_000, **BYTES)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert full.status == 507 and "no room for the scan" in full.json["error"]
    assert os.listdir(cell.spool) == []
    assert cell.done(cell.post())["passed"]


def test_a_reader_that_hangs_holds_up_nobody(running, monkeypatch):
    """It asks for events and takes none: the service leaves it once its own buffers are full."""
    monkeypatch.setattr(events, "_PATIENCE_S", 0.3)
    monkeypatch.setattr(events, "_APART_S", 0.0)
    cell = running()
    cell.quick.report = Report(verdict=Verdict.CREASE, reason="x" * 200_000, pockets=())
    hung = socket.create_connection(("127.0.0.1", cell.port))
    hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    hung.sendall(b"GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n")
    source = next(r.endpoint for r in cell.web.routes if r.path == "/events")
    cell.wait_for(lambda: source.listeners == 1)
    for _ in range(8):
        assert cell.done(cell.post())["verdict"] == "CREASE"
    cell.wait_for(lambda: source.listeners == 0)
    hung.close()


def test_a_file_that_cannot_be_read_to_its_end_is_given_up(running, monkeypatch):
    monkeypatch.setattr(service, "_LATE_S", 0.1)
    monkeypatch.setattr(service, "MOST_HANGING", 1)
    drive = threading.Event()

    def read(path, unit):
        if path.name == "dead.npy":
            drive.wait(30)
        return read_cloud(path, unit)

    cell = running(read=read)
    (cell.folder / "dead.npy").write_bytes(cell.scan.read_bytes())
    gone = cell.done(cell.post(path=str(cell.folder / "dead.npy"), deadline_s=0.1))
    assert gone["verdict"] == "INVALID" and "check the drive" in gone["reason"]
    refused = cell.post()
    assert refused.status == 503 and "check the drives" in refused.json["error"]
    assert cell.ask("GET", "health").status == 503
    drive.set()
    cell.wait_for(lambda: cell.ask("GET", "health").status == 200)
    assert cell.done(cell.post())["passed"]
    assert len(cell.quick.seen) == 1  # what was given up was not inspected afterwards


def test_old_results_are_forgotten(running, monkeypatch):
    monkeypatch.setattr(service, "KEPT", 3)
    cell = running()
    posted = [cell.post() for _ in range(5) if not time.sleep(0.02)]
    cell.done(posted[-1])
    assert [cell.ask("GET", one.headers["Location"][1:]).status for one in posted] == [404, 404, 200, 200, 200]


def test_an_inspector_is_replaced_and_no_scan_meets_the_old_one(running):
    cell = running()
    np.save(cell.folder / "flat.npy", np.zeros((3, 3)))
    reference = {"reference": str(cell.folder / "flat.npy")}
    answer = cell.ask("PUT", "inspectors/default", reference)
    assert answer.status == 202
    assert cell.post().status in (409, 503)
    cell.wait_for(lambda: cell.ask("GET", "inspectors").json["default"] not in ("ready", "preparing"))
    refused = cell.post()
    assert refused.status == 409 and "flat.npy" in refused.json["error"]
    assert cell.ask("GET", "health").status == 503
    assert cell.ask("DELETE", "inspectors/default").status == 204
    assert cell.post().status == 404


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"--folder: there is no folder .*away"):
        Folders([tmp_path / "away"])


def test_the_pages_lines_follow_the_results(running):
    """The Python on docs/serve.md, which a bridge to MQTT needs."""
    cell = running()
    page = (Path(__file__).resolve().parents[3] / "docs/serve.md").read_text(encoding="utf-8")
    names = {}
    exec(re.search(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)[1], names)
    before = cell.done(cell.post())["id"]
    source = next(r.endpoint for r in cell.web.routes if r.path == "/events")
    came = []

    def follow():
        for one in names["results"](cell.url):
            came.append(one["id"])
            if len(came) == 3:
                return

    thread = threading.Thread(target=follow)
    thread.start()
    cell.wait_for(lambda: source.listeners == 1)
    time.sleep(0.3)
    posted = [cell.done(cell.post())["id"] for _ in range(3)]
    thread.join(20)
    assert came == posted and before not in came
