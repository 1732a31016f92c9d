"""Where the files of a data set of LeRobot are, format v3.0.

The loader takes the files of `data/` by name, so their order must be that of the frames. A split
has its own hundred chunks: those of `train` begin with 0, of `validation` with 100, of `test` with
200.
"""

from __future__ import annotations

from pathlib import Path

from gelslim_twin.datasets.formats import Shard
from gelslim_twin.datasets.lerobot.features import PICTURE
from gelslim_twin.datasets.sample import SPLITS

FILES_PER_CHUNK = 1000
CHUNKS_PER_SPLIT = 100
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = "meta/episodes/chunk-000/file-000.parquet"
INFO_PATH, STATS_PATH, TASKS_PATH = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
SHARD_EPISODES = "meta/shards"
"""Folder of what each shard tells of its episodes; LeRobot does not look there."""


def chunk_and_file(shard: Shard) -> tuple[int, int]:
    """Numbers of the chunk and of the file within it."""
    chunk, file = divmod(shard.number, FILES_PER_CHUNK)
    return CHUNKS_PER_SPLIT * SPLITS.index(shard.split) + chunk, file


def data_file(shard: Shard) -> Path:
    """The file of the frames of a shard."""
    chunk, file = chunk_and_file(shard)
    return Path(DATA_PATH.format(chunk_index=chunk, file_index=file))


def video_file(shard: Shard) -> Path:
    """The video of a shard."""
    chunk, file = chunk_and_file(shard)
    return Path(VIDEO_PATH.format(video_key=PICTURE, chunk_index=chunk, file_index=file))


def renumbered(file: str, number: int) -> str:
    """Path of a file of a shard that has another number within its split."""
    path = Path(file)
    if path.parent.as_posix() == SHARD_EPISODES:
        split = path.stem.rpartition("-")[0]
        return (path.parent / f"{split}-{number:05d}.parquet").as_posix()
    split_number = int(path.parent.name.removeprefix("chunk-")) // CHUNKS_PER_SPLIT
    chunk, inner = divmod(number, FILES_PER_CHUNK)
    folder = path.parent.parent / f"chunk-{CHUNKS_PER_SPLIT * split_number + chunk:03d}"
    return (folder / f"file-{inner:03d}{path.suffix}").as_posix()


def episode_file(shard: Shard) -> Path:
    """What a shard tells of its episodes."""
    return Path(SHARD_EPISODES, f"{shard.name}.parquet")
