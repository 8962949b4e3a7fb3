"""How long it takes to drape a whole ply over a double-curved mold: python bench/front/drape.py [--spacing 2.4]."""

from __future__ import annotations

import argparse
import time

import numpy as np

from debulk import net, surface


def main() -> None:
    """Print the number of nodes, and the least processor time of five drapes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spacing", type=float, default=2.4, help="of the net, mm")
    options = parser.parse_args()
    across = np.arange(-400.0, 401.0, 4.0)
    x, y = np.meshgrid(across, across)
    mold = surface.Reference(60 * np.cos(x / 400) * np.cos(y / 500), (-400.0, -400.0), 4.0)
    took = []
    for _ in range(5):
        began = time.process_time()
        draped = net.drape(mold, (0.0, 0.0), (0.0, 90.0), options.spacing)
        took.append(time.process_time() - began)
    print(f"{len(draped.nodes_mm)} nodes in {min(took):.2f} s of a core")


if __name__ == "__main__":
    main()
