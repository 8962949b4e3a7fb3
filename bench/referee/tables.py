"""Tables that grow row by row, so that existing rows are not computed again."""

from __future__ import annotations

import csv
import platform
import subprocess
from collections.abc import Mapping
from pathlib import Path

import debulk

HERE = Path(__file__).parent


class Table:
    """A CSV file with one header, whose rows are identified by their key columns."""

    def __init__(self, name: str, columns: list[str], keys: list[str]) -> None:
        self.path = HERE / name
        self.columns, self.keys = columns, keys
        if not self.path.exists():
            self.path.write_text(",".join(columns) + "\n", encoding="utf-8")
        self.done = {tuple(row[k] for k in keys) for row in self.rows()}

    def rows(self) -> list[dict[str, str]]:
        """Return all rows so far."""
        with self.path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def has(self, *key: object) -> bool:
        """Return whether there is a row with this key."""
        return tuple(str(k) for k in key) in self.done

    def add(self, row: Mapping[str, object]) -> None:
        """Append one row; an interrupted run leaves only whole rows."""
        text = {k: f"{v:.6g}" if isinstance(v, float) else str(v) for k, v in row.items()}
        with self.path.open("a", encoding="utf-8", newline="") as file:
            csv.DictWriter(file, self.columns, lineterminator="\n").writerow(text)
        self.done.add(tuple(text[k] for k in self.keys))


def build() -> str:
    """Return what computed a row: the package's version, and the last commit that changed its sources."""
    sources = [HERE.parents[1] / "cpp", HERE.parents[1] / "python"]
    commit = subprocess.run(
        ["git", "log", "-1", "--format=%h", "--", *sources], cwd=HERE, capture_output=True, text=True, check=False
    )
    return f"debulk {debulk.__version__} {commit.stdout.strip() or 'unknown'} python {platform.python_version()}"
