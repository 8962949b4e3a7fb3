"""The command that makes pages of reports that are there already."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from debulk import InputError
from debulk.cli.support import check_writable, outcome


def page(
    reports: Annotated[list[Path], typer.Argument(help="Reports, .json; several: the plies of a stack.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The page, .html.")],
) -> None:
    """Make the page of a report, or one page of the reports of a stack: the worst plies first, then ply by ply.

    The plies stand in the order of their numbers where each report has one (debulk inspect --context ply=3), otherwise
    in the order given. Where a report's own page lies beside it under the same name, it is linked.
    """
    with outcome():
        if output.suffix.lower() != ".html":
            raise InputError(f"{output}: expected a file ending in .html")
        check_writable(output)

        from debulk.files import replacing
        from debulk.page.stack import Layup
        from debulk.page.stack import page as stack_page
        from debulk.report import Report

        found = [Report.load(path) for path in reports]
        if len(found) == 1:
            found[0].save(output)
        else:
            layups = [Layup(one, path.name, _own_page(path, output)) for one, path in zip(found, reports, strict=True)]
            html = stack_page(layups)
            with replacing(output) as temporary:
                temporary.write_text(html, encoding="utf-8", newline="\n")
        print(f"written: {output}")


def _own_page(report: Path, output: Path) -> str:
    """Return the link from the new page to the report's own, or nothing."""
    own = report.with_suffix(".html")
    if not own.is_file() or own.resolve() == output.resolve():
        return ""
    return quote(Path(os.path.relpath(own.resolve(), output.resolve().parent)).as_posix())
