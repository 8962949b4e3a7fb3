import cv2
import numpy as np
import pytest

from debulk import InputError
from debulk.mask import load_mask

MASK = np.zeros((12, 20), bool)
MASK[3:6, 4:15] = True


@pytest.mark.parametrize("kind", ["png", "bmp", "pgm", "tif"])
def test_images(tmp_path, kind):
    path = tmp_path / f"mask.{kind}"
    assert cv2.imwrite(str(path), MASK.astype(np.uint8) * 255)
    loaded = load_mask(path)
    assert loaded.dtype == np.bool_ and np.array_equal(loaded, MASK)


def test_a_coloured_image_counts_as_grey(tmp_path):
    picture = np.zeros((12, 20, 3), np.uint8)
    picture[MASK] = 255
    cv2.imwrite(str(tmp_path / "mask.png"), picture)
    assert np.array_equal(load_mask(tmp_path / "mask.png"), MASK)


@pytest.mark.parametrize("values", [MASK, MASK.astype(np.uint8) * 255])
def test_arrays(tmp_path, values):
    np.save(tmp_path / "mask.npy", values)
    assert np.array_equal(load_mask(tmp_path / "mask.npy"), MASK)


def test_bad_files_are_named(tmp_path):
    np.save(tmp_path / "floats.npy", np.zeros((3, 4)))
    np.save(tmp_path / "line.npy", np.zeros(3, bool))
    np.save(tmp_path / "pickle.npy", np.array([[object()]]), allow_pickle=True)
    np.savez(tmp_path / "many.npz", MASK)
    (tmp_path / "many.npz").rename(tmp_path / "many.npy")
    cv2.imwrite(str(tmp_path / "whole.png"), MASK.astype(np.uint8) * 255)
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:20])
    (tmp_path / "empty.png").write_bytes(b"")
    (tmp_path / "text.npy").write_text("0 1 1")
    for name, words in (
        ("floats.npy", "float64 of shape"),
        ("line.npy", r"\(3,\)"),
        ("pickle.npy", "not a .npy array"),
        ("many.npy", "an archive"),
        ("cut.png", "not an image"),
        ("empty.png", "not an image"),
        ("text.npy", "not a .npy array"),
        ("none.png", "cannot be read"),
        ("mask.txt", "expected a mask ending in"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            load_mask(tmp_path / name)
        assert name in str(caught.value)
