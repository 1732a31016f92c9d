"""One shard of a data set of LeRobot: a file of frames, a video of them, and its episodes."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import OutputError
from gelslim_twin.datasets.formats import DataSetError, FramePlace, Shard
from gelslim_twin.datasets.lerobot import statistics
from gelslim_twin.datasets.lerobot.arrow_tables import arrow, frame_table, parquet_writer
from gelslim_twin.datasets.lerobot.features import (
    PICTURE,
    RENUMBERED,
    Feature,
    columns_of,
    counter_features,
    features_of,
    pictures_of,
)
from gelslim_twin.datasets.lerobot.places import data_file, episode_file, video_file
from gelslim_twin.datasets.lerobot.video_file import VideoFile
from gelslim_twin.datasets.picture_files import encoded
from gelslim_twin.datasets.sample import Sample

_GROUP_BYTES = 1 << 26
"""Frames are written in groups of about this size."""
_EPISODES_WAITING = 64
"""Episodes that are kept as Python's objects, which take ten times the room of a table."""
UNEVEN_RATE_HZ = 1
"""Rate of a data set whose frames have no even times; their timestamps count them."""


def frame_rate_hz(shard: Shard) -> float:
    """Frames per second by which the data set counts time; whole numbers are of type int."""
    rate = shard.frame_rate_hz or UNEVEN_RATE_HZ
    return int(rate) if float(rate).is_integer() else rate


class ShardWriter:
    """Writes the samples of one shard; each is an episode.

    Numbers of episodes and frames count as if no sample were missing; what the shard really holds
    is in its file of episodes, by which the data set is completed.
    """

    def __init__(self, folder: Path, shard: Shard) -> None:
        """Begin a shard in an empty folder, as `DataSetFormat.writer` describes it."""
        self._folder, self._shard = folder, shard
        self._rate_hz = frame_rate_hz(shard)
        self._features: dict[str, Feature] = {}
        self._tables: list[Any] = []
        self._waiting_bytes = self._rows = 0
        self._parquet: Any = None
        self._video: VideoFile | None = None
        self._episodes: list[dict[str, Any]] = []
        self._episode_tables: list[Any] = []

    def add(self, sample: Sample) -> tuple[FramePlace, ...]:
        """Take the next sample. Returns the row of each of its frames in the file of frames.

        Raises:
            DataSetError: Its columns are not those of the samples before it.
            OutputError: The disk refuses the video.
        """
        is_video = self._shard.pictures.kind == "video"
        features = features_of(sample, video=is_video)
        if self._features and features != self._features:
            raise DataSetError(_difference(sample, self._features, features))
        self._features = features
        columns = {**columns_of(sample), **self._counters(sample)}
        pictures = (
            [] if is_video else [encoded(p, self._shard.pictures) for p in pictures_of(sample)]
        )
        table = frame_table({**features, **counter_features()}, columns, pictures)
        self._tables.append(table)
        self._waiting_bytes += table.nbytes
        if self._waiting_bytes > _GROUP_BYTES:
            self._flush()
        if is_video and PICTURE in features:
            self._film(sample)
        self._episodes.append(self._episode(sample, columns))
        if len(self._episodes) == _EPISODES_WAITING:
            self._tabulate()
        first, self._rows = self._rows, self._rows + len(sample.frames)
        name = data_file(self._shard).as_posix()
        return tuple(FramePlace(name, str(row)) for row in range(first, self._rows))

    def finish(self) -> None:
        """Complete all files. No `add` follows."""
        self._flush()
        if self._parquet is not None:
            self._parquet.close()
        if self._video is not None:
            self._video.finish()
        features = {name: feature.record() for name, feature in self._features.items()}
        self._tabulate()
        table = arrow().concat_tables(self._episode_tables, promote_options="permissive")
        table = table.replace_schema_metadata({"features": json.dumps(features)})
        with parquet_writer(self._folder / episode_file(self._shard), table.schema) as file:
            file.write_table(table)

    def _tabulate(self) -> None:
        """Put the episodes that wait into a table."""
        if self._episodes or not self._episode_tables:
            self._episode_tables.append(arrow().Table.from_pylist(self._episodes))
            self._episodes = []

    def abandon(self) -> None:
        """Close all files."""
        for file in (self._parquet, self._video):
            if file is not None:
                with contextlib.suppress(OSError, OutputError):
                    file.close()

    def _counters(self, sample: Sample) -> dict[str, NDArray[Any]]:
        count = len(sample.frames)
        frame = np.arange(count)
        episode = self._shard.first + self._shard.samples.index(sample.number)
        per_sample = self._shard.frames_per_sample or 0
        return {
            "timestamp": (frame / self._rate_hz).astype(np.float32),
            "frame_index": frame,
            "episode_index": np.full(count, episode),
            "index": episode * per_sample + frame,
            "task_index": np.zeros(count, dtype=np.int64),
        }

    def _film(self, sample: Sample) -> None:
        if self._video is None:
            path = self._folder / video_file(self._shard)
            self._video = VideoFile(path, self._rate_hz, self._shard.pictures.quality)
        for picture in pictures_of(sample):
            self._video.append(picture)

    def _episode(self, sample: Sample, columns: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        found = {
            name: statistics.of_values(values)
            for name, values in columns.items()
            if values.dtype != object and name not in RENUMBERED
        }
        if PICTURE in self._features:
            found[PICTURE] = statistics.of_pictures(pictures_of(sample))
        return {
            "number": sample.number,
            "id": sample.id,
            "seed": sample.seed,
            "split": sample.split,
            "length": len(sample.frames),
            **{f"draws/{name}": value for name, value in sample.draws.items()},
            **{
                f"stats/{name}/{kind}": value.tolist()
                for name, kinds in found.items()
                for kind, value in kinds.items()
            },
        }

    def _flush(self) -> None:
        if not self._tables:
            return
        table = arrow().concat_tables(self._tables)
        if self._parquet is None:
            self._parquet = parquet_writer(self._folder / data_file(self._shard), table.schema)
        self._parquet.write_table(table)
        self._tables, self._waiting_bytes = [], 0


def _difference(sample: Sample, old: Mapping[str, Feature], new: Mapping[str, Feature]) -> str:
    changed = sorted(n for n in {*old, *new} if old.get(n) != new.get(n))
    return (
        f"sample {sample.number} has other columns than the samples before it "
        f"({', '.join(changed)}); all samples of a data set of LeRobot must have the same"
    )
