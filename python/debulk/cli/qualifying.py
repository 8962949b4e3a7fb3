"""The command that qualifies the chain of scanner, filters and export."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from debulk import InputError
from debulk.cli.given import Given, numbers_of
from debulk.cli.support import check_output, shown_progress


def qualify(
    scans: Annotated[list[Path], typer.Argument(help="At least ten scans of one unmoved layup, in their order.")],
    reference: Annotated[Path, typer.Option(help="Cloud of what lay there before this ply was draped.")],
    name: Annotated[str, typer.Option(help="The chain's name, such as the cell's.")] = "chain",
    *,
    given: Given,
    strip: Annotated[
        str | None, typer.Option(help="x,y,x,y,height,width in mm: ends and size of a strip that --strip-scan shows.")
    ] = None,
    strip_scan: Annotated[list[Path] | None, typer.Option(help="Scan of the strip; at least three.")] = None,
    ridge: Annotated[bool, typer.Option(help="The strip is a printed ridge, H cos²(πx/w) in section.")] = False,
    output: Annotated[
        list[Path] | None, typer.Option("-o", "--output", help=".json or .html; repeatable; unset: chain.json.")
    ] = None,
) -> None:
    """Qualify the chain of scanner, filters and export; needs the extra "qualify" (SciPy).

    Scans in several folders, equally many in each, are of several sessions: days, operators or set-ups.
    """
    outputs = output or [Path("chain.json")]
    for path in outputs:
        check_output(path, ".json", ".html")
    if (strip is None) != (not strip_scan):
        raise InputError("--strip: expected together with --strip-scan")
    if ridge and strip is None:
        raise InputError("--ridge: expected together with --strip, its place and size")
    size = "six numbers: x,y,x,y,height,width"
    numbers = None if strip is None else numbers_of(strip, "--strip", size, 6)

    from debulk import files
    from debulk.chain import Gauge
    from debulk.chain.qualifying import qualify as qualified

    settings = given.read()
    folders = [str(path.parent) for path in scans]
    gauge = None
    if numbers is not None:
        ends = (numbers[0], numbers[1]), (numbers[2], numbers[3])
        gauge = Gauge(
            _loaded(strip_scan or [], given.unit), *ends, numbers[4], numbers[5], "ridge" if ridge else "strip"
        )
    with shown_progress() as progress:
        chain = qualified(
            _loaded(scans, given.unit),
            files.load_cloud(reference, given.unit),
            progress=lambda stage, _: progress(stage, int(stage.split()[-1]) / len(scans)),
            **settings,
            name=name,
            sessions=folders if len(set(folders)) > 1 else None,
            gauge=gauge,
        )
    for path in outputs:
        chain.save(path)
        print(f"written: {path}")
    for study in chain.studies:
        tolerance = "" if study.percent_tolerance is None else f", P/T {study.percent_tolerance:.1f} %"
        print(f"{study.quantity}: %GRR {study.percent_grr:.1f} %{tolerance}, {study.rating}")
    for doubt in chain.doubts:
        print(f"note: {doubt}")


def _loaded(paths: list[Path], unit: Literal["mm", "m"]) -> Iterator[Any]:
    """Read one cloud after the other, when it is asked for."""
    from debulk import files

    for path in paths:
        yield files.load_cloud(path, unit)
