"""Clouds as bytes of every kind of file, made here and not by debulk, for the tests of its readers."""

import gzip
import io
import re
import struct

import numpy as np


def lzf(data):
    """Compress as PCL does: the last place of the same three bytes, if near enough."""
    out, seen, run, i = bytearray(), {}, 0, 0

    def literals(end):
        for first in range(run, end, 32):
            part = data[first : min(end, first + 32)]
            out.append(len(part) - 1)
            out.extend(part)

    while i < len(data):
        place = seen.get(data[i : i + 3], -1) if i + 3 <= len(data) else -1
        seen[data[i : i + 3]] = i
        distance, length = i - place, 0
        if place >= 0 and distance <= 8192:
            while length < 264 and i + length < len(data) and data[i + length - distance] == data[i + length]:
                length += 1
        if length < 3:
            i += 1
            continue
        literals(i)
        code, far = length - 2, distance - 1
        out.append(min(code, 7) << 5 | far >> 8)
        if code >= 7:
            out.append(code - 7)
        out.append(far & 255)
        i += length
        run = i
    literals(i)
    return bytes(out)


def pcd(body, data="binary", **lines):
    header = {
        "VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": "2",
        "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": "2",
    }  # fmt: skip
    header |= lines
    text = "".join(f"{key} {value}\n" for key, value in header.items() if value is not None)
    return f"{text}DATA {data}\n".encode() + body


def shape_lines(points):
    height, width = points.shape[:2] if points.ndim == 3 else (1, len(points))
    return {"WIDTH": width, "HEIGHT": height, "POINTS": height * width}


def compressed_pcd(points, wide=False):
    """Return x, y, z and a colour, compressed; wide: x and z are doubles."""
    flat = points.reshape(-1, 3)
    types = ["<f8", "<f4", "<f8"] if wide else ["<f4"] * 3
    columns = b"".join(flat[:, k].astype(types[k]).tobytes() for k in range(3)) + bytes(range(4)) * len(flat)
    body = lzf(columns)
    sizes = "8 4 8 4" if wide else "4 4 4 4"
    lines = {"FIELDS": "x y z rgb", "SIZE": sizes, "TYPE": "F F F U", "COUNT": "1 1 1 1"} | shape_lines(points)
    return pcd(struct.pack("<II", len(body), len(columns)) + body, "binary_compressed", **lines)


def ply(points, form="binary_little_endian", kind="float"):
    shape = f"comment debulk organised {points.shape[1]} {points.shape[0]}\n" if points.ndim == 3 else ""
    properties = "".join(f"property {kind} {axis}\n" for axis in "xyz")
    header = f"ply\nformat {form} 1.0\n{shape}element vertex {points.size // 3}\n{properties}end_header\n".encode()
    if form == "ascii":
        return header + lines_of(points)
    order = "<" if "little" in form else ">"
    return header + points.astype(order + {"float": "f4", "double": "f8"}[kind]).tobytes()


def lines_of(points, separator=" "):
    return "".join(separator.join(map(str, row.tolist())) + "\n" for row in points.reshape(-1, 3)).encode()


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def npz(array, save=np.savez):
    file = io.BytesIO()
    save(file, points=array)
    return file.getvalue()


def ptx(points, motion="1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"):
    """Return a Leica PTX, column by column; 0 0 0 is what was not seen."""
    height, width = points.shape[:2] if points.ndim == 3 else (len(points), 1)
    columns = np.nan_to_num(points.reshape(height, width, 3).swapaxes(0, 1).reshape(-1, 3))
    rows = "".join(" ".join(map(str, row.tolist())) + " 0.5\n" for row in columns)
    return f"{width}\n{height}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{motion}{rows}".encode()


TEXT_ENDINGS = (".xyz", ".csv", ".txt", ".pts", ".asc")


