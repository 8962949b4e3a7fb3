"""Loads `debulk serve` with small requests, and watches its memory.

python bench/serve/load.py [REQUESTS] > bench/serve/load.txt

Of a hundred requests one is inspected (a virtual layup of 640 x 480 pixels, sent or by path); the others ask for
results and states, are refused, send broken bodies, or leave midway. The machine was busy with other programs.
"""

import http.client
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import debulk

CALL = "from debulk.cli import main; main()"


class Load:
    """Requests of every kind, one after the other, from one client that keeps its connection."""

    def __init__(self, port: int, folder: Path) -> None:
        self.port, self.scan = port, folder / "scan.npy"
        self.body = self.scan.read_bytes()
        self.client = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
        self.last = "none"
        self.verdicts: dict[str, int] = {}

    def ask(
        self, method: str, path: str, body: bytes | None = None, kind: str = "application/json"
    ) -> tuple[int, bytes]:
        self.client.request(method, path, body, {"Content-Type": kind})
        answer = self.client.getresponse()
        return answer.status, answer.read()

    def inspected(self, sent: bool) -> float:
        began = time.perf_counter()
        if sent:
            status, text = self.ask("POST", "/inspections?name=scan.npy", self.body, "application/octet-stream")
        else:
            status, text = self.ask("POST", "/inspections", json.dumps({"path": str(self.scan)}).encode())
        assert status == 202, text
        self.last = json.loads(text)["id"]
        status, text = self.ask("GET", f"/inspections/{self.last}?wait_s=60")
        verdict = json.loads(text)["result"]["verdict"]
        self.verdicts[verdict] = self.verdicts.get(verdict, 0) + 1
        return time.perf_counter() - began

    def other(self, k: int) -> None:
        match k % 9:
            case 0 | 1:
                assert self.ask("GET", "/state")[0] == 200
            case 2:
                assert self.ask("GET", f"/inspections/{self.last}")[0] == 200
            case 3:
                assert self.ask("GET", "/metrics")[0] == 200
            case 4:
                assert self.ask("POST", "/inspections", b'{"path": "/etc/passwd"}')[0] == 403
            case 5:
                assert self.ask("POST", "/inspections", b"{")[0] == 400
            case 6:
                assert self.ask("GET", "/away")[0] == 404
            case 7:  # leaves in the middle of a scan
                gone = http.client.HTTPConnection("127.0.0.1", self.port)
                gone.putrequest("POST", "/inspections?name=a.npy")
                gone.putheader("Content-Type", "application/octet-stream")
                gone.putheader("Content-Length", "900000")
                gone.endheaders(b"x" * 1000)
                gone.close()
            case 8:  # listens for a moment
                gone = http.client.HTTPConnection("127.0.0.1", self.port)
                gone.request("GET", "/events")
                gone.getresponse().readline()
                gone.close()


def memory_mb(process: int) -> float:
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def main(requests: int) -> None:
    layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        debulk.files.save_cloud(folder / "ref.npy", layup.reference)
        debulk.files.save_cloud(folder / "scan.npy", layup.scan)
        np.savetxt(folder / "pose.txt", layup.mold_from_scanner)
        np.savetxt(folder / "outline.csv", layup.ply_outline, delimiter=",")
        words = ["serve", "--port", "0", "--reference", "ref.npy", "--pose", "pose.txt", "--folder", "."]
        words += ["--outline", "outline.csv"]
        process = subprocess.Popen([sys.executable, "-c", CALL, *words], cwd=folder, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        port = int(process.stdout.readline().rstrip("/\n").rpartition(":")[2])
        load, times = Load(port, folder), []
        print(f"{'requests':>9} {'inspected':>9} {'memory MB':>9} {'open files':>10} {'threads':>7}")
        for k in range(requests + 1):
            if k % (requests // 20) == 0:
                files = len(list(Path(f"/proc/{process.pid}/fd").iterdir()))
                threads = len(list(Path(f"/proc/{process.pid}/task").iterdir()))
                print(f"{k:9} {len(times):9} {memory_mb(process.pid):9.1f} {files:10} {threads:7}", flush=True)
            if k % 100 == 0:
                times.append(load.inspected(sent=k % 200 == 0))
            else:
                load.other(k)
        process.terminate()
        ended = process.wait(30)
    median_ms = 1e3 * statistics.median(times)
    print(f"verdicts {load.verdicts}; median {median_ms:.0f} ms from scan to verdict; exit code {ended}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20_000)
