"""The kind of a file, determined from its first bytes, so that errors can name it whatever the file is called."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from typing import NoReturn

from debulk.files.source import Source

TEXT = (".xyz", ".csv", ".txt", ".pts", ".asc")

_CLOUDS = {
    rb"\x93NUMPY": ".npy", rb"PK\x03\x04|PK\x05\x06": ".npz", rb"(?:\xef\xbb\xbf)?ply[ \t]*\r?\n": ".ply",
    rb"(?:\xef\xbb\xbf)?(?:# ?\.?PCD|(?:[ \t\r\n]*#[^\n]*\n)*[ \t\r\n]*(?:VERSION|FIELDS)[ \t])": ".pcd",
}  # fmt: skip
_EXPORT = "export the cloud as .ply or .pcd"
_SURFACE = f"{_EXPORT}: the points as they were measured, not a surface made from them"
_DOWNLOAD = "the download went wrong: download the file itself"
_CONVERT = "read the message with rosbags or rclpy, and convert it by debulk.cloud.from_memory"
_MATLAB = "write the cloud by pcwrite(ptCloud, 'scan.pcd', Encoding='binary')"
_OTHERS = {
    rb"\x1f\x8b": ("gzip data", "let its name end in .gz after the kind that is packed, such as .pcd.gz"),
    rb"BZh": ("bzip2 data", "unpack it first (bunzip2)"),
    rb"\xfd7zXZ": ("xz data", "unpack it first (unxz)"),
    rb"\x28\xb5\x2f\xfd": ("zstd data", "unpack it first (unzstd)"),
    rb"7z\xbc\xaf": ("a 7z archive", "unpack it first"),
    rb"Rar!\x1a": ("a RAR archive", "unpack it first"),
    rb"(?i)\s*<(!doctype html|html)": ("a web page", _DOWNLOAD),
    rb"(?s).{0,200}<VTKFile|# vtk DataFile": ("VTK data", _EXPORT),
    rb"\s*<\?xml|\s*<X3D": ("XML", _EXPORT),
    rb"version https://git-lfs": ("a Git LFS pointer", "get the file itself (git lfs pull)"),
    rb"MATLAB (5\.0|7\.3) MAT-file": ("MATLAB data", _MATLAB),
    rb"\x89HDF|CDF[\x01\x02\x05]": (
        "HDF5 or NetCDF data, as Zivid's .zdf is",
        "export the cloud as .npy, .ply or .pcd (Zivid: frame.save('scan.pcd'), or numpy.save of copy_data('xyz'))",
    ),
    rb"ASTM-E57": ("E57 data", _EXPORT),
    rb"LASF": ("LAS or LAZ data", "export the cloud as .ply or .pcd (PDAL: pdal translate)"),
    rb"#ROSBAG V": ("a ROS bag, as ROS and RealSense write it", _CONVERT + "; RealSense: save_to_ply"),
    rb"\x89MCAP0": ("an MCAP file of ROS 2", _CONVERT),
    rb"SQLite format 3\0": ("an SQLite database, as a bag of ROS 2 is", _CONVERT),
    rb"glTF|\s*\{\s*\"asset\"": ("glTF data", _SURFACE),
    rb"DRACO": ("Draco data", _EXPORT),
    rb"solid[ \t\r\n].{0,200}?\s*facet": ("STL data", _SURFACE),
    rb"OFF[ \t\r\n]|COFF[ \t\r\n]|NOFF[ \t\r\n]": ("OFF data", _SURFACE),
    rb"ISO-10303-21": ("STEP data", _SURFACE),
    rb"Kaydara FBX": ("FBX data", _SURFACE),
    rb"#VRML|#Inventor": ("VRML data", _SURFACE),
    rb"(#[^\n]*\n|\s|(mtllib|o|g|s) [^\n]*\n){0,40}vn? +[-+.\d]": ("OBJ data", _SURFACE),
    rb"II\*\0|MM\0\*|II\+\0": (
        "a TIFF picture, perhaps of heights",
        "write points: x and y from column and row times the pitch, z from the height, NaN where the picture holds its "
        "mark for nothing seen; save them with numpy.save as (H, W, 3)",
    ),
    rb"\x89PNG|\xff\xd8\xff|GIF8|RIFF....WEBP|v/1\x01": ("a picture", "give the cloud, not its picture"),
    rb"%PDF": ("a PDF", "give the cloud"),
    rb"PAR1|ARROW1|FEA1": ("a table of Parquet or Arrow", "save its x, y, z with numpy.save as (N, 3) float32"),
    rb"\xff\xfe|\xfe\xff": ("UTF-16 text", "save it as UTF-8 text"),
    rb"\x80[\x02-\x05]": ("a Python pickle", "pickles are never read: save the array with numpy.save"),
}  # fmt: skip
_BY_ENDING = {  # of kinds that their first bytes do not tell
    ".3mf": ("3MF data", _SURFACE),
    ".om3": (
        "an object model of HALCON",
        "write it by write_object_model_3d (ObjectModel3D, 'ply_binary', 'scan.ply', [], []), and load it in metres "
        '(unit="m", --unit m)',
    ),
    ".praw": ("a frame of Photoneo", "save it as .ply in PhoXi Control"),
    ".zdf": ("a frame of Zivid", "save it as .pcd or .ply in Zivid Studio"), ".mat": ("MATLAB data", _MATLAB),
    ".svo": ("a recording of ZED", _EXPORT), ".svo2": ("a recording of ZED", _EXPORT),
}  # fmt: skip
_HEAD_BYTES = 1 << 10


def check_kind(source: Source, extension: str) -> None:
    """Refuse a file whose bytes do not match the kind that its name claims."""
    head = _head(source)
    if not head:
        source.fail(0, "the file is empty")
    kind = _cloud(head)
    if kind == extension:
        return
    if kind:
        _refuse_name(source, kind, head)
    _refuse_other(source, head)
    if extension not in (*TEXT, ".ptx"):
        source.fail(0, f"the file does not start like {extension} data")


def refuse_ending(source: Source, extension: str, known: str) -> None:
    """Refuse a file whose ending belongs to no reader; the error names what it holds and the way out."""
    head = _head(source)
    kind = _cloud(head)
    if kind and extension not in _BY_ENDING:
        _refuse_name(source, kind, head)
    _refuse_other(source, head)
    if extension in _BY_ENDING:
        what, remedy = _BY_ENDING[extension]
        source.fail(0, f"by its ending the file holds {what}, which debulk does not read", remedy)
    got = extension or "no ending"
    source.fail(0, f"expected a file ending in {known}, got {got!r}", "export it as one of these")


def _refuse_name(source: Source, kind: str, head: bytes) -> NoReturn:
    if kind == ".npz" and b".npy" not in head:
        source.fail(
            0, "the file holds a ZIP archive, as .xlsx and .ods are", "save its table as .csv, or unpack it first"
        )
    source.fail(0, f"the file holds {kind} data", f"rename it to end in {kind}")


def _head(source: Source) -> bytes:
    source.file.seek(0)
    head = source.file.read(_HEAD_BYTES)
    source.file.seek(0)
    return head


def _cloud(head: bytes) -> str:
    return next((kind for start, kind in _CLOUDS.items() if re.match(start, head)), "")


def _refuse_other(source: Source, head: bytes) -> None:
    opening = head.removeprefix(BOM_UTF8)
    for start, (what, remedy) in _OTHERS.items():
        if re.match(start, opening):
            source.fail(0, f"the file holds {what}", remedy)
    if len(head) > 84 and source.size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        source.fail(0, "the file holds STL data", _SURFACE)
