"""What an archive holds: a folder for each layup, with a file `layup.toml` that names its clouds and what they need."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from debulk._core import InputError
from debulk.arguments import typed
from debulk.toml_text import values_in

NAME = "layup.toml"


class Layup(BaseModel):
    """A layup of an archive; the names of files are relative to its folder."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    folder: Path
    """Where `layup.toml` lies."""
    scan: Path
    reference: Path
    """`scan`, `reference`: clouds of the draped ply and of what lay there before."""
    outline: Path | None = None
    outline_layer: str | None = None
    mask: Path | None = None
    pose: Path | None = None
    """`outline`, `outline_layer`, `mask`, `pose`: as for `debulk inspect`; a pose of "identity" says that the clouds
    are in the mold's frame."""
    angles_deg: tuple[float, float] = (0.0, 90.0)
    measured_angles: Path | None = None
    camera: tuple[float, float, float] | None = None
    unit: Literal["mm", "m"] = "mm"
    frame_unit: Literal["mm", "m"] | None = None
    """`angles_deg`, `measured_angles`, `camera`, `unit`, `frame_unit`: fibre directions, degrees from mold +x; what a
    sensor saw of them; f, cx, cy in pixels; "mm" or "m"; that of pose, outline and measured angles, None: as `unit`."""
    context: dict[str, Any]
    """What is kept with the report. Without ``part`` the folder's name within the archive is the part."""

    @property
    def in_frame(self) -> Literal["mm", "m"]:
        """Unit of what is given in the mold frame."""
        return self.frame_unit or self.unit

    @property
    def key(self) -> tuple[str, str]:
        """Part and ply, as a history holds them."""
        return str(self.context["part"]), str(self.context.get("ply", ""))


@typed
def layups(archive: str | PathLike[str]) -> list[Layup]:
    """Return the layups of an archive, in the order of their folders' names.

    Parameters
    ----------
    archive
        A folder; every folder below it that holds a file `layup.toml` is a layup.

    Raises
    ------
    InputError
        If there is none, one cannot be read, or two have the same part and ply.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> folder = pathlib.Path(tempfile.mkdtemp()) / "A-17"
    >>> folder.mkdir()
    >>> _ = (folder / "layup.toml").write_text("scan = 'scan.npy'" + chr(10) + "reference = 'mold.npy'")
    >>> layups(folder.parent)[0].key
    ('A-17', '')
    """
    archive = Path(archive)
    found, wrong = list[Layup](), list[str]()
    for path in sorted(archive.rglob(NAME)):
        try:
            found.append(_read(path, archive))
        except InputError as error:
            wrong.append(str(error))
    if wrong:  # all of them, so that they are mended at once
        raise InputError("\n".join(wrong))
    if not found:
        raise InputError(f"{archive}: expected folders with a file {NAME}, found none")
    by_key: dict[tuple[str, str], Layup] = {}
    for layup in found:
        other = by_key.setdefault(layup.key, layup)
        if other is not layup:
            part, ply = layup.key
            raise InputError(f"{other.folder} and {layup.folder}: both are ply {ply!r} of part {part!r}")
    return found


def _read(path: Path, archive: Path) -> Layup:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error}") from None
    given = values_in(data, path, "a layup")
    context = given.setdefault("context", {})
    if isinstance(context, dict):
        context.setdefault("part", path.parent.relative_to(archive).as_posix())
    try:
        return Layup(**{**given, "folder": path.parent})
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"{path}: {where}: {first['msg']}") from None
