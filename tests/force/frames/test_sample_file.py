"""Samples of public data sets: pictures in pickled dictionaries, of which no program is run."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from gelslim_force.calibration.reference_picture import read_reference
from gelslim_force.frames.picture import PictureError, read_picture
from gelslim_force.frames.sample_file import SampleError, is_sample, read_sample, sample_picture
from gelslim_force.frames.source import open_frames

PICTURE = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)


def saved(path: Path, content: object) -> Path:
    np.save(path, content, allow_pickle=True)
    return path


@pytest.mark.parametrize("dtype", [np.uint8, np.float64, np.float32, np.int32])
def test_the_picture_of_a_sample_is_a_frame(tmp_path: Path, dtype: type) -> None:
    path = saved(tmp_path / "press_1.npy", {"gs_img": PICTURE.astype(dtype), "f_x": np.float64(1)})
    assert is_sample(path)
    np.testing.assert_array_equal(read_picture(path), PICTURE)
    np.testing.assert_array_equal(read_reference(path), PICTURE)
    with open_frames(tmp_path) as frames:
        (only,) = list(frames)
    np.testing.assert_array_equal(only.image, PICTURE)


def test_a_plain_array_is_no_sample(tmp_path: Path) -> None:
    path = tmp_path / "plain.npy"
    np.save(path, PICTURE)
    assert not is_sample(path)
    np.testing.assert_array_equal(read_picture(path), PICTURE)
    assert not is_sample(tmp_path / "absent.npy")


class Run:
    """Makes a file when it is loaded by an ordinary unpickler."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.mark),)


def test_a_sample_cannot_run_a_program(tmp_path: Path) -> None:
    mark = tmp_path / "made"
    path = saved(tmp_path / "bad.npy", {"gs_img": PICTURE, "more": Run(mark)})
    with pytest.raises(SampleError):
        read_sample(path)
    with pytest.raises(PictureError):
        read_picture(path)
    assert not mark.exists()
    np.load(path, allow_pickle=True)
    assert mark.exists(), "the file does what the reader refuses"


def test_damaged_and_foreign_samples_are_refused(tmp_path: Path) -> None:
    whole = saved(tmp_path / "a.npy", {"gs_img": PICTURE}).read_bytes()
    cut = tmp_path / "cut.npy"
    cut.write_bytes(whole[: len(whole) - 40])
    with pytest.raises(SampleError):
        read_sample(cut)
    with pytest.raises(SampleError):
        read_sample(saved(tmp_path / "list.npy", np.array([1, None], dtype=object)))
    other = tmp_path / "bare.npy"
    other.write_bytes(whole[: whole.index(b"\n") + 1] + pickle.dumps([1, 2]))
    with pytest.raises(SampleError):
        read_sample(other)
    for wrong in ({}, {"gs_img": PICTURE / 255.0}, {"gs_img": PICTURE * -1.0}, {"gs_img": 3}):
        with pytest.raises(SampleError):
            sample_picture(wrong)
