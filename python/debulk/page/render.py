"""Fills in the pages' templates: all text is escaped, there is one script, and nothing comes from a network."""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from debulk.page import net
from debulk.page.scales import HeightScale, colours, ridge_colours
from debulk.results.looks import VERDICT_SIGNS
from debulk.results.number import number
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from markupsafe import Markup

_TEMPLATES = Path(__file__).with_name("templates")
_SCRIPTS = ("turn.js", "map.js", "table.js", "state.js")


class Look(NamedTuple):
    """How a verdict is shown: a sign as well as a colour, and what it means for the reader."""

    sign: str
    advice: str


LOOKS = {
    Verdict.CEASE: Look(VERDICT_SIGNS[Verdict.CEASE], "Every pocket is predicted to close under vacuum."),
    Verdict.CREASE: Look(VERDICT_SIGNS[Verdict.CREASE], "At least one pocket is predicted to leave a wrinkle."),
    Verdict.UNDECIDED: Look(
        VERDICT_SIGNS[Verdict.UNDECIDED], "Too near a limit, not certified, or not done in time: nothing is promised."
    ),
    Verdict.INVALID: Look(
        VERDICT_SIGNS[Verdict.INVALID], "The scan or a part of it cannot be judged: see the reason, and scan again."
    ),
}


def render(template: str, **values: Any) -> str:
    """Fill in a template, including the parts that all pages share."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    environment.filters["signed"] = signed
    environment.filters["place"] = place
    environment.filters["arrow"] = arrow
    environment.filters["together"] = together
    environment.filters["codes"] = codes
    script = "\n".join((_TEMPLATES / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    # The browser runs only the script with this hash, whatever a name in the report may try to inject.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    shared = {
        "running": "",
        "looks": LOOKS,
        "margin": margin,
        "colours": colours(8),
        "palette": colours(net.COLOURS),
        "ramp": "".join(f"{r:02x}{g:02x}{b:02x}" for r, g, b in HeightScale.table().tolist()),
        "ridge_ramp": ridge_colours(),
        "ridge_palette": ridge_colours(net.COLOURS),
        "script": script,
        "script_hash": f"sha256-{digest}",
        "net_size": (net.WIDTH, net.HEIGHT),
    }
    return environment.get_template(template).render(shared | values)


def margin(value: float | None, limit: float | None) -> float | None:
    """Return by how much a figure is below its limit; negative above it."""
    return None if value is None or limit is None else limit - value


def signed(value: float, digits: int) -> str:
    """Return a figure with its sign, in print typography."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")


def place(xy: tuple[float, float]) -> str:
    """Return x and y in whole mm, in print typography, kept on one line."""
    return ",\u00a0".join(number(value, 0).replace("-", "−") for value in xy)


def arrow(angle_deg: float | None) -> str:
    """Return the arrow nearest to a direction, counter-clockwise from the map's right; empty if there is none.

    Examples
    --------
    >>> arrow(0.0), arrow(93.0), arrow(224.0), arrow(350.0), arrow(None)
    ('→', '↑', '↙', '→', '')
    """
    return "" if angle_deg is None else "→↗↑↖←↙↓↘"[round(angle_deg / 45) % 8]


def codes(text: str) -> Markup:
    """Set what stands between backticks as code, and escape all of it.

    Examples
    --------
    >>> str(codes("`level.tol_mm`, at most <0.35>"))
    '<code>level.tol_mm</code>, at most &lt;0.35&gt;'
    """
    from markupsafe import Markup, escape

    return Markup(re.sub("`([^`]*)`", r"<code>\1</code>", str(escape(text))))


def together(text: str) -> str:
    """Keep each place in a sentence, such as (-295, 2), on one line."""
    return re.sub(r"\((-?\d+), (-?\d+)\)", lambda m: f"({place((float(m[1]), float(m[2])))})", text)
