"""Folders, videos, arrays and broken files as frames; every broken one is flagged, none ends it."""

import struct
import zlib

import numpy as np
import pytest

from gelslim_core.optional_library import MissingLibraryError
from gelslim_force.frames.frame import FrameSourceError
from gelslim_force.frames.frame_array import FrameArray
from gelslim_force.frames.opencv_frames import VideoFile
from gelslim_force.frames.picture import PictureError, PictureFolder, natural_key, read_picture
from gelslim_force.frames.source import open_frames

cv2 = pytest.importorskip("cv2")
Image = pytest.importorskip("PIL.Image")


def scene(k, shape=(48, 64, 3)):
    """A picture that tells its number: a bright column at 4 k, red left of it and green right."""
    image = np.full(shape, 40, dtype=np.uint8)
    image[:, : 4 * k + 2, 0] = 200
    image[:, 4 * k + 2 :, 1] = 180
    return image


def save(path, image):
    Image.fromarray(image).save(path)
    return path


def frames_of(source, **options):
    with open_frames(source, **options) as opened:
        return list(opened)


def number_of(image):
    """The k of `scene`, from where red ends."""
    red = image[:, :, 0].astype(int).mean(axis=0)
    return round((np.flatnonzero(red > 120)[-1] - 1) / 4)


