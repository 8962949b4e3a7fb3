"""The kind of a file, determined from its first bytes, so that errors can name it whatever the file is called."""

from __future__ import annotations

from debulk.files.source import Source

TEXT = (".xyz", ".csv", ".txt", ".pts", ".asc")

_CLOUDS = {
    b"\x93NUMPY": ".npy", b"PK\x03\x04": ".npz", b"PK\x05\x06": ".npz", b"ply\n": ".ply", b"ply\r\n": ".ply",
    b"# .PCD": ".pcd", b"# PCD": ".pcd", b"VERSION": ".pcd", b"FIELDS": ".pcd",
}  # fmt: skip
_OTHERS = {
    b"\x1f\x8b": ("gzip data", "unpack it first (gunzip)"),
    b"BZh": ("bzip2 data", "unpack it first (bunzip2)"),
    b"\xfd7zXZ": ("xz data", "unpack it first (unxz)"),
    b"\x28\xb5\x2f\xfd": ("zstd data", "unpack it first (unzstd)"),
    b"7z\xbc\xaf": ("a 7z archive", "unpack it first"),
    b"<!doctype html": ("a web page", "the download went wrong: download the file itself"),
    b"<html": ("a web page", "the download went wrong: download the file itself"),
    b"<?xml": ("XML", "export the cloud as .ply or .pcd"),
    b"version https://git-lfs": ("a Git LFS pointer", "get the file itself (git lfs pull)"),
    b"\x89HDF": ("HDF5 data", "export the cloud as .npy, .ply or .pcd"),
    b"ASTM-E57": ("E57 data", "export the cloud as .ply or .pcd"),
    b"LASF": ("LAS data", "export the cloud as .ply or .pcd"),
    b"\x89PNG": ("a picture", "give the cloud, not its picture"),
    b"\xff\xd8\xff": ("a picture", "give the cloud, not its picture"),
    b"%PDF": ("a PDF", "give the cloud"),
    b"\xff\xfe": ("UTF-16 text", "save it as UTF-8 text"),
    b"\xfe\xff": ("UTF-16 text", "save it as UTF-8 text"),
    b"\x80": ("a Python pickle", "pickles are never read: save the array with numpy.save"),
}  # fmt: skip


def check_kind(source: Source, extension: str) -> None:
    """Refuse a file whose bytes do not match the kind that its name claims."""
    head = source.file.read(64)
    source.file.seek(0)
    if not head:
        source.fail(0, "the file is empty")
    kind = next((kind for start, kind in _CLOUDS.items() if head.startswith(start)), "")
    if kind == extension:
        return
    if kind:
        source.fail(0, f"the file holds {kind} data", f"rename it to end in {kind}")
    opening = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    for start, (what, remedy) in _OTHERS.items():
        if head.startswith(start) or (start.startswith(b"<") and opening.startswith(start)):
            source.fail(0, f"the file holds {what}", remedy)
    if extension not in (*TEXT, ".ptx"):
        source.fail(0, f"the file does not start like {extension} data")
