"""Tells PyInstaller what debulk needs besides what its imports show; the entry point in pyproject.toml names it."""

from pathlib import Path


def hook_dirs() -> list[str]:
    """Return the folder with `hook-debulk.py`.

    Examples
    --------
    >>> [folder] = hook_dirs()
    >>> (Path(folder) / "hook-debulk.py").is_file()
    True
    """
    return [str(Path(__file__).parent)]
