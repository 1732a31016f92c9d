"""Calibrations written and read: the same again, or a clear refusal."""

from __future__ import annotations

import dataclasses
import json
import re
import sys

import numpy as np
import pytest
from calibration_samples import BUILD, seen_by, small_bundle

from gelslim_core.errors import GelslimError
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.file import (
    calibration_of,
    calibration_record,
    read_calibration,
    write_calibration,
)
from gelslim_force.calibration.reference_picture import read_reference
from gelslim_force.calibration.stored_picture import picture_of, picture_record
from ifem_export.markers.grid import build_marker_grid

GRID = build_marker_grid(12, 11, 1.3, 0.5)


@pytest.fixture(scope="module")
def found():
    return calibrate(small_bundle(GRID), seen_by(GRID, BUILD, noise=4, missing=0.03))


def test_a_file_gives_the_same_calibration_again(found, tmp_path):
    path = tmp_path / "sensor.json"
    write_calibration(found, path)
    again = read_calibration(path)
    assert again.camera.to_record() == found.camera.to_record()
    for name in ("markers", "reference_px", "residual_px", "rest_mm", "residual_mm", "missing"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
    for name in ("area_px", "contrast", "moments_px2", "flags"):
        np.testing.assert_array_equal(getattr(again.dots, name), getattr(found.dots, name))
    for name in ("positions_mm", "kind", "diameter_mm", "omitted"):
        np.testing.assert_array_equal(getattr(again.grid, name), getattr(found.grid, name))
    np.testing.assert_array_equal(again.picture, found.picture)
    assert again.detector == found.detector
    assert again.diagnosis == found.diagnosis
    assert again.warnings == found.warnings
    for field in dataclasses.fields(found.deviation):
        old, new = getattr(found.deviation, field.name), getattr(again.deviation, field.name)
        assert np.array_equal(old, new) or field.name == "weak"
    assert len(again.deviation.weak) == len(found.deviation.weak)
    write_calibration(again, tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_a_bare_calibration_is_kept_too(found):
    bare = dataclasses.replace(found, deviation=None, picture=None)
    record = json.loads(json.dumps(calibration_record(bare)))
    assert calibration_of(record).deviation is None
    del record["picture"]
    assert calibration_of(record).picture is None


@pytest.mark.parametrize("shape", [(20, 31), (20, 31, 3), (1, 1)])
def test_pictures_survive_as_text(shape):
    picture = np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8)
    record = json.loads(json.dumps(picture_record(picture)))
    np.testing.assert_array_equal(picture_of(record), picture)


def _without(name):
    return lambda r: r.pop(name)


@pytest.mark.parametrize(
    ("damage", "value"),
    [
        (_without("camera"), "camera"),
        (lambda r: r.update(format="gelslim-calibration/2"), "gelslim-calibration/1"),
        (lambda r: r["markers"].append(3), "residual_px"),
        (lambda r: r["markers"].__setitem__(0, 4000), "marker id"),
        (lambda r: r["rest_mm"].pop(), "rest_mm"),
        (lambda r: r["rest_mm"].__setitem__(2, ["a", "b"]), "rest_mm|numbers"),
        (lambda r: r["rest_mm"].__setitem__(2, [float("nan"), 0.0]), "finite"),
        (lambda r: r["dots"]["area_px"].pop(), "centres_px"),
        (lambda r: r["dots"]["flags"].__setitem__(0, 0.5), "integers"),
        (lambda r: r["grid"]["row"].__setitem__(0, 7), "grid"),
        (lambda r: r["camera"].update(focal_px=-1), "focal_px"),
        (lambda r: r["detector"].update(colour=1), "colour"),
        (lambda r: r["deviation"]["values"].pop("k1"), "k1"),
        (lambda r: r.update(grid=3), "damaged.json"),
        (lambda r: r["picture"].update(shape=[3, 5, 4]), "shape"),
        (lambda r: r["picture"].update(shape=[30_000, 30_000]), "larger"),
        (lambda r: r["picture"]["shape"].__setitem__(0, 7), "bytes"),
        (lambda r: r["picture"].update(row_steps="?"), "damaged"),
    ],
)
def test_damaged_records_are_named(found, tmp_path, damage, value):
    record = json.loads(json.dumps(calibration_record(found)))
    damage(record)
    path = tmp_path / "damaged.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(CalibrationError, match=value) as caught:
        read_calibration(path)
    assert caught.value.reason == "file"


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[1]", None])
def test_files_that_are_no_calibration(tmp_path, content):
    path = tmp_path / "file.json"
    if content is not None:
        path.write_bytes(content)
    for place in (path, tmp_path):
        with pytest.raises(CalibrationError, match=re.escape(str(place))) as caught:
            read_calibration(place)
        assert caught.value.reason == "file"


def test_reference_pictures(tmp_path):
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 255, (4, 20, 30, 3)).astype(np.uint8)
    np.save(tmp_path / "one.npy", frames[0])
    np.save(tmp_path / "all.npy", frames)
    np.testing.assert_array_equal(read_reference(tmp_path / "one.npy"), frames[0])
    mean = np.rint(frames.mean(axis=0)).astype(np.uint8)
    np.testing.assert_array_equal(read_reference(tmp_path / "all.npy"), mean)
    folder = tmp_path / "folder"
    folder.mkdir()
    for k, frame in enumerate(frames):
        np.save(folder / f"{k}.npy", frame)
    np.testing.assert_array_equal(read_reference(folder), mean)
    np.save(folder / "5.npy", frames[0, :10])
    with pytest.raises(CalibrationError, match=r"\(10, 30, 3\)"):
        read_reference(folder)


def test_pictures_keep_their_colours(tmp_path):
    cv = pytest.importorskip("cv2")
    frame = np.zeros((20, 30, 3), np.uint8)
    frame[:, :, 0] = 200
    cv.imwrite(str(tmp_path / "red.png"), frame[:, :, ::-1])
    np.testing.assert_array_equal(read_reference(tmp_path / "red.png"), frame)


def test_what_is_no_picture_is_named(tmp_path):
    (tmp_path / "empty.png").write_bytes(b"")
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "bad.npy").write_bytes(b"\x93NUMPY")
    np.save(tmp_path / "float.npy", np.zeros((20, 30)))
    np.save(tmp_path / "object.npy", np.array([{}], dtype=object), allow_pickle=True)
    (tmp_path / "none").mkdir()
    pytest.importorskip("cv2")
    names = ("empty.png", "text.png", "bad.npy", "object.npy", "float.npy", "none", "absent.png")
    for name in names:
        with pytest.raises(CalibrationError, match=name) as caught:
            read_reference(tmp_path / name)
        assert caught.value.reason == "file"


def test_half_a_picture_is_no_reference(tmp_path):
    image = pytest.importorskip("PIL.Image")
    noise = np.random.default_rng(0).integers(0, 256, (60, 80, 3)).astype(np.uint8)
    image.fromarray(noise).save(tmp_path / "whole.jpg")
    whole = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "half.jpg").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CalibrationError, match=r"half\.jpg"):
        read_reference(tmp_path / "half.jpg")


def test_a_missing_reader_of_pictures_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    (tmp_path / "picture.png").write_bytes(b"x")
    with pytest.raises(GelslimError, match="install"):
        read_reference(tmp_path / "picture.png")
