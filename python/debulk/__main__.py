"""The command line as ``python -m debulk``, where no ``debulk`` is on the path."""

from __future__ import annotations

from debulk.cli import main

if __name__ == "__main__":
    main()
