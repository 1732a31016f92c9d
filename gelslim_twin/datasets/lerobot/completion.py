"""What describes a whole data set of LeRobot: `meta/` with its features, tasks and episodes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.replaced_file import json_bytes
from gelslim_twin.datasets.formats import DataSetError, Shard
from gelslim_twin.datasets.lerobot import places, statistics
from gelslim_twin.datasets.lerobot.arrow_tables import (
    arrow,
    frame_schema,
    parquet,
    parquet_writer,
    tasks_table,
)
from gelslim_twin.datasets.lerobot.features import (
    PICTURE,
    RENUMBERED,
    TACTILE_SCHEMA,
    Feature,
    counter_features,
)
from gelslim_twin.datasets.lerobot.shard_writer import frame_rate_hz
from gelslim_twin.datasets.sample import SPLITS

CODEBASE_VERSION = "v3.0"
ROBOT_TYPE = "gelslim"
_DATA_FILE_MB, _VIDEO_FILE_MB = 100, 200
_EPISODE_PLACE = {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class WrittenShard:
    """A shard that holds samples.

    Attributes:
        shard: The shard.
        table: Its episodes, one per row.
        features: Its columns but for the counters.
        first_episode, first_frame: Numbers of its first episode and frame in the data set.
    """

    shard: Shard
    table: Any
    features: Mapping[str, Feature]
    first_episode: int
    first_frame: int

    @property
    def lengths(self) -> Indices:
        """Frames of each episode."""
        found: Indices = self.table["length"].to_numpy()
        return found

    @property
    def episodes(self) -> Indices:
        """Number of each episode."""
        return self.first_episode + np.arange(self.table.num_rows)

    @property
    def starts(self) -> Indices:
        """First frame of each episode."""
        return self.first_frame + np.cumsum(self.lengths) - self.lengths


def complete(
    folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
) -> None:
    """Write `meta/`, and the files of frames whose numbers change because samples are missing.

    The arguments are those of `DataSetFormat.complete`.

    Raises:
        DataSetError: No shard holds a sample, or shards have different columns.
    """
    first: WrittenShard | None = None
    schema: Any = None
    for shard in _written(dataset, shards):
        first = first or shard
        _require_alike(dataset, first, shard)
        found = _episode_rows(shard, task_of(about)).schema
        # A column without any value in a shard takes its type from the others.
        both = [found] if schema is None else [schema, found]
        schema = arrow().unify_schemas(both, promote_options="permissive")
        _renumber(folder, dataset, shard)
    if first is None:
        raise DataSetError(f"{dataset}: no sample was solved, so there is nothing to describe")
    info, figures = _Info(first), _Figures(first.features)
    with parquet_writer(folder / places.EPISODES_PATH, schema) as file:
        for shard in _written(dataset, shards):
            rows = arrow().concat_tables(
                [schema.empty_table(), _episode_rows(shard, task_of(about))],
                promote_options="permissive",
            )
            file.write_table(rows)
            info.add(shard)
            figures.add(rows)
    tasks = tasks_table([task_of(about)])
    with parquet_writer(folder / places.TASKS_PATH, tasks.schema) as file:
        file.write_table(tasks)
    (folder / places.INFO_PATH).write_bytes(json_bytes(info.record()))
    (folder / places.STATS_PATH).write_bytes(json_bytes(figures.record()))


def _require_alike(dataset: Path, first: WrittenShard, other: WrittenShard) -> None:
    alike = (first.features, frame_rate_hz(first.shard))
    if (other.features, frame_rate_hz(other.shard)) != alike:
        raise DataSetError(
            f"{dataset}: shard {other.shard.name} has other columns or another frame rate than "
            f"{first.shard.name}; write both with the same scene"
        )


def task_of(about: Mapping[str, Any]) -> str:
    """What the motion of the data set is for, in words."""
    return str(about.get("name") or "touch the gel")


def _written(dataset: Path, shards: Sequence[Shard]) -> Iterator[WrittenShard]:
    episode = frame = 0
    for shard in shards:
        table = parquet().read_table(dataset / places.episode_file(shard))
        if not table.num_rows:
            continue
        described = json.loads(table.schema.metadata[b"features"])
        features = {name: Feature.from_record(record) for name, record in described.items()}
        found = WrittenShard(shard, table.replace_schema_metadata(None), features, episode, frame)
        yield found
        episode += table.num_rows
        frame += int(found.lengths.sum())


def _renumber(folder: Path, dataset: Path, written: WrittenShard) -> None:
    """Write the frames of a shard again, unless they have the right numbers already."""
    place = places.data_file(written.shard)
    episode = np.repeat(written.episodes, written.lengths)
    right = {"episode_index": episode, "index": written.first_frame + np.arange(len(episode))}
    with parquet().ParquetFile(dataset / place) as file:
        found = file.read(list(RENUMBERED))
        if all(np.array_equal(found[name].to_numpy(), right[name]) for name in RENUMBERED):
            return
        # The schema of a file that was read has notes that one just written has not.
        schema = frame_schema({**written.features, **counter_features()})
        with parquet_writer(folder / place, schema) as target:
            row = 0
            for number in range(file.num_row_groups):
                table = file.read_row_group(number)
                for name in RENUMBERED:
                    values = arrow().array(right[name][row : row + len(table)])
                    table = table.set_column(table.column_names.index(name), name, values)
                target.write_table(arrow().table(table.columns, schema=schema))
                row += len(table)


def _episode_rows(written: WrittenShard, task: str) -> Any:
    pa = arrow()
    chunk, file = places.chunk_and_file(written.shard)
    count, lengths, starts = written.table.num_rows, written.lengths, written.starts
    columns: dict[str, Any] = {
        "episode_index": written.episodes,
        "tasks": pa.array([[task]] * count),
        "length": lengths,
        "data/chunk_index": np.full(count, chunk),
        "data/file_index": np.full(count, file),
        "dataset_from_index": starts,
        "dataset_to_index": starts + lengths,
        **{name: np.full(count, value) for name, value in _EPISODE_PLACE.items()},
    }
    if _is_video(written.features):
        rate, begun = frame_rate_hz(written.shard), starts - written.first_frame
        columns |= {
            f"videos/{PICTURE}/chunk_index": np.full(count, chunk),
            f"videos/{PICTURE}/file_index": np.full(count, file),
            f"videos/{PICTURE}/from_timestamp": begun / rate,
            f"videos/{PICTURE}/to_timestamp": (begun + lengths) / rate,
        }
    for name in written.table.column_names:
        if name != "length":
            mine = name if "/" in name else f"gelslim/{name}"
            columns[mine] = written.table[name]
    return pa.table(columns)


def _is_video(features: Mapping[str, Feature]) -> bool:
    return PICTURE in features and features[PICTURE].dtype == "video"


class _Info:
    """What `meta/info.json` says, from the shards one after the other."""

    def __init__(self, first: WrittenShard) -> None:
        self._first = first
        self._splits: dict[str, tuple[int, int]] = {}
        self._frames = 0

    def add(self, written: WrittenShard) -> None:
        """Take the next shard."""
        name, end = written.shard.split, written.first_episode + written.table.num_rows
        begin, _ = self._splits.get(name, (written.first_episode, 0))
        self._splits[name] = begin, end
        self._frames = written.first_frame + int(written.lengths.sum())

    def record(self) -> dict[str, Any]:
        """The content of the file."""
        first = self._first
        features, rate = {**first.features, **counter_features()}, frame_rate_hz(first.shard)
        records = {name: feature.record() for name, feature in features.items()}
        if _is_video(features):
            records[PICTURE]["info"] = _video_info(features[PICTURE], first.shard, rate)
        return {
            "codebase_version": CODEBASE_VERSION,
            "robot_type": ROBOT_TYPE,
            "total_episodes": max(end for _, end in self._splits.values()),
            "total_frames": self._frames,
            "total_tasks": 1,
            "chunks_size": places.FILES_PER_CHUNK,
            "data_files_size_in_mb": _DATA_FILE_MB,
            "video_files_size_in_mb": _VIDEO_FILE_MB,
            "fps": rate,
            "splits": {
                split: "{}:{}".format(*self._splits[split])
                for split in SPLITS
                if split in self._splits
            },
            "data_path": places.DATA_PATH,
            "video_path": places.VIDEO_PATH if _is_video(features) else None,
            "features": records,
            "gelslim": {
                "tactile_schema": TACTILE_SCHEMA,
                "even_times": first.shard.frame_rate_hz is not None,
            },
        }


def _video_info(feature: Feature, shard: Shard, rate: float) -> dict[str, Any]:
    height, width, channels = feature.shape
    lossless = shard.pictures.quality == 100
    return {
        "video.height": height,
        "video.width": width,
        "video.codec": "h264" if lossless else "av1",
        "video.pix_fmt": "gbrp" if lossless else "yuv420p",
        "video.is_depth_map": False,
        "video.fps": rate,
        "video.channels": channels,
        "has_audio": False,
    }


class _Figures:
    """Statistics of all columns, but for those that have a component without any value."""

    def __init__(self, features: Mapping[str, Feature]) -> None:
        names = (*features, "timestamp", "frame_index", "task_index")
        self._by_column = {name: statistics.Combination() for name in names}

    def add(self, episodes: Any) -> None:
        """Take some rows of the table of episodes."""
        for name, found in list(self._by_column.items()):
            stacked = {
                kind: _rows(episodes[f"stats/{name}/{kind}"])
                for kind in ("min", "max", "mean", "std", "count", *statistics.QUANTILES)
                if f"stats/{name}/{kind}" in episodes.column_names
            }
            if stacked:
                found.add(stacked)
            else:
                del self._by_column[name]

    def record(self) -> dict[str, Any]:
        """The content of `meta/stats.json`."""
        found = {}
        for name, column in self._by_column.items():
            whole = column.result()
            if all(np.isfinite(value).all() for value in whole.values()):
                picture = name == PICTURE
                found[name] = {
                    kind: (v.reshape(-1, 1, 1) if picture and kind != "count" else v).tolist()
                    for kind, v in whole.items()
                }
        return found


def _rows(column: Any) -> NDArray[np.float64]:
    """The values (n, k) of a column of n lists, which may be nested."""
    flat = column.combine_chunks()
    count = len(flat)
    while arrow().types.is_list(flat.type):
        flat = flat.flatten()
    values: NDArray[np.float64] = flat.to_numpy(zero_copy_only=False).astype(np.float64)
    return values.reshape(count, -1)
