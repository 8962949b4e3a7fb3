"""`debulk serve` as it is run: from its command line to the verdict of a virtual layup, and to its end."""

import json
import re
import signal
import subprocess
import sys
import urllib.request

import numpy as np
import pytest

import debulk
from debulk.history import History

pytestmark = pytest.mark.layup
CALL = "from debulk.cli import main; main()"
WORDS = ["serve", "--port", "0", "--reference", "ref.npy", "--pose", "pose.txt", "--outline", "outline.csv"]
BYTES = "application/octet-stream"
WORDS += ["--folder", ".", "--history", "cell.sqlite", "--spool", "."]


@pytest.fixture
def cell(tmp_path):
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    debulk.files.save_cloud(tmp_path / "ref.npy", layup.reference)
    debulk.files.save_cloud(tmp_path / "scan.npy", layup.scan)
    np.savetxt(tmp_path / "pose.txt", layup.mold_from_scanner)
    np.savetxt(tmp_path / "outline.csv", layup.ply_outline, delimiter=",")
    return tmp_path


def ask(address, method="GET", body=None, kind="application/json"):
    data = json.dumps(body).encode() if isinstance(body, dict) else body
    request = urllib.request.Request(address, data, {"Content-Type": kind}, method=method)
    with urllib.request.urlopen(request, timeout=90) as answer:
        return json.loads(answer.read()), answer.headers


def test_from_the_command_to_the_verdict_and_to_the_end(cell):
    process = subprocess.Popen([sys.executable, "-c", CALL, *WORDS], cwd=cell, stdout=subprocess.PIPE, text=True)
    try:
        home = re.search(r"http://\S+", process.stdout.readline())[0]
        assert ask(f"{home}health")[0]["ok"]
        _, headers = ask(f"{home}inspections", "POST", {"path": str(cell / "scan.npy"), "part": "A-17", "ply": 1})
        by_path = ask(f"{home}{headers['Location'][1:]}?wait_s=60")[0]["result"]
        ask(f"{home}inspectors/next", "PUT", {"reference": str(cell / "ref.npy"), "angles": [45, -45]})
        while ask(f"{home}inspectors")[0]["next"] == "preparing":
            pass
        body = (cell / "scan.npy").read_bytes()
        sent = f"{home}inspections?name=scan.npy&inspector=next"
        _, headers = ask(sent, "POST", body, BYTES)
        turned = ask(f"{home}{headers['Location'][1:]}?wait_s=60")[0]["result"]
        seen = [f"{x},{y},5,95" for x in range(-800, 801, 80) for y in range(-800, 801, 80)]
        (cell / "angles.csv").write_text("\n".join(seen))
        _, headers = ask(f"{home}inspections?name=scan.npy&angles={cell / 'angles.csv'}", "POST", body, BYTES)
        measured = ask(f"{home}{headers['Location'][1:]}?wait_s=60")[0]["result"]
        (cell / "angles.csv").write_text("no table")
        paths = {"path": str(cell / "scan.npy"), "angles": str(cell / "angles.csv")}
        _, headers = ask(f"{home}inspections", "POST", paths)
        unread = ask(f"{home}{headers['Location'][1:]}?wait_s=60")[0]["result"]
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    process.stdout.close()
    history = History(cell / "cell.sqlite")
    kept = history.report(by_path["record"])
    assert (by_path["verdict"], by_path["reason"]) == (kept.verdict.name, kept.reason) == ("CREASE", kept.reason)
    assert [deed["place_mm"] for deed in by_path["do"] if deed["verdict"] == "CREASE"]
    assert len(by_path["outline_mm"]) > 3
    assert measured["verdict"] == "INVALID" and "5.0 degrees counter-clockwise from nominal" in measured["reason"]
    assert unread["refused"] and "angles.csv: expected a table of numbers" in unread["reason"]
    other = history.report(turned["record"])
    assert other.trace.fibre_angles_deg.tolist() == [45.0, -45.0] and other.source["inspector"] == "next"
    assert sorted(path.name for path in cell.iterdir() if path.name.startswith("debulk-serve")) == []


def test_sigterm_amid_inspections_ends_it_with_a_whole_history_and_no_scan_left(cell):
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", CALL, *WORDS], cwd=cell, text=True, **piped)
    try:
        home = re.search(r"http://\S+", process.stdout.readline())[0]
        body = (cell / "scan.npy").read_bytes()
        first, *_ = [
            ask(f"{home}inspections?name=scan.npy", "POST", body, "application/octet-stream")[1] for _ in range(3)
        ]
        ask(f"{home}{first['Location'][1:]}?wait_s=60")
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    assert re.fullmatch(r"debulk serve: ended; [0-2] scans have no result\n", process.communicate()[1])
    history = History(cell / "cell.sqlite")
    assert history.check().passed and 1 <= len(history.find()) <= 3
    assert not list(cell.glob("debulk-serve*"))


def test_a_port_that_is_taken_is_named(cell):
    import socket

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        done = subprocess.run(
            [sys.executable, "-m", "debulk", "serve", "--port", port],
            cwd=cell,
            capture_output=True,
            text=True,
            timeout=60,
        )
    assert done.returncode == 2 and f"--port {port}: cannot be listened to" in done.stderr


def test_a_service_that_can_inspect_no_more_ends(cell):
    """It must not go on to accept scans that nobody inspects."""
    broken = """
import debulk.serve.service as service
async def work(self):
    raise RuntimeError("broken by the test")
service.Service.work = work
"""
    done = subprocess.run(
        [sys.executable, "-c", broken + CALL, "serve", "--port", "0"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 70 and "broken by the test" in done.stderr
