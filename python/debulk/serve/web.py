"""The service over HTTP: what each address takes and answers."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from debulk.serve.asked import MOST_JSON, Inspection, Reference, checked_name, of_json, of_query
from debulk.serve.events import Events
from debulk.serve.kiosk import content_policy, page
from debulk.serve.receiving import passed_over, received, received_json
from debulk.serve.refusal import Refusal
from debulk.serve.result import Job
from debulk.serve.service import Service
from debulk.serve.state import health, metrics, overview

_LONGEST_WAIT_S = 60.0
_JSON, _BYTES = "application/json", "application/octet-stream"


def application(service: Service, spool: Path, most_bytes: int, hosts: list[str]) -> Starlette:
    """Return the ASGI application of a service, whose `work` runs in the same event loop.

    Scans that are sent, of at most `most_bytes`, lie in the folder `spool`. `hosts` are the names under which a browser
    may ask: a foreign page that has its name point here is not answered.
    """
    web = _Web(service, spool, most_bytes)
    routes = [
        Route("/", web.kiosk),
        Route("/events", Events(service)),
        Route("/state", web.state),
        Route("/health", web.health),
        Route("/metrics", web.metrics),
        Route("/inspections", web.post, methods=["POST"]),
        Route("/inspections/{number}", web.get),
        Route("/inspectors", web.inspectors),
        Route("/inspectors/{name}", web.prepare, methods=["PUT"]),
        Route("/inspectors/{name}", web.remove, methods=["DELETE"]),
    ]
    return Starlette(
        routes=routes,
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=hosts, www_redirect=False)],
        exception_handlers={Refusal: web.refused, HTTPException: _no_address},
    )


class _Web:
    def __init__(self, service: Service, spool: Path, most_bytes: int) -> None:
        self.service, self.spool, self.most_bytes = service, spool, most_bytes

    async def kiosk(self, _: Request) -> Response:
        return HTMLResponse(page(), headers={"Content-Security-Policy": content_policy(), "Cache-Control": "no-store"})

    async def state(self, _: Request) -> Response:
        return JSONResponse(overview(self.service))

    async def health(self, _: Request) -> Response:
        found = health(self.service)
        return JSONResponse(found, 200 if found["ok"] else 503)

    async def metrics(self, _: Request) -> Response:
        return PlainTextResponse(metrics(self.service), media_type="text/plain; version=0.0.4")

    async def post(self, request: Request) -> Response:
        kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if kind not in (_JSON, _BYTES):  # what a foreign page can send without asking is refused with the rest
            raise Refusal(415, f"Content-Type: expected {_JSON} with a path, or {_BYTES} with a scan")
        if kind == _JSON:
            asked = of_json(Inspection, await received_json(request, MOST_JSON))
            if asked.path is None or asked.name is not None:
                raise Refusal(400, "expected a path, and no name; or send the scan itself")
            job = self.service.submit(asked)
        else:
            job = await self._sent(request)
        place = f"/inspections/{job.id}"
        answer = {"id": job.id, "state": self.service.state_of(job.id), "waiting": self.service.waiting, "result": None}
        return JSONResponse(answer, 202, headers={"Location": place})

    async def _sent(self, request: Request) -> Job:
        asked = of_query(Inspection, request.query_params)
        if asked.name is None or asked.path is not None:
            raise Refusal(400, "expected ?name=scan.pcd, which tells the kind of file, and no path")
        inspector = self.service.inspectors.get(asked.inspector)
        angles = self.service.folders.optional(asked.angles)
        with self.service.place_in_the_queue():
            scan = await received(request, self.spool, asked.name, self.most_bytes)
        return self.service.accept(asked, inspector, scan, angles, sent=True)

    async def get(self, request: Request) -> Response:
        number = request.path_params["number"]
        wait_s = _seconds(request.query_params.get("wait_s", "0"))
        found = await self.service.result(number, wait_s)
        return JSONResponse(
            {
                "id": number,
                "state": self.service.state_of(number),
                "waiting": self.service.waiting,
                "result": dataclasses.asdict(found) if found else None,
            }
        )

    async def inspectors(self, _: Request) -> Response:
        return JSONResponse(self.service.inspectors.names())

    async def prepare(self, request: Request) -> Response:
        name = checked_name(request.path_params["name"])
        asked = of_json(Reference, await received_json(request, MOST_JSON))
        self.service.prepare(name, asked)
        return JSONResponse({name: "preparing"}, 202, headers={"Location": "/inspectors"})

    async def remove(self, request: Request) -> Response:
        self.service.remove(request.path_params["name"])
        return Response(status_code=204)

    async def refused(self, request: Request, error: Any) -> Response:
        if error.status != 408:  # whoever is silent sends no more
            await passed_over(request, self.most_bytes)
        after = {} if error.retry_after_s is None else {"Retry-After": str(math.ceil(error.retry_after_s))}
        return JSONResponse({"error": str(error)}, error.status, headers=after)


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds <= _LONGEST_WAIT_S:
        raise Refusal(400, f"wait_s: expected 0 to {_LONGEST_WAIT_S:g} seconds, got {text[:40]!r}")
    return seconds


async def _no_address(request: Request, error: Any) -> Response:
    told = f"{request.method} {request.url.path[:100]}: {error.detail.lower()}; docs/serve.md lists what there is"
    return JSONResponse({"error": told}, error.status_code, headers=error.headers)
