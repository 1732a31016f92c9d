"""Data sets of LeRobot as other libraries read them: pyarrow, Pillow, and LeRobot's own loader."""

from __future__ import annotations

import io
import itertools
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason="NOT TESTED: data sets of LeRobot need pyarrow")
import pyarrow.parquet as pq
from PIL import Image

from gelslim_twin.datasets.formats import DataSetError, Pictures, Shard, format_named
from gelslim_twin.datasets.labels import MEANING
from gelslim_twin.datasets.lerobot import statistics
from gelslim_twin.datasets.lerobot.video_file import VideoFile
from gelslim_twin.datasets.sample import Sample, SampleFrame, Split

POSE = tuple(name for name in MEANING if name.startswith("tool_"))
WRENCH = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")
FRAMES, RATE_HZ = 4, 10.0
SIZE = (48, 64)
KINDS = {
    "png": Pictures("png"),
    "lossless video": Pictures("video", 100),
    "video": Pictures("video", 60),
}


def sample(number: int, split: Split = "train", *, grey: bool = False) -> Sample:
    """A sample of noise, another one for each number."""
    rng = np.random.default_rng(number)
    shape = SIZE if grey else (*SIZE, 3)
    names = (*POSE, *WRENCH, "contact_x_mm")
    frames = []
    for frame in range(FRAMES):
        labels: dict[str, Any] = dict(zip(names, rng.normal(size=len(names)), strict=True))
        labels["contact_x_mm"] = labels["contact_x_mm"] if frame else float("nan")
        labels |= {"slipping_nodes": int(rng.integers(9)), "slip": "none" if frame else "gross"}
        arrays = {
            "force_n": rng.normal(size=(7, 3)).astype(np.float32),
            "contact": rng.integers(0, 3, 7).astype(np.int8),
            "drawn": rng.integers(0, 2, 5).astype(bool),
            "markers_px": rng.normal(size=(5, 2)).astype(np.float32),
        }
        level = 40 * (frame + 1) + (number % 3)
        picture = np.clip(rng.normal(level, 20, shape), 0, 255).astype(np.uint8)
        frames.append(SampleFrame(frame, frame / RATE_HZ, labels, picture, arrays))
    draws = {"radius_mm": float(rng.uniform(2, 9)), "shape": "sphere"}
    return Sample(number, f"touch-{number}", 100 + number, split, draws, tuple(frames))


def shards(pictures: Pictures) -> list[Shard]:
    """Two shards of training with three samples each, one of test with two."""
    numbers: Sequence[tuple[Split, int, int, tuple[int, ...]]] = (
        ("train", 0, 0, (0, 2, 3)),
        ("train", 1, 3, (4, 5, 7)),
        ("test", 0, 6, (1, 6)),
    )
    return [Shard(s, n, first, of, pictures, FRAMES, RATE_HZ) for s, n, first, of in numbers]


def written(
    folder: Path, pictures: Pictures, missing: Sequence[int] = (), **options: Any
) -> list[Sample]:
    """Write a data set as `gelslim dataset` does. Returns its samples in order."""
    made, samples = format_named("lerobot"), []
    made.require(pictures)
    for shard in shards(pictures):
        writer = made.writer(folder, shard, {})
        for number in shard.samples:
            if number not in missing:
                samples.append(sample(number, shard.split, **options))
                places = writer.add(samples[-1])
                assert len(places) == FRAMES
        writer.finish()
    fresh = folder / "fresh"
    fresh.mkdir()
    made.complete(fresh, folder, shards(pictures), {"name": "press a ball"})
    for file in sorted(p for p in fresh.rglob("*") if p.is_file()):
        target = folder / file.relative_to(fresh)
        target.parent.mkdir(parents=True, exist_ok=True)
        file.replace(target)
    return samples


def frames_of(folder: Path) -> list[dict[str, Any]]:
    files = sorted((folder / "data").glob("*/*.parquet"))
    return [row for file in files for row in pq.read_table(file).to_pylist()]


@pytest.mark.parametrize("missing", [(), (2, 4), (0, 1, 6)])
def test_rows_are_those_of_the_samples_and_count_without_gaps(
    tmp_path: Path, missing: tuple[int, ...]
) -> None:
    samples = written(tmp_path, KINDS["png"], missing)
    rows = frames_of(tmp_path)
    assert [r["index"] for r in rows] == list(range(len(samples) * FRAMES))
    assert [r["episode_index"] for r in rows] == np.repeat(range(len(samples)), FRAMES).tolist()
    for row, frame in zip(rows, (f for s in samples for f in s.frames), strict=True):
        assert row["observation.wrench"] == pytest.approx([frame.labels[n] for n in WRENCH])
        assert row["observation.state"] == pytest.approx([frame.labels[n] for n in POSE])
        assert row["tactile.contact_x_mm"] == pytest.approx(
            frame.labels["contact_x_mm"], nan_ok=True
        )
        assert row["tactile.slip"] == frame.labels["slip"]
        assert row["timestamp"] == pytest.approx(frame.number / RATE_HZ)
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(row[f"tactile.{name}"], values)
        stored = Image.open(io.BytesIO(row["observation.images.tactile"]["bytes"]))
        np.testing.assert_array_equal(np.asarray(stored), frame.image)
    info = json.loads((tmp_path / "meta/info.json").read_text())
    test = len([s for s in samples if s.split == "test"])
    count = len(samples)
    expected = {"train": f"0:{count - test}", "test": f"{count - test}:{count}"}
    assert info["splits"] == ({"train": f"0:{count}"} if not test else expected)
    assert (info["total_episodes"], info["total_frames"]) == (count, count * FRAMES)
    assert info["gelslim"]["tactile_schema"] == "gelslim-tactile/1"