def all_kinds(points):
    """Return (name, bytes) of the same cloud in every kind of file; those of TEXT_ENDINGS forget an organised shape."""
    return [
        ("le.npy", npy(points)),
        ("be.npy", npy(points.astype(">f4"))),
        ("double.npy", npy(points.astype("<f8"))),
        ("fortran.npy", npy(np.asfortranarray(points))),
        ("stored.npz", npz(points)),
        ("deflated.npz", npz(points.astype("f8"), np.savez_compressed)),
        ("binary.pcd", pcd(points.astype("<f4").tobytes(), **shape_lines(points))),
        ("ascii.pcd", pcd(lines_of(points), "ascii", **shape_lines(points))),
        ("packed.pcd", compressed_pcd(points)),
        ("packed_wide.pcd", compressed_pcd(points, wide=True)),
        ("le.ply", ply(points)),
        ("be.ply", ply(points, "binary_big_endian", "double")),
        ("ascii.ply", ply(points, "ascii")),
        ("blanks.xyz", b"# made by hand\n" + lines_of(points)),
        ("commas.csv", b"x,y,z\n" + lines_of(points, ",")),
        ("semicolons.txt", lines_of(points, ";")),
        ("counted.pts", f"{points.size // 3}\n".encode() + lines_of(points)),
        ("decimal_commas.asc", b"sep=;\r\nX;Y;Z\r\n" + lines_of(points, ";").replace(b".", b",")),
    ]


PLY_TYPES = {
    "f4": "float", "f8": "double", "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint"
}  # fmt: skip


def ply_of(elements, form="binary_little_endian", lines=""):
    """Write any elements: (name, properties, rows), with a type, or a pair of types for a list, for each property."""
    header, body = [f"ply\nformat {form} 1.0\n{lines}"], []
    order = ">" if "big" in form else "<"
    for name, properties, rows in elements:
        header.append(f"element {name} {len(rows)}\n")
        for label, kind in properties.items():
            words = f"list {PLY_TYPES[kind[0]]} {PLY_TYPES[kind[1]]}" if isinstance(kind, tuple) else PLY_TYPES[kind]
            header.append(f"property {words} {label}\n")
        for row in rows:
            words = []
            for value, kind in zip(row, properties.values(), strict=True):
                if isinstance(kind, tuple):
                    words += [(len(value), kind[0]), *((item, kind[1]) for item in value)]
                else:
                    words.append((value, kind))
            if form == "ascii":
                body.append((" ".join(str(np.dtype(kind).type(value)) for value, kind in words) + "\n").encode())
            else:
                body.append(b"".join(np.array(value).astype(order + kind).tobytes() for value, kind in words))
    return "".join(header).encode() + b"end_header\n" + b"".join(body)


def range_grid(points, form="binary_little_endian"):
    """Write an organised cloud as Stanford's scanners, PCL and MVE do: only what was seen, and where in the image."""
    flat = points.reshape(-1, 3)
    seen = np.isfinite(flat).all(axis=1)
    numbers = np.cumsum(seen) - 1
    cells = [([int(number)] if one else [],) for number, one in zip(numbers, seen, strict=True)]
    shape = f"obj_info num_cols {points.shape[1]}\nobj_info num_rows {points.shape[0]}\n"
    vertices = ("vertex", dict.fromkeys("xyz", "f4"), flat[seen].tolist())
    grid = ("range_grid", {"vertex_indices": ("u1", "i4")}, cells)
    return ply_of([vertices, ("face", {"vertex_indices": ("u1", "i4")}, []), grid], form, shape)


def pcl_camera(points, form="binary_little_endian", viewport=None, axes=(1, 0, 0, 0, 1, 0, 0, 0, 1)):
    """Write a cloud with the camera in which PCL keeps the shape."""
    high, wide = viewport or points.shape[:2]
    names = ["view_px", "view_py", "view_pz"] + [f"{a}_axis{b}" for a in "xyz" for b in "xyz"]
    camera = dict.fromkeys(names, "f4") | {"focal": "f4", "viewportx": "i4", "viewporty": "i4", "k1": "f4"}
    vertices = ("vertex", dict.fromkeys("xyz", "f4") | {"red": "u1"}, [(*p, 7) for p in points.reshape(-1, 3).tolist()])
    return ply_of(
        [vertices, ("face", {"q": ("u1", "i4")}, []), ("camera", camera, [(0, 0, 0, *axes, 0, wide, high, 0)])], form
    )


def lists_everywhere(points, form="binary_little_endian"):
    """Write unorganised points among lists: in elements before them, and among their own properties."""
    before = ("patch", {"corners": ("u1", "i2"), "label": "u4"}, [([1, 2, 3], 4), ([], 5), ([9], 6)])
    kinds = {"many": ("i4", "f8"), "z": "f8", "x": "f4", "few": ("u1", "u1"), "y": "f4"}
    rows = [
        ([0.5] * (k % 3), p[2], p[0], [k % 256] * (k % 2), p[1]) for k, p in enumerate(points.reshape(-1, 3).tolist())
    ]
    return ply_of([("note", {}, []), before, ("vertex", kinds, rows), ("face", {"q": ("u1", "i4")}, [])], form)


