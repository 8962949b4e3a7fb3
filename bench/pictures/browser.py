"""Photographs a page with Chromium: all of it, or one of its parts."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

# The page's own policy forbids scripts of others, so the copy that is measured has none.
_POLICY = re.compile(r"<meta http-equiv=.Content-Security-Policy.[^>]*>")
_MEASURE = """<script>addEventListener("load", () => {
const box = (s) => document.querySelector(s).getBoundingClientRect()
const both = ([s, t]) => [Math.min(box(s).x, box(t).x), box(s).y, Math.max(box(s).right, box(t).right), box(t).bottom]
const boxes = {id: "boxes", textContent: JSON.stringify(%s.map(both))}
document.body.append(Object.assign(document.createElement("pre"), boxes))
})</script>"""


def photograph(page: Path, width: int, height: int) -> Image.Image:
    """Return the top of a page at that size."""
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder, "shot.png")
        _chromium(folder, page, width, height, f"--screenshot={shot}")
        return Image.open(shot).convert("RGB").copy()


def parts(page: Path, ends: list[tuple[str, str]], width: int, height: int) -> list[Image.Image]:
    """Return pictures, each from the element of one selector to that of another, on a page no longer than `height`."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "page.html")
        copy.write_text(_POLICY.sub("", page.read_text()) + _MEASURE % json.dumps(ends))
        boxes = re.search(r'<pre id="boxes">(.*?)</pre>', _chromium(folder, copy, width, height, "--dump-dom"))
        if boxes is None:
            raise SystemExit(f"{page.name} lacks one of {ends}")
        whole = photograph(copy, width, height)
    return [whole.crop([round(side) for side in box]) for box in json.loads(boxes[1])]


def save(picture: Image.Image, path: Path, most_bytes: int = 300_000) -> None:
    """Write a picture in so few colours that the file is small; exit if it is not."""
    few = picture.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE, kmeans=8)
    few.save(path, optimize=True)
    print(f"{path.name}: {picture.width} x {picture.height} pixels, {path.stat().st_size} bytes")
    if path.stat().st_size > most_bytes:
        raise SystemExit(f"{path.name} is larger than {most_bytes} bytes")


def _chromium(home: str, page: Path, width: int, height: int, task: str) -> str:
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("Chromium is not installed: apt-get install chromium")
    flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--user-data-dir={home}/home"]
    flags += [f"--window-size={width},{height}", "--virtual-time-budget=5000", task]
    done = subprocess.run([browser, *flags, page.as_uri()], check=True, capture_output=True, text=True)
    return done.stdout
