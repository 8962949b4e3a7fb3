"""Time the loading of clouds against reading the same bytes: python bench/files/loaders.py [-o FILE].

Each file is read from the page cache, raw (numpy.fromfile, bytes) and as a cloud in turn, and the best time of several
is kept. So is the least processor time (over all threads), which is more reliable if others use the machine. The file
is made in a temporary folder (--folder: another place) and removed again.
"""

import argparse
import os
import platform
import struct
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import _core, files

Cloud = NDArray[np.float32]
Writer = Callable[[Path, Cloud], None]


def scene(width: int, height: int) -> Cloud:
    """Return the cloud of a mold seen from 2.4 m, with noise and with 3 % of its points missing."""
    rng = np.random.default_rng(0)
    u, v = np.meshgrid((np.arange(width) - width / 2) / (2.2 * width), (np.arange(height) - height / 2) / (2.2 * width))
    z = 2400 + 40 * np.cos(9 * u) + rng.normal(0, 0.05, u.shape)
    cloud = np.stack([u * z, v * z, z], axis=2).astype(np.float32)
    cloud[rng.random(u.shape) < 0.03] = np.nan
    return cloud


def pcd_header(cloud: Cloud, data: str, fields: str = "x y z") -> bytes:
    count = len(fields.split())
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE{' 4' * count}\nTYPE{' F' * count}\nCOUNT{' 1' * count}\n"
        f"WIDTH {cloud.shape[1]}\nHEIGHT {cloud.shape[0]}\nVIEWPOINT 0 0 0 1 0 0 0\nDATA {data}\n"
    ).encode()


def ply_header(cloud: Cloud, form: str, extra: str = "") -> bytes:
    properties = "".join(f"property float {axis}\n" for axis in "xyz")
    return (
        f"ply\nformat {form} 1.0\ncomment debulk organised {cloud.shape[1]} {cloud.shape[0]}\n"
        f"element vertex {cloud.size // 3}\n{properties}{extra}end_header\n"
    ).encode()


