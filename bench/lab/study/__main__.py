"""``python -m lab.study [--quick] [--workers 2] [folder]`` runs the whole study, by default into bench/study."""

import argparse

from lab.study import main

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m lab.study", description="The solver's error against its run time.")
    parser.add_argument("folder", nargs="?", default="bench/study", help="for tables and pictures")
    parser.add_argument("--quick", action="store_true", help="a few pockets and settings, in seconds")
    parser.add_argument("--workers", type=int, default=1, help="processes, a layup each")
    options = parser.parse_args()
    main(options.folder, options.quick, options.workers)
