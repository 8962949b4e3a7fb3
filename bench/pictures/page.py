"""Make page.png, the README's picture: the top of the page of `debulk demo`, in so few colours that the file is small.

This needs Chromium and Pillow (extra "bench"). The time on the page is that of this run, so run it on a quiet machine.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

SIZE = (960, 1741)
MAX_BYTES = 300_000


def main() -> int:
    """Make the picture beside this file."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        print("Chromium is not installed: apt-get install chromium", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as folder:
        demo = "from debulk.cli import main; main()"
        subprocess.run([sys.executable, "-c", demo, "demo", "-o", folder], check=True, stdout=subprocess.DEVNULL)
        shot = Path(folder, "page.png")
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        flags += [f"--user-data-dir={folder}/home", f"--window-size={SIZE[0]},{SIZE[1]}", f"--screenshot={shot}"]
        command = [browser, *flags, Path(folder, "report.html").as_uri()]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
        picture = Image.open(shot).convert("RGB")
    picture = picture.quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE, kmeans=8)
    path = Path(__file__).with_name("page.png")
    picture.save(path, optimize=True)
    print(f"{path.name}: {picture.width} x {picture.height} pixels, {path.stat().st_size} bytes")
    return 0 if path.stat().st_size <= MAX_BYTES else 1


if __name__ == "__main__":
    sys.exit(main())
