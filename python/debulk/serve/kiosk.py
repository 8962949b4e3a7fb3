"""The operator's screen: one page that stands alone, and fetches nothing but the events."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from pathlib import Path

_PARTS = Path(__file__).with_name("screen")


@cache
def page() -> str:
    """Return the page, with its style and its script in it."""
    html = (_PARTS / "screen.html").read_text(encoding="utf-8")
    return html.replace("/* style */", _part("screen.css")).replace("/* script */", _part("screen.js"))


@cache
def content_policy() -> str:
    """Return what the browser may do with the page: run this script, and talk to this service alone."""
    script, style = (_digest(_part(name)) for name in ("screen.js", "screen.css"))
    return f"default-src 'none'; script-src '{script}'; style-src '{style}'; connect-src 'self'; img-src data:"


def _part(name: str) -> str:
    return (_PARTS / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
