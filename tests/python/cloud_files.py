"""Clouds as bytes of every kind of file, made here and not by debulk, for the tests of its readers."""

import io
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
