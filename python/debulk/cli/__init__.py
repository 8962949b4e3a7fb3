"""The command line, ``debulk``."""

from __future__ import annotations

from debulk.cli.commands import app, main

__all__ = ["app", "main"]
