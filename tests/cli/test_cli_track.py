"""`gelslim track`: files, summary, broken frames, refusals."""

import json

import numpy as np
import pytest

from gelslim.cli.main import main

Image = pytest.importorskip("PIL.Image")

ROWS, COLUMNS, PITCH = 8, 9, 24.0


def frame(shift=(0.0, 0.0), around=(160.0, 120.0), noise=3, seed=1):
    """Dots of 8 px on a lattice of 24 px, pushed by `shift` px at most."""
    y, x = np.mgrid[:240, :320].astype(float)
    image = np.full((240, 320), 170.0)
    for r in range(ROWS):
        for c in range(COLUMNS):
            place = np.array([40 + PITCH * c, 36 + PITCH * r])
            bump = np.exp(-np.sum((place - around) ** 2) / (2 * 40.0**2))
            px, py = place + bump * np.array(shift)
            image -= 120 * np.clip(4.5 - np.hypot(x - px, y - py), 0, 1)
    image += np.random.default_rng(seed).normal(0, noise, image.shape)
    return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


@pytest.fixture
def frames(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(5):
        Image.fromarray(frame((1.5 * k, -k), seed=k)).save(folder / f"f{k}.png")
    return folder


def test_the_run_is_written_and_told(frames, tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["track", str(frames), "-o", str(out), "--rate", "50"]) == 0
    said = capsys.readouterr().out
    assert "72 dots" in said
    assert str(out) in said
    with np.load(out / "tracks.npz") as data:
        assert data["places_px"].shape == (5, 72, 2)
        assert data["time_s"].tolist() == pytest.approx([0, 0.02, 0.04, 0.06, 0.08])
        length = np.hypot(*np.moveaxis(data["displacement_px"], 2, 0))
        assert np.nanmax(length, axis=1) == pytest.approx(
            0.956 * np.array([0, 1.80, 3.61, 5.41, 7.21]), abs=0.1
        )
        rest = data["rest_px"]
        assert np.abs((rest - [40, 36]) / PITCH - np.rint((rest - [40, 36]) / PITCH)).max() < 0.01
        assert np.isnan(data["stamp_s"]).all(), "a folder does not know when it was taken"
    assert len((out / "frames.csv").read_text().splitlines()) == 6
    summary = json.loads((out / "summary.json").read_text())
    assert sorted(summary["lattice_shape"]) == [8, 9]
    assert summary["coverage"]["least"] == 1.0
    pictures = sorted(f.name for f in (out / "pictures").iterdir())
    assert len(pictures) == 4
    assert not [f for f in out.iterdir() if f.name.startswith(".")]


def test_tracks_have_the_stamps_of_their_frames(tmp_path):
    stamps = 1_795_441_687.125 + np.array([0.0, 0.02, 0.05])
    stack = np.stack([frame((1.5 * k, -k), seed=k) for k in range(3)])
    np.savez(tmp_path / "run.npz", frames=stack, stamp_s=stamps)
    out = tmp_path / "run"
    assert main(["track", str(tmp_path / "run.npz"), "-o", str(out), "--pictures", "0"]) == 0
    with np.load(out / "tracks.npz") as data:
        np.testing.assert_array_equal(data["stamp_s"], stamps)
        assert np.isnan(data["sensor_s"]).all()
    rows = [line.split(",") for line in (out / "frames.csv").read_text().splitlines()]
    assert rows[0][1:4] == ["time_s", "stamp_s", "sensor_s"]
    assert [float(row[2]) for row in rows[1:]] == stamps.tolist()


def test_json_holds_the_summary_and_no_other_word(frames, tmp_path, capsys):
    arguments = ["track", str(frames), "-o", str(tmp_path / "run"), "--pictures", "0", "--json"]
    assert main(arguments) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["markers"] == 72
    assert answer["frame_coverage"] == [1.0] * 5
    assert answer["pictures"] == []
    assert (
        answer["detector"]["smallest_diameter_px"] < 8.0 < answer["detector"]["largest_diameter_px"]
    )


def test_a_reference_of_its_own_and_broken_frames(frames, tmp_path, capsys):
    reference = tmp_path / "rest.png"
    Image.fromarray(frame(seed=9)).save(reference)
    data = (frames / "f0.png").read_bytes()
    (frames / "f0.png").write_bytes(data[:2000])
    (frames / "f3.png").write_bytes(b"")
    out = tmp_path / "run"
    assert main(["track", str(frames), "-r", str(reference), "-o", str(out)]) == 0
    said = capsys.readouterr().out
    assert "f0.png" in said
    summary = json.loads((out / "summary.json").read_text())
    assert summary["frames_without_tracks"] == 2
    assert summary["frame_coverage"] == [0.0, 1.0, 1.0, 0.0, 1.0]
    with np.load(out / "tracks.npz") as kept:
        assert np.isnan(kept["places_px"][[0, 3]]).all()
        assert np.nanmax(np.hypot(*kept["displacement_px"][4].T)) == pytest.approx(6.89, abs=0.1)


def test_the_first_readable_frame_is_the_reference(frames, tmp_path):
    (frames / "f0.png").write_bytes(b"")
    out = tmp_path / "run"
    assert main(["track", str(frames), "-o", str(out), "--frames", "3"]) == 0
    with np.load(out / "tracks.npz") as kept:
        assert kept["frame_index"].tolist() == [0, 1, 2]
        assert np.nanmax(np.abs(kept["displacement_px"][1])) < 0.3


def test_given_diameters_are_used(frames, tmp_path, capsys):
    arguments = ["track", str(frames), "-o", str(tmp_path / "run"), "--json"]
    assert main([*arguments, "--diameters", "7:9"]) == 0
    detector = json.loads(capsys.readouterr().out)["detector"]
    assert detector["smallest_diameter_px"] == pytest.approx(0.67 * 7)
    for wrong in ("8", "a:b", "nan:nan"):
        assert main([*arguments, "--diameters", wrong]) == 2
        assert "--diameters" in capsys.readouterr().out


def test_what_cannot_be_tracked_is_refused_and_nothing_written(tmp_path, capsys):
    out = tmp_path / "run"
    grey = tmp_path / "grey.npy"
    np.save(grey, np.full((3, 240, 320), 128, np.uint8))
    floats = tmp_path / "floats.npy"
    np.save(floats, np.zeros((3, 240, 320)))
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "a.png").write_text("x")
    cases = {
        tmp_path / "gone": "gone",
        grey: "first frame",
        floats: "floats.npy",
        tmp_path / "bad": "a.png",
    }
    for source, said in cases.items():
        assert main(["track", str(source), "-o", str(out)]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert "Traceback" not in error
        assert not out.exists()
    good = tmp_path / "good.npy"
    np.save(good, frame())
    assert main(["track", str(good), "-r", str(tmp_path / "none.png"), "-o", str(out)]) == 2
    assert "none.png" in capsys.readouterr().err
    assert not out.exists()


def test_an_output_that_cannot_be_written_is_told(frames, tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    assert main(["track", str(frames), "-o", str(blocked)]) == 2
    error = capsys.readouterr().err
    assert "file" in error
    assert "Traceback" not in error
    assert blocked.read_text() == "in the way"
