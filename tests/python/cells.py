"""A service that runs in a thread, with an inspector that answers at once: what is tested is what is round it."""

import asyncio
import json
import socket
import threading
import time
import urllib.error
import urllib.request
from types import SimpleNamespace

import numpy as np
import uvicorn

from debulk import Recipe, Report, Verdict
from debulk.serve.folders import Folders
from debulk.serve.inspectors import Cell
from debulk.serve.service import Service
from debulk.serve.web import application


class Quick:
    """Stands for an inspector: its verdict is the one that the scan's context asks for."""

    def __init__(self):
        self.recipe, self.seen, self.gate = Recipe(), [], threading.Event()
        self.gate.set()
        self.report = Report(verdict=Verdict.CEASE, reason="no pocket", pockets=())
        self.cancelled = 0

    def inspect(self, scan, deadline_s=None, context=None, *, fibre_angles_deg=None):
        self.seen.append((len(scan), deadline_s, context))
        self.gate.wait(30)
        return self.report

    def cancel(self):
        self.cancelled += 1
        self.gate.set()


class Running:
    """A service, where it listens, and how to ask it."""

    def __init__(self, tmp_path, most_bytes=100_000, **settings):
        self.folder, self.spool = tmp_path / "scans", tmp_path / "spool"
        self.folder.mkdir()
        self.spool.mkdir()
        self.quick = Quick()
        self.scan = self.folder / "scan.npy"
        np.save(self.scan, np.random.default_rng(0).uniform(1, 90, (100, 3)).astype(np.float32))
        self.most_bytes, self.settings = most_bytes, settings
        self.started = threading.Event()
        self.port = 0
        self.start()

    def start(self):
        self.started.clear()
        self.thread = threading.Thread(target=lambda: asyncio.run(self._serve()))
        self.thread.start()
        assert self.started.wait(20)

    async def _serve(self):
        self.loop = asyncio.get_running_loop()
        self.service = Service(Cell(Recipe()), Folders([self.folder]), **self.settings)
        self.service.inspectors.begin("default")
        self.service.inspectors.end(self.quick)
        bound = socket.create_server(("127.0.0.1", self.port))
        self.port = bound.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/"
        self.web = web = application(self.service, self.spool, self.most_bytes, ["127.0.0.1", "localhost"])
        self.server = uvicorn.Server(uvicorn.Config(web, log_level="critical", timeout_graceful_shutdown=1))
        work = asyncio.ensure_future(self.service.work())
        asyncio.get_running_loop().call_soon(self.started.set)
        await self.server.serve(sockets=[bound])
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)
        bound.close()

    def stop(self):
        self.server.should_exit = True
        self.quick.gate.set()
        self.thread.join(20)
        assert not self.thread.is_alive()

    def ask(self, method, path, body=None, **headers):
        """Return status, body and headers of an answer."""
        if isinstance(body, dict):
            body, headers = json.dumps(body).encode(), {"Content-Type": "application/json", **headers}
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        request = urllib.request.Request(self.url + path, body, named, method=method)
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                status, text, heads = answer.status, answer.read(), answer.headers
        except urllib.error.HTTPError as error:
            with error:
                status, text, heads = error.code, error.read(), error.headers
        return SimpleNamespace(
            status=status,
            text=text.decode(),
            headers=heads,
            json=json.loads(text) if text[:1] in b"{[" and text else None,
        )

    def post(self, **asked):
        return self.ask("POST", "inspections", {"path": str(self.scan), **asked})

    def done(self, posted):
        """Return the result of a scan that was posted."""
        assert posted.status == 202, posted.text
        return self.ask("GET", f"{posted.headers['Location'][1:]}?wait_s=30").json["result"]

    def wait_for(self, what, most_s=20.0):
        end = time.monotonic() + most_s
        while not what():
            assert time.monotonic() < end, "it did not happen"
            time.sleep(0.01)