def png_with_bad_pixels(image):
    """A PNG whose compressed pixels are wrong and whose CRCs are right."""
    whole = cv2.imencode(".png", image)[1].tobytes()
    at = whole.index(b"IDAT")
    (length,) = struct.unpack(">I", whole[at - 4 : at])
    body = bytearray(whole[at + 4 : at + 4 + length])
    for k in range(len(body) // 2, len(body) // 2 + 8):
        body[k] ^= 0xFF
    crc = struct.pack(">I", zlib.crc32(b"IDAT" + bytes(body)))
    return whole[: at + 4] + bytes(body) + crc + whole[at + 8 + length :]


def test_a_folder_is_read_in_natural_order(tmp_path):
    for k in (10, 2, 9, 1):
        save(tmp_path / f"frame{k}.png", scene(k))
    (tmp_path / "notes.txt").write_text("no picture")
    (tmp_path / "._frame3.png").write_bytes(b"left by a file manager")
    (tmp_path / "folder.png").mkdir()
    found = frames_of(tmp_path, frames_per_s=50)
    assert [number_of(f.image) for f in found] == [1, 2, 9, 10]
    assert [f.index for f in found] == [0, 1, 2, 3]
    assert [f.time_s for f in found] == pytest.approx([0, 0.02, 0.04, 0.06])
    assert [f.name for f in found] == ["frame1.png", "frame2.png", "frame9.png", "frame10.png"]
    assert np.array_equal(found[0].image, scene(1)), "colours red, green, blue as written"


def test_natural_order_with_zeros_case_and_several_numbers():
    names = ["b1", "A10", "a9", "a09", "a1_10", "a1_9", "a", "10", "9"]
    assert sorted(names, key=natural_key) == [
        "9", "10", "a", "a1_9", "a1_10", "a09", "a9", "A10", "b1"
    ]  # fmt: skip


def test_broken_pictures_are_flagged_and_the_rest_goes_on(tmp_path):
    """Truncated PNG and JPEG, wrong pixels, an empty file, text, another size, grey in colour."""
    rng = np.random.default_rng(1)
    noisy = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for k in range(10):
        save(tmp_path / f"f{k}.png", noisy)
    whole = (tmp_path / "f2.png").read_bytes()
    (tmp_path / "f2.png").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "f3.png").write_bytes(png_with_bad_pixels(noisy))
    (tmp_path / "f4.png").write_bytes(b"")
    (tmp_path / "f5.png").write_text("this is no picture")
    save(tmp_path / "f6.png", scene(1, (24, 64, 3)))
    save(tmp_path / "f7.png", noisy[:, :, 0])
    save(tmp_path / "whole.jpg", noisy)
    jpeg = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "f8.jpg").write_bytes(jpeg[: len(jpeg) // 2])
    (tmp_path / "f8.png").unlink()
    (tmp_path / "whole.jpg").unlink()
    found = frames_of(tmp_path)
    assert [f.index for f in found] == list(range(10))
    assert [f.image is None for f in found] == [k in (2, 3, 4, 5, 6, 7, 8) for k in range(10)]
    for f in found:
        assert (f.image is None) == bool(f.problem)
        assert f.image is not None or f.name in f.problem
    assert found[4].problem
    assert "64 x 24 px" in found[6].problem
    assert "64 x 48 px" in found[6].problem
    assert found[7].problem


def test_the_most_frequent_size_counts(tmp_path):
    save(tmp_path / "a.png", scene(1, (20, 20, 3)))
    for k in range(3):
        save(tmp_path / f"b{k}.png", scene(k))
    assert [f.image is None for f in frames_of(tmp_path)] == [True, False, False, False]


def test_an_incomplete_picture_is_refused(tmp_path):
    noisy = np.random.default_rng(2).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    for ending in ("png", "jpg"):
        data = cv2.imencode(f".{ending}", noisy[:, :, ::-1])[1].tobytes()
        (tmp_path / f"whole.{ending}").write_bytes(data)
        (tmp_path / f"half.{ending}").write_bytes(data[: len(data) // 2])
        back = read_picture(tmp_path / f"whole.{ending}")
        assert back.shape == noisy.shape
        assert ending == "jpg" or np.array_equal(back, noisy)
        with pytest.raises(PictureError):
            read_picture(tmp_path / f"half.{ending}")


def test_deep_transparent_and_grey_pictures(tmp_path):
    deep = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64) * 20
    save(tmp_path / "deep.png", deep)
    assert np.array_equal(read_picture(tmp_path / "deep.png"), (deep >> 8).astype(np.uint8))
    clear = np.dstack([scene(3), np.full((48, 64), 7, dtype=np.uint8)])
    save(tmp_path / "clear.png", clear)
    assert np.array_equal(read_picture(tmp_path / "clear.png"), scene(3))
    save(tmp_path / "grey.png", scene(3)[:, :, 0])
    assert read_picture(tmp_path / "grey.png").shape == (48, 64)


def test_the_orientation_in_exif_data_is_ignored(tmp_path):
    """A note in the file on how the camera was held must not turn the frame."""
    picture = Image.fromarray(scene(5))
    note = picture.getexif()
    note[0x0112] = 6
    picture.save(tmp_path / "turned.png", exif=note)
    assert np.array_equal(read_picture(tmp_path / "turned.png"), scene(5))


def write_video(path, count, shape=(48, 64)):
    codec = {".avi": "MJPG", ".mp4": "mp4v"}[path.suffix]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 25.0, shape[::-1])
    assert writer.isOpened()
    for k in range(count):
        writer.write(np.ascontiguousarray(scene(k, (*shape, 3))[:, :, ::-1]))
    writer.release()
    return path


@pytest.mark.parametrize("ending", [".avi", ".mp4"])
def test_a_video_gives_every_frame_with_its_time(tmp_path, ending):
    path = write_video(tmp_path / f"run{ending}", 12)
    with open_frames(path) as source:
        assert (source.count, source.frames_per_s, source.live) == (12, 25.0, False)
        found = list(source)
    assert [number_of(f.image) for f in found] == list(range(12))
    assert [f.time_s for f in found] == pytest.approx(np.arange(12) / 25)
    assert all(not f.problem for f in found)
    assert [f.time_s for f in frames_of(path, frames_per_s=50)][2] == pytest.approx(0.04)


def test_a_truncated_video_gives_its_frames_and_a_problem(tmp_path):
    path = write_video(tmp_path / "run.avi", 14, (240, 320))
    data = path.read_bytes()
    path.write_bytes(data[: int(0.6 * len(data))])
    found = frames_of(path)
    whole = [f for f in found if f.image is not None]
    assert 5 <= len(whole) <= 10
    assert [number_of(f.image) for f in whole] == list(range(len(whole)))
    last = found[-1]
    assert last.image is None
    assert last.problem


class Broken:
    """A capture of 20 frames, some of which cannot be read."""

    def __init__(self, bad, count=20, opened=True):
        self.bad, self.count, self.opened, self.at, self.released = bad, count, opened, -1, 0

    def isOpened(self):
        return self.opened

    def read(self):
        self.at += 1
        if self.at >= self.count or self.at in self.bad:
            return False, None
        return True, scene(self.at % 15)[:, :, ::-1]

    def get(self, prop):
        return {5: 25.0, 7: 20.0}.get(prop, 0.0)

    def set(self, prop, value):
        return True

    def release(self):
        self.released += 1


def test_frames_that_cannot_be_decoded_are_counted(tmp_path):
    path = tmp_path / "run.avi"
    path.write_bytes(b"x")
    found = list(VideoFile(path, capture=lambda what: Broken({4, 5, 11})))
    assert [f.index for f in found] == list(range(20))
    assert [f.index for f in found if f.image is None] == [4, 5, 11]
    assert all(number_of(f.image) == f.index % 15 for f in found if f.image is not None)


def test_a_video_without_one_readable_frame_is_refused(tmp_path):
    mp4 = write_video(tmp_path / "cut.mp4", 12)
    data = mp4.read_bytes()
    mp4.write_bytes(data[: len(data) // 2])
    with pytest.raises(FrameSourceError, match=r"cut\.mp4"):
        open_frames(mp4)
    (tmp_path / "none.avi").write_bytes(b"")
    with pytest.raises(FrameSourceError, match=r"none\.avi"):
        open_frames(tmp_path / "none.avi")


def test_arrays_in_memory_and_in_files(tmp_path):
    stack = np.stack([scene(k) for k in range(5)])
    for source in (stack, np.dstack([stack[0]] * 1), stack[:, :, :, 0]):
        assert all(f.image.flags.c_contiguous for f in frames_of(source))
    np.save(tmp_path / "run.npy", stack)
    np.savez_compressed(tmp_path / "run.npz", frames=stack, time_s=[0, 0.1, 0.3, 0.4, 0.5])
    np.savez(tmp_path / "odd.npz", a=np.zeros(3), video=stack)
    np.save(tmp_path / "one.npy", stack[3])
    for name in ("run.npy", "run.npz", "odd.npz"):
        found = frames_of(tmp_path / name)
        assert [number_of(f.image) for f in found] == [0, 1, 2, 3, 4], name
    assert [f.time_s for f in frames_of(tmp_path / "run.npz")] == [0, 0.1, 0.3, 0.4, 0.5]
    assert [number_of(f.image) for f in frames_of(tmp_path / "one.npy")] == [3]
    assert frames_of(stack[..., 0])[4].image.shape == (48, 64)


@pytest.mark.parametrize(
    "array",
    [np.zeros((5, 48, 64)), np.zeros((5, 48, 64, 2), np.uint8), np.zeros((0, 48, 64), np.uint8),
     np.zeros(7, np.uint8)],
)  # fmt: skip
def test_arrays_that_are_no_frames(array):
    with pytest.raises(FrameSourceError):
        FrameArray(array)


def test_times_that_do_not_fit_an_array():
    stack = np.zeros((5, 48, 64), np.uint8)
    for times in ([0, 1], [0, 1, 2, 3, np.nan], list("abcde")):
        with pytest.raises(FrameSourceError):
            FrameArray(stack, times)
        with pytest.raises(FrameSourceError, match="stamps"):
            FrameArray(stack, stamp_s=times)
    for wrong in (-1.0, 1.8e18):
        with pytest.raises(FrameSourceError, match="since 1970"):
            FrameArray(stack, stamp_s=[0, 1, 2, 3, wrong])


def test_only_a_source_that_knows_its_stamps_has_them(tmp_path):
    """A folder or video has none: the time of a file is that of a copy, not of a picture."""
    stack = np.stack([scene(k) for k in range(3)])
    stamps = 1.8e9 + np.array([0, 0.1, 0.25])
    np.savez(tmp_path / "run.npz", frames=stack, stamp_s=stamps)
    assert [f.stamp_s for f in frames_of(tmp_path / "run.npz")] == stamps.tolist()
    assert [f.time_s for f in frames_of(tmp_path / "run.npz")] == [0, 1, 2]
    save(tmp_path / "one.png", scene(7))
    for source in (stack, tmp_path / "one.png", write_video(tmp_path / "run.avi", 2)):
        assert all(f.stamp_s is None for f in frames_of(source))


def test_damaged_numpy_files(tmp_path):
    np.save(tmp_path / "run.npy", np.zeros((5, 48, 64), np.uint8))
    data = (tmp_path / "run.npy").read_bytes()
    (tmp_path / "cut.npy").write_bytes(data[:9000])
    (tmp_path / "text.npy").write_text("no array")
    (tmp_path / "text.npz").write_text("no archive")
    np.savez(tmp_path / "two.npz", a=np.zeros((5, 9, 9), np.uint8), b=np.zeros((5, 9, 9), np.uint8))
    np.savez(tmp_path / "empty.npz")
    for name in ("cut.npy", "text.npy", "text.npz", "two.npz", "empty.npz"):
        with pytest.raises(FrameSourceError, match=name):
            open_frames(tmp_path / name)


def test_nothing_readable_is_an_error_that_names_it(tmp_path):
    with pytest.raises(FrameSourceError):
        open_frames(tmp_path / "gone")
    with pytest.raises(FrameSourceError):
        open_frames(tmp_path)
    (tmp_path / "a.png").write_text("x")
    (tmp_path / "b.png").write_text("y")
    with pytest.raises(FrameSourceError, match="2 pictures"):
        open_frames(tmp_path)
    (tmp_path / "run.txt").write_text("x")
    with pytest.raises(FrameSourceError, match=r"\.txt"):
        open_frames(tmp_path / "run.txt")
    with pytest.raises(FrameSourceError):
        open_frames(np.zeros((48, 64), np.uint8), frames_per_s=0)


def test_one_picture_is_a_stream_of_one(tmp_path):
    found = frames_of(save(tmp_path / "one.png", scene(7)))
    assert [number_of(f.image) for f in found] == [7]
    assert PictureFolder(tmp_path / "one.png").count == 1


def test_without_opencv_the_extra_is_named(tmp_path, monkeypatch):
    path = write_video(tmp_path / "run.avi", 2)
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(MissingLibraryError) as refused:
        open_frames(path)
    assert (refused.value.name, refused.value.extra) == ("cv2", "vision")
