"""The formats of data sets: what each of them has to offer, and where it is found.

A format is a module with an object `FORMAT` that is a `DataSetFormat`. It is listed in `FORMATS`
and imported when it is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, Protocol, cast, get_args, runtime_checkable

from gelslim_core.errors import GelslimError
from gelslim_twin.datasets.sample import Sample, Split

PictureKind = Literal["png", "webp", "jpeg", "video"]
MOST_QUALITY = 100


class DataSetError(GelslimError, ValueError):
    """A data set cannot be made, continued, merged or read; the message says why."""


@dataclass(frozen=True)
class Pictures:
    """How pictures are encoded.

    Attributes:
        kind: PNG is lossless; WebP and video are lossless at quality 100; JPEG never is.
        quality: 1 to 100 of WebP, JPEG and video.
    """

    kind: PictureKind = "png"
    quality: int = 95

    @property
    def suffix(self) -> str:
        """Ending of the files, with its dot."""
        return ".jpg" if self.kind == "jpeg" else f".{self.kind}"


def pictures_of(kind: str, quality: int) -> Pictures:
    """An encoding by name.

    Raises:
        DataSetError: There is no such kind, or the quality is not 1 to 100.
    """
    for known in get_args(PictureKind):
        if kind == known and 1 <= quality <= MOST_QUALITY:
            return Pictures(known, quality)
    if kind in get_args(PictureKind):
        raise DataSetError(f"quality {quality} of pictures: must be 1 to {MOST_QUALITY}")
    raise DataSetError(f"pictures {kind!r}: write {', '.join(get_args(PictureKind))}")


def require_stills(pictures: Pictures, format_name: str) -> None:
    """Refuse videos for a format that has none. Raises DataSetError."""
    if pictures.kind == "video":
        raise DataSetError(
            f"pictures video: the format {format_name} holds single pictures; write png, webp or "
            "jpeg, or choose the format lerobot"
        )


@dataclass(frozen=True)
class Shard:
    """Consecutive samples of one split, which one worker writes.

    Attributes:
        split: Split of all its samples.
        number: Number of the shard within its split, from 0.
        first: Place of its first sample in the order of the data set: split after split, and by
            number within each. Samples that could not be solved are counted.
        samples: Numbers of its samples, ascending.
        pictures: Encoding of the pictures.
        frames_per_sample: Frames of each sample; None where it differs.
        frame_rate_hz: Frames per second; None where their times are not even.
    """

    split: Split
    number: int
    first: int
    samples: tuple[int, ...]
    pictures: Pictures
    frames_per_sample: int | None = None
    frame_rate_hz: float | None = None

    @property
    def name(self) -> str:
        """`train-00000`."""
        return f"{self.split}-{self.number:05d}"


@dataclass(frozen=True)
class FramePlace:
    """Where a frame of a sample is found.

    Attributes:
        file: Path relative to the data set, with slashes.
        entry: Name or row within that file; empty where the file is the frame.
    """

    file: str
    entry: str = ""


class SampleWriter(Protocol):
    """Writes the samples of one shard, in the order of their numbers."""

    def add(self, sample: Sample) -> tuple[FramePlace, ...]:
        """Take the next sample. Returns the place of each of its frames."""

    def finish(self) -> None:
        """Complete all files. No `add` follows."""

    def abandon(self) -> None:
        """Close all files of a shard that cannot be completed, whose folder is then removed.

        What the disk says against it is of no interest.
        """


class DataSetFormat(Protocol):
    """One format of data sets."""

    def require(self, pictures: Pictures) -> None:
        """Raise an error before any work is done.

        Raises:
            MissingLibraryError: A library is not installed.
            DataSetError: The format has no such pictures.
        """

    def writer(self, folder: Path, shard: Shard, about: Mapping[str, Any]) -> SampleWriter:
        """Begin a shard.

        Args:
            folder: An empty folder in the place of the data set's. Every file that the writer
                makes below it is hashed after `finish` and moved to the same relative path in the
                data set; so names of files must differ from shard to shard.
            shard: The shard.
            about: What `dataset.json` says of the data set.
        """

    def complete(
        self, folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
    ) -> None:
        """Write what describes the whole data set into `folder`, after its last shard.

        Args:
            folder: An empty folder whose files are moved into the data set, as in `writer`.
            dataset: The data set, with the files of all shards, `index.parquet` and `sensors/`.
            shards: All shards, in order.
            about: What `dataset.json` says of the data set.
        """

    def problem(self, file: Path) -> str:
        """Why one file of a shard cannot be read; empty where it can."""


@runtime_checkable
class MergeableFormat(Protocol):
    """A format whose shards do not know their numbers but by the names of their files."""

    def renumbered(self, file: str, number: int) -> str:
        """Path of a file of a shard within a data set where the shard has another number."""


FORMATS: Mapping[str, str] = {
    "folder": "gelslim_twin.datasets.folder",
    "webdataset": "gelslim_twin.datasets.webdataset",
    "zarr": "gelslim_twin.datasets.zarr_arrays",
    "lerobot": "gelslim_twin.datasets.lerobot",
}
"""The module of each format."""


def format_named(name: str) -> DataSetFormat:
    """Import a format.

    Raises:
        DataSetError: There is no such format.
    """
    if name not in FORMATS:
        raise DataSetError(
            f"there is no format {name!r} of data sets; choose {', '.join(sorted(FORMATS))}"
        )
    return cast("DataSetFormat", import_module(FORMATS[name]).FORMAT)
