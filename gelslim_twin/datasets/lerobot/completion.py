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
    written = list(_written(dataset, shards))
    if not written:
        raise DataSetError(f"{dataset}: no sample was solved, so there is nothing to describe")
    features = written[0].features
    for other in written:
        alike = (other.features, frame_rate_hz(other.shard))
        if alike != (features, frame_rate_hz(written[0].shard)):
            raise DataSetError(
                f"{dataset}: shard {other.shard.name} has other columns or another frame rate than "
                f"{written[0].shard.name}; write both with the same scene"
            )
    task = task_of(about)
    for shard in written:
        _renumber(folder, dataset, shard)
    episodes = arrow().concat_tables(
        [_episode_rows(w, task) for w in written], promote_options="permissive"
    )
    tables = ((places.EPISODES_PATH, episodes), (places.TASKS_PATH, tasks_table([task])))
    for place, table in tables:
        with parquet_writer(folder / place, table.schema) as file:
            file.write_table(table)
    info = _info(written, {**features, **counter_features()})
    (folder / places.INFO_PATH).write_bytes(json_bytes(info))
    (folder / places.STATS_PATH).write_bytes(json_bytes(_statistics(episodes, features)))


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


def _info(written: Sequence[WrittenShard], features: Mapping[str, Feature]) -> dict[str, Any]:
    rate = frame_rate_hz(written[0].shard)
    records = {name: feature.record() for name, feature in features.items()}
    if _is_video(features):
        records[PICTURE]["info"] = _video_info(features[PICTURE], written[0].shard, rate)
    splits = {}
    for split in SPLITS:
        mine = [w.episodes for w in written if w.shard.split == split]
        if mine:
            splits[split] = f"{mine[0][0]}:{mine[-1][-1] + 1}"
    last = written[-1]
    return {
        "codebase_version": CODEBASE_VERSION,
        "robot_type": ROBOT_TYPE,
        "total_episodes": int(last.episodes[-1]) + 1,
        "total_frames": int(last.first_frame + last.lengths.sum()),
        "total_tasks": 1,
        "chunks_size": places.FILES_PER_CHUNK,
        "data_files_size_in_mb": _DATA_FILE_MB,
        "video_files_size_in_mb": _VIDEO_FILE_MB,
        "fps": rate,
        "splits": splits,
        "data_path": places.DATA_PATH,
        "video_path": places.VIDEO_PATH if _is_video(features) else None,
        "features": records,
        "gelslim": {
            "tactile_schema": TACTILE_SCHEMA,
            "even_times": written[0].shard.frame_rate_hz is not None,
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


def _statistics(episodes: Any, features: Mapping[str, Feature]) -> dict[str, Any]:
    """Statistics of all columns, but for those that have a component without any value."""
    found = {}
    for name in (*features, "timestamp", "frame_index", "task_index"):
        stacked = {
            kind: _rows(episodes[f"stats/{name}/{kind}"])
            for kind in ("min", "max", "mean", "std", "count", *statistics.QUANTILES)
            if f"stats/{name}/{kind}" in episodes.column_names
        }
        if not stacked:
            continue
        whole = statistics.combined(stacked)
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