def with_colour(cloud: Cloud) -> NDArray[np.void]:
    rows = np.zeros(cloud.size // 3, dtype=[("xyz", "<f4", 3), ("rgb", "<f4")])
    rows["xyz"] = cloud.reshape(-1, 3)
    return rows


def runs_only(data: bytes) -> bytes:
    """Compress by LZF without back references, as noise would be."""
    out = np.full((len(data) // 32, 33), 31, dtype=np.uint8)
    out[:, 1:] = np.frombuffer(data, dtype=np.uint8)[: len(out) * 32].reshape(-1, 32)
    rest = data[len(out) * 32 :]
    return out.tobytes() + (bytes([len(rest) - 1]) + rest if rest else b"")


def repeats_too(data: bytes) -> bytes:
    """Compress by LZF with every second value a back reference, as for NaN and level ground.

    The values change, but unpacking takes the same work.
    """
    values = np.frombuffer(data, dtype=np.uint8)[: len(data) // 8 * 8].reshape(-1, 8)
    out = np.empty((len(values), 7), dtype=np.uint8)
    out[:, 0], out[:, 1:5] = 3, values[:, :4]
    out[:, 5:] = (2 << 5, 3)  # repeat four bytes, from four bytes back
    return out.tobytes()


def compressed(path: Path, cloud: Cloud, pack: Callable[[bytes], bytes]) -> None:
    columns = np.ascontiguousarray(cloud.reshape(-1, 3).T).tobytes()
    body = pack(columns)
    path.write_bytes(pcd_header(cloud, "binary_compressed") + struct.pack("<II", len(body), len(columns)) + body)


def text(path: Path, cloud: Cloud, header: bytes, separator: str) -> None:
    points = cloud.reshape(-1, 3)
    with path.open("wb") as file:
        file.write(header)
        for first in range(0, len(points), 1 << 18):
            part = points[first : first + (1 << 18)].ravel().tolist()
            line = separator.join(["%.3f"] * 3) + "\n"
            file.write(((line * (len(part) // 3)) % tuple(part)).encode())


def array(dtype: str, order: str = "C") -> Writer:
    return lambda path, cloud: np.save(path, np.asarray(cloud, dtype=dtype, order=order))


def body(header: Callable[[Cloud], bytes], data: Callable[[Cloud], NDArray]) -> Writer:
    def write(path: Path, cloud: Cloud) -> None:
        with path.open("wb") as file:
            file.write(header(cloud))
            data(cloud).tofile(file)

    return write


BOUND = 1.5
CASES: list[tuple[str, str, bool, Writer]] = [
    ("npy float32", "npy", True, array("<f4")),
    ("pcd binary x y z", "pcd", True, body(lambda c: pcd_header(c, "binary"), lambda c: c)),
    ("pcd binary x y z rgb", "pcd", True, body(lambda c: pcd_header(c, "binary", "x y z rgb"), with_colour)),
    ("ply little endian", "ply", True, body(lambda c: ply_header(c, "binary_little_endian"), lambda c: c)),
    (
        "ply big endian",
        "ply",
        True,
        body(lambda c: ply_header(c, "binary_big_endian"), lambda c: c.astype(">f4")),
    ),
    (
        "ply x y z rgb",
        "ply",
        True,
        body(lambda c: ply_header(c, "binary_little_endian", "property float rgb\n"), with_colour),
    ),
    ("npy float64", "npy", True, array("<f8")),
    ("npy big endian", "npy", True, array(">f4")),
    ("npy by columns", "npy", False, array("<f4", "F")),
    ("npz", "npz", False, lambda path, cloud: np.savez(path, points=cloud)),
    ("npz compressed", "npz", False, lambda path, cloud: np.savez_compressed(path, points=cloud)),
    ("pcd compressed, noise", "pcd", False, lambda path, cloud: compressed(path, cloud, runs_only)),
    ("pcd compressed, half repeats", "pcd", False, lambda path, cloud: compressed(path, cloud, repeats_too)),
    ("pcd ascii", "pcd", False, lambda path, cloud: text(path, cloud, pcd_header(cloud, "ascii"), " ")),
    ("csv", "csv", False, lambda path, cloud: text(path, cloud, b"x,y,z\n", ",")),
]


def measure(path: Path, repeats: int) -> list[tuple[float, float]]:
    """Return the least wall time and processor time, ms, of raw reading and of loading, which are done in turn."""
    best = [(float("inf"), float("inf"))] * 2
    for _ in range(repeats):
        for k, read in enumerate((lambda: np.fromfile(path, dtype=np.uint8), lambda: files.load_cloud(path))):
            start, cpu = time.perf_counter(), time.process_time()
            kept = read()
            took = 1e3 * (time.perf_counter() - start), 1e3 * (time.process_time() - cpu)
            best[k] = min(best[k][0], took[0]), min(best[k][1], took[1])
            del kept
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pixels", default="5120x3840", help="of the cloud, WIDTHxHEIGHT")
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--folder", type=Path, help="where to put the files")
    parser.add_argument("-o", "--output", type=Path, help="write the table there, too")
    options = parser.parse_args()
    width, height = map(int, options.pixels.split("x"))
    cloud = scene(width, height)
    lines = [
        f"Loading {width * height / 1e6:.1f} million points from the page cache; best of {options.repeats}, in ms",
        f"{platform.system()} {platform.machine()}, {_core.default_threads()} threads, NumPy {np.__version__}; load "
        f"{os.getloadavg()[0]:.1f} before",
        "",
        f"{'file':<30}{'MB':>7}{'raw':>8}{'load':>8}{'load/raw':>10}{'CPU raw':>9}{'CPU load':>9}   bound",
    ]
    print("\n".join(lines))
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        for name, extension, bounded, write in CASES:
            if options.only not in name:
                continue
            path = Path(folder) / f"cloud.{extension}"
            write(path, cloud)
            quick = bounded or "compressed" in name
            (raw, raw_cpu), (load, load_cpu) = measure(path, options.repeats if quick else 3)
            verdict = f"{BOUND} {'holds' if load <= BOUND * raw else 'FAILS'}" if bounded else "none"
            size = path.stat().st_size / 1e6
            lines.append(
                f"{name:<30}{size:7.0f}{raw:8.1f}{load:8.1f}{load / raw:10.2f}{raw_cpu:9.1f}{load_cpu:9.1f}   {verdict}"
            )
            print(lines[-1], flush=True)
            path.unlink()
    if options.output:
        options.output.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
