"""Data sets of LeRobot, format v3.0, which its own loader reads.

They are written without LeRobot, whose pinned libraries rule out those of this program, and by
the rules that its loader and its statistics keep.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gelslim_twin.datasets.formats import DataSetFormat, Pictures, SampleWriter, Shard

__all__ = ["FORMAT"]


class LerobotFormat:
    """The format of LeRobot; see `DataSetFormat`."""

    def require(self, pictures: Pictures) -> None:
        """Raise MissingLibraryError before any work is done."""
        from gelslim_twin.datasets.lerobot import arrow_tables, video_file

        arrow_tables.parquet()
        if pictures.kind == "video":
            video_file.library()

    def writer(self, folder: Path, shard: Shard, about: Mapping[str, Any]) -> SampleWriter:
        """Begin a shard."""
        from gelslim_twin.datasets.lerobot.shard_writer import ShardWriter

        return ShardWriter(folder, shard)

    def complete(
        self, folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
    ) -> None:
        """Write `meta/`."""
        from gelslim_twin.datasets.lerobot.completion import complete

        complete(folder, dataset, shards, about)

    def problem(self, file: Path) -> str:
        """Why a file of a shard cannot be read; empty where it can."""
        from gelslim_twin.datasets.lerobot.arrow_tables import parquet_problem
        from gelslim_twin.datasets.lerobot.video_file import video_problem

        return video_problem(file) if file.suffix == ".mp4" else parquet_problem(file)

    def renumbered(self, file: str, number: int) -> str:
        """Path of a file of a shard that has another number."""
        from gelslim_twin.datasets.lerobot.places import renumbered

        return renumbered(file, number)


FORMAT: DataSetFormat = LerobotFormat()
