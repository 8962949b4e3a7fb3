"""The command that runs the service of a cell."""

from __future__ import annotations

import logging
import sys
from pathlib import Path
from typing import Annotated

import typer

from debulk import InputError
from debulk.cli.given import Approved, ChainFile, Given
from debulk.cli.support import chain_of


def serve(
    reference: Annotated[
        Path | None, typer.Option(help="Reference of the inspector named default; others come by PUT /inspectors/NAME.")
    ] = None,
    *,
    given: Given,
    chain: ChainFile = None,
    approved: Approved = None,
    history: Annotated[
        Path | None, typer.Option(help="The cell's history, .sqlite, to which reports are added.")
    ] = None,
    folder: Annotated[
        list[Path] | None, typer.Option(help="Folder whose files may be named in requests; repeatable.")
    ] = None,
    deadline: Annotated[float | None, typer.Option(help="Seconds for a scan that comes without a deadline.")] = None,
    queue: Annotated[int, typer.Option(min=1, max=1000, help="Scans that may wait; one more is refused.")] = 8,
    most_mb: Annotated[float, typer.Option(min=0.001, max=100000, help="Largest scan that may be sent, MB.")] = 1000,
    spool: Annotated[Path | None, typer.Option(help="Folder for scans that are sent; unset: the system's.")] = None,
    host: Annotated[str, typer.Option(help="Address to listen at; others than localhost are open to the network.")] = (
        "127.0.0.1"
    ),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any that is free.")] = 8642,
    opcua: Annotated[
        str | None, typer.Option(help="Also serve OPC UA there: opc.tcp://127.0.0.1:4840/debulk (extra opcua).")
    ] = None,
    nodeset: Annotated[
        Path | None, typer.Option(help="The types of OPC 40100-1, Opc.Ua.MachineVision.NodeSet2.xml, for --opcua.")
    ] = None,
) -> None:
    """Inspect scans as they come by HTTP, and show the newest verdict on a screen; needs the extra "serve".

    It serves until it is interrupted. There is no password: whoever reaches the address can use it.
    """
    if deadline is not None and not 0 < deadline <= 3600:
        raise InputError(f"--deadline: expected a number of seconds up to 3600, got {deadline:g}")
    from debulk.results.extras import imported

    if (opcua is None) != (nodeset is None):
        raise InputError("--opcua: expected together with --nodeset; docs/serve.md says where to get the file")
    if opcua is not None:
        if not opcua.startswith("opc.tcp://"):
            raise InputError(f"--opcua: expected an address like opc.tcp://127.0.0.1:4840/debulk, got {opcua!r}")
        imported("asyncua", "opcua", "debulk serve --opcua")
        logging.getLogger("asyncua").setLevel(logging.ERROR)  # it warns of what docs/serve.md says: no encryption
    for module in ("starlette", "uvicorn"):
        imported(module, "serve", "debulk serve")

    from debulk.history.kept import history_of
    from debulk.serve.folders import Folders
    from debulk.serve.inspectors import Cell
    from debulk.serve.running import serve as run
    from debulk.serve.service import Service

    cell = Cell(
        **given.read(),
        chain=chain_of(chain),
        approved=approved,
        unit=given.unit,
        frame_unit=given.in_frame,
        outline_layer=given.outline_layer,
    )
    first = None if reference is None else cell.inspector(reference)
    folders, kept_in = Folders(folder or []), history_of(history)

    def made() -> Service:
        service = Service(cell, folders, kept_in, queue, deadline)
        if first is not None:
            service.inspectors.begin("default")
            service.inspectors.end(first)
        return service

    both = None if opcua is None or nodeset is None else (opcua, nodeset)

    def ready(address: str) -> None:
        print(f"debulk: {address}", flush=True)

    left = run(made, host, port, spool, int(most_mb * 1e6), ready, both)
    print(f"debulk serve: ended; {left} scans have no result", file=sys.stderr)
