import os
import struct
import zlib

import cv2
import numpy as np
import pytest

from debulk import InputError, files

SHOWN = np.random.default_rng(3).random((7, 11)) < 0.4


def png(image):
    return cv2.imencode(".png", image)[1].tobytes()


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def made(width, height, pixels, depth=8, colour=0, interlaced=0):
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlaced)
    idat = chunk(b"IDAT", zlib.compress(pixels, 9))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + idat + chunk(b"IEND", b"")


def error_for(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as caught:
        files.load_mask(tmp_path / name)
    text = str(caught.value)
    assert text.startswith(str(tmp_path / name)) and "\n" not in text
    return text


@pytest.mark.parametrize(
    "image",
    [
        SHOWN.astype(np.uint8),
        SHOWN.astype(np.uint16),
        SHOWN[..., None] * np.array([0, 0, 1], np.uint8),
        np.dstack([SHOWN.astype(np.uint8)] * 3 + [~SHOWN]).astype(np.uint8),  # what is transparent counts too
    ],
)
def test_png(tmp_path, image):
    (tmp_path / "m.PNG").write_bytes(png(image))
    mask = files.load_mask(tmp_path / "m.PNG")
    assert mask.dtype == np.bool_ and mask.flags.c_contiguous
    np.testing.assert_array_equal(mask, SHOWN)


def test_a_large_png_in_many_chunks(tmp_path):
    mask = np.random.default_rng(5).random((1200, 1700)) < 0.5
    (tmp_path / "m.png").write_bytes(png(mask * np.uint16(513)))
    np.testing.assert_array_equal(files.load_mask(tmp_path / "m.png"), mask)


def test_png_of_one_bit(tmp_path):
    rows = b"".join(b"\0" + np.packbits(row).tobytes() for row in SHOWN)
    (tmp_path / "m.png").write_bytes(made(11, 7, rows, depth=1))
    np.testing.assert_array_equal(files.load_mask(tmp_path / "m.png"), SHOWN)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", [bool, np.uint8])
def test_npy(tmp_path, dtype, order):
    np.save(tmp_path / "m.npy", np.asarray(SHOWN * 3, dtype=dtype, order=order))
    mask = files.load_mask(tmp_path / "m.npy")
    assert mask.dtype == np.bool_ and mask.flags.c_contiguous
    np.testing.assert_array_equal(mask, SHOWN)


@pytest.mark.parametrize(
    ("name", "data", "part"),
    [
        ("m.png", made(30_000, 8_000, b"\0"), "cannot be in"),
        ("m.png", made(2**31, 2**31, b"\0"), "expected 1 to"),
        ("m.png", made(0, 4, b"\0"), "expected 1 to"),
        ("m.png", made(3, 2, b"\0" * 7), "promises 8 bytes of pixels and holds only 7"),
        ("m.png", made(3, 2, b"\0" * 3_000_000), "promises 8 bytes of pixels and holds more"),
        ("m.png", made(3, 2, b"\0" * 8, interlaced=1), "interlaced"),
        ("m.png", made(3, 2, b"\0" * 8, depth=3), "3 bits"),
        ("m.png", made(3, 2, b"\0" * 8).replace(b"IDAT", b"IDAt"), "checksum"),
        ("m.png", made(3, 2, b"\0" * 8)[:-3], "ends within"),
        ("m.png", b"\x89PNG\r\n\x1a\n" + chunk(b"IEND", b""), "expected one IHDR"),
        ("m.png", b"\x89PNG\r\n\x1a\n" + b"\xff\xff\xff\xffIHDR" + b"\0" * 30, "longer than the file"),
        ("m.png", b"<html>", "byte 0: the file does not start like a .png"),
        ("m.png", b"", "byte 0: the file does not start like a .png"),
        ("m.npy", b"", "not a readable .npy header"),
        ("m.jpg", b"", "expected a mask ending in .png, .npy"),
    ],
)
def test_a_bad_mask_gives_one_clear_error(tmp_path, name, data, part, capfd):
    assert part in error_for(tmp_path, name, data)
    assert capfd.readouterr() == ("", "")


def test_arrays_that_are_no_mask(tmp_path):
    for array in (np.zeros((2, 3)), np.zeros(3, bool), np.zeros((0, 3), bool), np.array([[{}]], dtype=object)):
        np.save(tmp_path / "m.npy", array)
        with pytest.raises(InputError, match=r"expected bool or uint8|expected the shape|no pixels"):
            files.load_mask(tmp_path / "m.npy")


def test_a_mask_cut_anywhere_or_changed_is_refused(tmp_path):
    np.save(tmp_path / "m.npy", SHOWN)
    for name, data in (("c.png", png(SHOWN.astype(np.uint8))), ("c.npy", (tmp_path / "m.npy").read_bytes())):
        for length in range(0, len(data), 5):
            error_for(tmp_path, name, data[:length])
    data = png(SHOWN.astype(np.uint8))
    for place in range(len(data)):
        error_for(tmp_path, "c.png", data[:place] + bytes([data[place] ^ 0x10]) + data[place + 1 :])


def test_what_is_no_file(tmp_path):
    (tmp_path / "d.png").mkdir()
    os.mkfifo(tmp_path / "p.png")
    (tmp_path / "z.png").symlink_to("/dev/zero")
    for name, what in (
        ("d.png", "a folder"),
        ("p.png", "pipe"),
        ("z.png", "device"),
        ("n.png", "No such"),
    ):
        with pytest.raises(InputError, match=what):
            files.load_mask(tmp_path / name)