def test_the_action_of_a_frame_is_the_pose_of_the_next(tmp_path: Path) -> None:
    written(tmp_path, KINDS["png"])
    rows = frames_of(tmp_path)
    for row, after in itertools.pairwise(rows):
        last = row["frame_index"] == FRAMES - 1
        assert row["action"] == (row if last else after)["observation.state"]


def test_draws_and_numbers_stand_with_the_episodes(tmp_path: Path) -> None:
    samples = written(tmp_path, KINDS["png"], missing=(2,))
    rows = pq.read_table(tmp_path / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [r["draws/radius_mm"] for r in rows] == [s.draws["radius_mm"] for s in samples]
    assert [r["gelslim/id"] for r in rows] == [s.id for s in samples]
    assert [r["dataset_to_index"] for r in rows] == [FRAMES * (k + 1) for k in range(len(samples))]


def test_statistics_are_those_of_all_frames(tmp_path: Path) -> None:
    samples = written(tmp_path, KINDS["png"], grey=True)
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    frames = [f for s in samples for f in s.frames]
    wrench = np.array([[f.labels[n] for n in WRENCH] for f in frames])
    found = stats["observation.wrench"]
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(found[name], getattr(np, name)(wrench, axis=0), rtol=1e-5)
    assert found["count"] == [len(frames)]
    centre = np.array([f.labels["contact_x_mm"] for f in frames])
    for name in ("mean", "std"):
        expected = getattr(np, f"nan{name}")(centre)
        # An episode counts with all its frames; each has as many without a centre.
        np.testing.assert_allclose(stats["tactile.contact_x_mm"][name], expected, rtol=1e-5)
    pixels = np.array([f.image for f in frames]) / 255
    picture = stats["observation.images.tactile"]
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(picture[name], np.full((3, 1, 1), getattr(np, name)(pixels)))
    episodes = np.array([[f.image for f in s.frames] for s in samples])
    middle = np.mean([np.quantile(e, 0.5, method="inverted_cdf") for e in episodes]) / 255
    np.testing.assert_allclose(picture["q50"], np.full((3, 1, 1), middle))


def test_samples_with_other_columns_are_refused(tmp_path: Path) -> None:
    made = format_named("lerobot")
    writer = made.writer(tmp_path, shards(KINDS["png"])[0], {})
    writer.add(sample(0))
    with pytest.raises(DataSetError, match="sample 2"):
        writer.add(replace(sample(2), frames=(_bare(),)))
    with pytest.raises(DataSetError):
        made.complete(tmp_path / "fresh", tmp_path, [], {})


def _bare() -> SampleFrame:
    whole = sample(2).frames[0]
    return SampleFrame(0, 0.0, whole.labels, whole.image, {})


def test_damaged_files_are_told(tmp_path: Path) -> None:
    written(tmp_path, KINDS["png"])
    made, file = format_named("lerobot"), tmp_path / "data/chunk-000/file-000.parquet"
    assert made.problem(file) == ""
    data = bytearray(file.read_bytes())
    data[len(data) // 3 : len(data) // 3 + 64] = bytes(64)
    for broken in (bytes(data), bytes(data[: len(data) // 2]), b""):
        file.write_bytes(broken)
        assert made.problem(file)


@pytest.mark.slow
def test_videos_repeat_their_bytes_and_small_ones_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("av", reason="NOT TESTED: videos of data sets need PyAV")
    for kind in ("lossless video", "video"):
        files = []
        for turn in ("first", "second"):
            folder = tmp_path / kind / turn
            folder.mkdir(parents=True)
            written(folder, KINDS[kind])
            files.append(sorted((folder / "videos").rglob("*.mp4")))
        assert len(files[0]) == 3
        for one, other in zip(*files, strict=True):
            assert one.read_bytes() == other.read_bytes()
            assert format_named("lerobot").problem(one) == ""
            one.write_bytes(one.read_bytes()[:100])
            assert format_named("lerobot").problem(one)
    small = VideoFile(tmp_path / "small.mp4", 10, 60)
    with pytest.raises(DataSetError, match="16 x 16"):
        small.append(np.zeros((16, 16, 3), dtype=np.uint8))


def loaded(folder: Path) -> Any:
    """The data set as LeRobot's own loader reads it; skips the test without LeRobot."""
    pytest.importorskip(
        "lerobot.datasets.lerobot_dataset", reason="NOT TESTED: reading back needs lerobot"
    )
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    return LeRobotDataset("local/touches", root=folder)


@pytest.fixture(params=KINDS)
def read_back(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Any, list[Sample]]:
    if request.param != "png":
        pytest.importorskip("av", reason="NOT TESTED: videos of data sets need PyAV")
    samples = written(tmp_path, KINDS[request.param], missing=(2,))
    return request.param, loaded(tmp_path), samples


@pytest.mark.slow
def test_lerobot_reads_what_was_written(read_back: Any) -> None:
    kind, data, samples = read_back
    assert (len(data), data.num_episodes, data.fps) == (len(samples) * FRAMES, 7, 10)
    frames = [f for s in samples for f in s.frames]
    for number, frame in enumerate(frames):
        item = data[number]
        assert item["task"] == "press a ball"
        np.testing.assert_allclose(
            item["observation.wrench"], [frame.labels[n] for n in WRENCH], rtol=1e-6
        )
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(item[f"tactile.{name}"].numpy(), values)
        picture = item["observation.images.tactile"].numpy().transpose(1, 2, 0)
        assert picture.shape == frame.image.shape
        if kind == "video":
            assert abs(picture.mean() * 255 - frame.image.mean()) < 3
        else:
            np.testing.assert_array_equal(np.rint(picture * 255), frame.image)


@pytest.mark.slow
def test_lerobot_selects_episodes_and_looks_back_in_time(read_back: Any) -> None:
    _, data, samples = read_back
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    some = LeRobotDataset(
        "local/touches",
        root=data.root,
        episodes=[3, 6],
        delta_timestamps={"observation.wrench": [-0.1, 0.0]},
    )
    assert len(some) == 2 * FRAMES
    wrench = some[5]["observation.wrench"].numpy()
    expected = [[f.labels[n] for n in WRENCH] for f in samples[6].frames[:2]]
    np.testing.assert_allclose(wrench, expected, rtol=1e-6)
    assert some.meta.episodes[6]["draws/radius_mm"] == samples[6].draws["radius_mm"]


@pytest.mark.slow
def test_a_policy_of_lerobot_takes_the_observations_and_leaves_the_tactile_columns(
    read_back: Any,
) -> None:
    _, data, _ = read_back
    from lerobot.datasets.utils import dataset_to_policy_features

    taken = dataset_to_policy_features(data.features)
    assert set(taken) == {
        "observation.images.tactile", "observation.state", "observation.wrench", "action",
    }  # fmt: skip
    for name, feature in taken.items():
        assert np.asarray(data.meta.stats[name]["std"]).min() > 0, feature


@pytest.mark.parametrize("shape", [(1,), (2,), (9, 40), (3, 50, 3)])
@pytest.mark.parametrize("gaps", [0.0, 0.3])
def test_quantiles_are_those_of_each_column(shape: tuple[int, ...], gaps: float) -> None:
    """Against NumPy on one column after the other, without the values that do not exist."""
    rng = np.random.default_rng(len(shape))
    values = rng.normal(size=shape).astype(np.float32)
    values[rng.random(shape) < gaps] = np.nan
    found = statistics.of_values(values)
    columns = values.reshape(-1, shape[-1] if len(shape) > 1 else 1).T.astype(np.float64)
    for name, share in statistics.QUANTILES.items():
        held = [column[~np.isnan(column)] for column in columns]
        wanted = [np.quantile(c, share) if len(c) else np.nan for c in held]
        np.testing.assert_array_equal(found[name], wanted)


@pytest.mark.parametrize("parts", [(12,), (5, 7), (1,) * 12])
def test_statistics_do_not_depend_on_how_episodes_are_taken(parts: tuple[int, ...]) -> None:
    """Against all values at once; the second component of some episodes does not exist."""
    rng = np.random.default_rng(3)
    episodes = [rng.normal(5.0, 2.0, (rng.integers(2, 9), 3)) for _ in range(12)]
    for values in episodes[2:9:3]:
        values[:, 1] = np.nan
    of_each = [statistics.of_values(values) for values in episodes]
    combination, first = statistics.Combination(), 0
    for count in parts:
        some = of_each[first : first + count]
        combination.add({name: np.stack([one[name] for one in some]) for name in some[0]})
        first += count
    found, every = combination.result(), np.concatenate(episodes)
    np.testing.assert_allclose(found["min"], np.nanmin(every, axis=0))
    np.testing.assert_allclose(found["max"], np.nanmax(every, axis=0))
    np.testing.assert_allclose(found["mean"], np.nanmean(every, axis=0))
    np.testing.assert_allclose(found["std"], np.nanstd(every, axis=0))
    assert found["count"] == [len(every)]