def page_padded(data, page=4096):
    """Pad a binary PCD as PCL's PCDWriter does: the file is as long as the points and a page."""
    return data + b"\0" * (page - data.index(b"DATA binary\n") - len(b"DATA binary\n"))


def records(points, names="xyz", kind="<f4"):
    """Return records of x, y, z and a colour."""
    out = np.zeros(points.shape[:-1], dtype=[(names[0], kind), ("rgb", "u1", 3), (names[1], kind), (names[2], kind)])
    for k, name in enumerate(names):
        out[name] = points[..., k]
    return out


def npz_of(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def of_producers(points):
    """Return (name, bytes) of the same organised cloud as other programs write it."""
    four = np.concatenate([points, np.ones_like(points[..., :1])], axis=-1)
    apart = {name: points[..., k] for k, name in enumerate("XYZ")}
    binary = pcd(points.astype("<f4").tobytes(), **shape_lines(points))
    capital = pcd(points.astype("<f4").tobytes(), **shape_lines(points), FIELDS="X Y Z")
    rows = np.zeros(points.size // 3, dtype=[("xyz", "<f4", 3), ("pad", "u1", 4), ("i", "<f4"), ("end", "u1", 15)])
    rows["xyz"] = points.reshape(-1, 3)
    ouster = {
        "FIELDS": "x y z _ intensity _ _", "SIZE": "4 4 4 1 4 1 1", "TYPE": "F F F U F U U", "COUNT": "1 1 1 4 1 0 15"
    }  # fmt: skip
    forms = [("le", "binary_little_endian"), ("be", "binary_big_endian"), ("ascii", "ascii")]
    return [
        ("padded.pcd", page_padded(binary)),
        ("capital.pcd", capital),
        ("ouster.pcd", pcd(rows.tobytes(), **(ouster | shape_lines(points)))),
        ("comment.pcd", "# Prüfstück\n".encode() + binary),
        *((f"{name}_grid.ply", range_grid(points, form)) for name, form in forms),
        *((f"{name}_camera.ply", pcl_camera(points, form)) for name, form in forms),
        ("comment.ply", ply(points).replace(b"ply\nformat", "ply \r\ncomment Prüfstück\nformat".encode())),
        ("latin.ply", ply(points).replace(b"ply\nformat", b"ply\ncomment Pr\xfcfst\xfcck\nformat")),
        ("capital.ply", re.sub(rb"float [xyz]", lambda found: b"float " + found[0][-1:].upper(), ply(points))),
        ("records.npy", npy(records(points))),
        ("f012.npy", npy(np.rec.fromarrays([points[..., k].astype(">f8") for k in range(3)], names="f0,f1,f2"))),
        ("triple.npy", npy(points.view([("xyz", "<f4", 3), ])[..., 0])),
        ("four.npy", npy(four)),
        ("four_fortran.npy", npy(np.asfortranarray(four.astype("f8")))),
        ("planes.npy", npy(np.ascontiguousarray(np.moveaxis(points, -1, 0)))),
        ("pcd.npz", npz_of(pcd=points, other=np.zeros(2))),
        ("point_cloud.npz", npz_of(point_cloud=records(points, "XYZ", ">f4"), colours=np.zeros(2))),
        ("apart.npz", npz_of(**apart, Q=np.zeros(2))),
        ("packed.pcd.gz", gzip.compress(binary)),
        ("packed.ply.gz", gzip.compress(ply(points))),
        ("packed.npy.gz", gzip.compress(npy(points))),
    ]  # fmt: skip


def unorganised_of_producers(points):
    """Return (name, bytes) of the points, in their order, in files that have no shape."""
    flat = points.reshape(-1, 3)
    forms = [("le", "binary_little_endian"), ("be", "binary_big_endian"), ("ascii", "ascii")]
    return [
        *((f"{name}_lists.ply", lists_everywhere(points, form)) for name, form in forms),
        ("columns.npy", npy(np.ascontiguousarray(flat.T))),
        ("records.npz", npz_of(arr=records(flat))),
        ("text.xyz.gz", gzip.compress(lines_of(points))),
    ]
