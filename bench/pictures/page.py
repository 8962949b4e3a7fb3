"""Make the pictures of a report: page.png of the README, and those of docs/report.md.

This needs Chromium and Pillow (extra "bench"). The time on the page is that of this run, so run it on a quiet machine.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from browser import parts, photograph, save

HERE = Path(__file__).parent
WIDTH = 960
PARTS = {
    "report_top.png": (".banner", "#do"),
    "report_map.png": ("#map", "#map"),
    "report_table.png": ("#pockets", "#pockets tbody tr:nth-child(6)"),
    "report_pocket.png": ("#pocket-2", "#pocket-2"),
}


def main() -> None:
    """Make the pictures beside this file."""
    with tempfile.TemporaryDirectory() as folder:
        demo = "from debulk.cli import main; main()"
        subprocess.run([sys.executable, "-c", demo, "demo", "-o", folder], check=True, stdout=subprocess.DEVNULL)
        page = Path(folder, "report.html")
        save(photograph(page, WIDTH, 1741), HERE / "page.png")
        for name, picture in zip(PARTS, parts(page, list(PARTS.values()), WIDTH, 12_000), strict=True):
            save(picture, HERE / name)


if __name__ == "__main__":
    main()
