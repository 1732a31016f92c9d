"""Data sets of LeRobot from `gelslim dataset`: grown, merged, verified, and read by LeRobot."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason="NOT TESTED: data sets need pyarrow")
pytest.importorskip("cv2", reason="NOT TESTED: data sets with pictures need OpenCV")
import pyarrow.parquet as pq

import gelslim
from gelslim.data_sets import merge_data_sets, verify_data_set
from gelslim.examples import example

pytestmark = pytest.mark.slow
SAMPLES = 4
WRENCH = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")
SCENE = """\
format: gelslim-scene/1
name: touches
sensor: {{spec: finger.yaml}}
indenters: [{{shape: sphere, radius_mm: 6}}]
motion:
  waypoints: [{{move: press, depth_mm: 0.4, steps: 4, duration_s: 0.2}}]
observe: [force, image]
vary: {{x_mm: [-3, 3], depth_factor: [0.5, 1.2], split: {{by: sample, test_share: 0.3}}}}
seed: {seed}
"""


def made(
    folder: Path, count: int, seed: int = 7, name: str = "set", **options: Any
) -> dict[str, Any]:
    """A data set with every second frame, in shards of two samples."""
    for file, text in example("mini20").files("finger").items():
        (folder / file).write_text(text, encoding="utf-8")
    scene = folder / f"touches_{seed}.yaml"
    scene.write_text(SCENE.format(seed=seed), encoding="utf-8")
    kept = {"file_format": "lerobot", "frames": "every:2", "frames_per_shard": 6, **options}
    return gelslim.data_set(scene, folder / f"{name}_{seed}", count=count, **kept)


def hashes(folder: Path) -> dict[str, str]:
    """Hash of each file below a folder."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def read(folder: Path) -> Any:
    pytest.importorskip(
        "lerobot.datasets.lerobot_dataset", reason="NOT TESTED: reading back needs lerobot"
    )
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    return LeRobotDataset("local/touches", root=folder)


def test_a_data_set_grows_is_merged_and_is_read(tmp_path: Path) -> None:
    for count in (3, 6):
        about = made(tmp_path, count)
        assert verify_data_set(tmp_path / "set_7")["faults"] == []
        rows = [
            row
            for file in sorted((tmp_path / "set_7/data").glob("*/*.parquet"))
            for row in pq.read_table(file, columns=["index", "episode_index"]).to_pylist()
        ]
        assert [r["index"] for r in rows] == list(range(about["frames"]))
        assert [r["episode_index"] for r in rows] == np.repeat(range(count), 3).tolist()
    made(tmp_path, 6, name="at_once")
    grown, at_once = (hashes(tmp_path / name) for name in ("set_7", "at_once_7"))
    assert grown == at_once
    made(tmp_path, 2, seed=8)
    merged = merge_data_sets([tmp_path / "set_7", tmp_path / "set_8"], tmp_path / "both")
    assert merged["samples"] == 8
    for name in ("set_7", "set_8", "both"):
        assert verify_data_set(tmp_path / name)["faults"] == [], name
    data = read(tmp_path / "both")
    assert (data.num_episodes, len(data), data.fps) == (8, 24, 10)
    table = pq.read_table(tmp_path / "both/index.parquet").to_pylist()
    for number, row in enumerate(table):
        item = data[number]
        assert float(item["timestamp"]) == pytest.approx(row["time_s"], abs=1e-6)
        assert float(item["observation.wrench"][2]) == pytest.approx(row["fz_n"], rel=1e-6)
        force = item["tactile.force_n"].numpy().sum(axis=0)
        np.testing.assert_allclose(force[2], row["fz_n"], rtol=1e-4, atol=1e-5)
        assert data.meta.episodes[int(item["episode_index"])]["gelslim/id"] == row["id"]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, Any]], np.ndarray]:
    """Rows and pictures (t, 480, 640, 3) of the scene as plain files, which OpenCV reads."""
    import cv2

    folder = tmp_path_factory.mktemp("drawn")
    made(folder, SAMPLES, name="plain", file_format="folder")
    rows = pq.read_table(folder / "plain_7/index.parquet").to_pylist()
    pictures = [cv2.imread(str(folder / "plain_7" / row["file"])) for row in rows]
    return rows, np.array(pictures)[..., ::-1]


@pytest.mark.parametrize(
    ("pictures", "quality", "least_db"),
    [("png", 100, np.inf), ("video", 100, np.inf), ("video", 95, 38.0), ("video", 52, 36.0)],
)
def test_full_size_pictures_are_those_that_were_drawn(
    tmp_path: Path, drawn: Any, capfd: Any, pictures: str, quality: int, least_db: float
) -> None:
    """Peak signal-to-noise ratio of each picture; 20 samples have 38.2 and 36.3 dB at least."""
    if pictures == "video":
        pytest.importorskip("av", reason="NOT TESTED: videos of data sets need PyAV")
    made(tmp_path, SAMPLES, pictures=pictures, quality=quality)
    assert "Svt" not in "".join(capfd.readouterr())
    data = read(tmp_path / "set_7")
    rows, truth = drawn
    assert truth.shape == (3 * SAMPLES, 480, 640, 3)
    assert (len(data), data.num_episodes) == (3 * SAMPLES, SAMPLES)
    for number, (row, picture) in enumerate(zip(rows, truth, strict=True)):
        item = data[number]
        assert data.meta.episodes[int(item["episode_index"])]["gelslim/id"] == row["id"]
        wrench = [row[name] for name in WRENCH]
        np.testing.assert_allclose(item["observation.wrench"], wrench, rtol=1e-6, atol=1e-9)
        found = np.rint(255 * item["observation.images.tactile"].numpy().transpose(1, 2, 0))
        squared = np.mean((found - picture) ** 2, dtype=np.float64)
        decibels = 10 * np.log10(255**2 / squared) if squared else np.inf
        assert decibels >= least_db, number
    stored = data.meta.stats
    values = np.array([[row[name] for name in WRENCH] for row in rows])
    for name in ("min", "max", "mean", "std"):
        expected = getattr(np, name)(values, axis=0)
        np.testing.assert_allclose(stored["observation.wrench"][name], expected, atol=1e-6)
        expected = getattr(np, name)(truth / 255, axis=(0, 1, 2))
        of_pictures = np.ravel(stored["observation.images.tactile"][name])
        np.testing.assert_allclose(of_pictures, expected, atol=1e-9)


def test_videos_are_for_lerobot_alone(tmp_path: Path) -> None:
    from gelslim_twin.datasets.formats import DataSetError, Pictures, format_named

    for name in ("folder", "webdataset"):
        with pytest.raises(DataSetError):
            format_named(name).require(Pictures("video"))
