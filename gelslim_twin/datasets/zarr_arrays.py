"""The format `zarr`: a group of arrays for each shard, the picture among them.

    train/shard-00000.zarr.zip     `zarr.open_group(zarr.storage.ZipStore(path), mode="r")`
        image                      uint8 (frames, h, w, 3), compressed by Zstandard, lossless
        force_n                    float32 (frames, c, 3)

Every chunk is one frame, so that frames are read in any order and a writer keeps one at a time.
"""

from __future__ import annotations

import contextlib
import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gelslim_core.optional_library import load
from gelslim_twin.datasets.formats import DataSetError, FramePlace, Pictures, Shard
from gelslim_twin.datasets.sample import Sample

PURPOSE = "a data set of Zarr arrays"
IMAGE = "image"
ENDING = ".zarr.zip"
METADATA = "zarr.json"


class ZarrWriter:
    """Writes a shard as a group of arrays in one file, whose bytes depend on its samples alone."""

    def __init__(self, folder: Path, shard: Shard) -> None:
        """Open the file."""
        self._zarr = load("zarr", PURPOSE)
        self._inner = f"{shard.split}/shard-{shard.number:05d}{ENDING}"
        (folder / shard.split).mkdir()
        self._zip = zipfile.ZipFile(folder / self._inner, "w", zipfile.ZIP_STORED)
        self._most = max(1, len(shard.samples)) * (shard.frames_per_sample or MOST_FRAMES)
        self._stored: dict[str, Any] = {}
        self._arrays: dict[str, Any] = {}
        self._count = 0

    def add(self, sample: Sample) -> tuple[FramePlace, ...]:
        """Write the frames of a sample."""
        found = []
        for frame in sample.frames:
            held = dict(frame.arrays)
            if frame.image is not None:
                held[IMAGE] = frame.image
            for name, array in held.items():
                if name not in self._arrays:
                    self._arrays[name] = self._made(self._stored, name, array, self._most)
                self._arrays[name][self._count] = array
            self._flush()
            found.append(FramePlace(self._inner, str(self._count)))
            self._count += 1
        return tuple(found)

    def _made(self, stored: dict[str, Any], name: str, like: Any, count: int) -> Any:
        group = self._zarr.open_group(self._zarr.storage.MemoryStore(stored), mode="a")
        return group.create_array(
            name, shape=(count, *like.shape), dtype=like.dtype, chunks=(1, *like.shape)
        )

    def _flush(self) -> None:
        """Move the chunks from memory to the file."""
        for key in sorted(key for key in self._stored if not key.endswith(METADATA)):
            self._write(key, self._stored.pop(key).to_bytes())

    def _write(self, name: str, data: bytes) -> None:
        self._zip.writestr(zipfile.ZipInfo(name), data)

    def finish(self) -> None:
        """Write what describes the arrays, now that their length is known."""
        described: dict[str, Any] = {}
        self._zarr.open_group(self._zarr.storage.MemoryStore(described), mode="a")
        for name, array in self._arrays.items():
            self._made(described, name, _Like(array.shape[1:], array.dtype), self._count)
        for key in sorted(described):
            self._write(key, described[key].to_bytes())
        self._zip.close()

    def abandon(self) -> None:
        """Close the file, which would else complain when it is deleted from memory."""
        with contextlib.suppress(OSError):
            self._zip.close()


MOST_FRAMES = 1_000_000
"""Frames of a sample, at most, where their number is not known."""


class _Like:
    """Shape and type of an array."""

    def __init__(self, shape: tuple[int, ...], dtype: Any) -> None:
        self.shape = shape
        self.dtype = dtype


class ZarrArrays:
    """Arrays that are read frame by frame, pictures uncompressed but for Zstandard."""

    def require(self, pictures: Pictures) -> None:
        """Raise for pictures with losses, which arrays have not, and without the library."""
        load("zarr", PURPOSE)
        if pictures.kind != "png":
            raise DataSetError(
                f"pictures {pictures.kind}: zarr holds pictures as arrays without loss; leave "
                "the option out"
            )

    def writer(self, folder: Path, shard: Shard, about: Mapping[str, Any]) -> ZarrWriter:
        """Begin a shard."""
        return ZarrWriter(folder, shard)

    def complete(
        self, folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
    ) -> None:
        """Nothing describes the whole data set but its index."""

    def problem(self, file: Path) -> str:
        """Why a file cannot be read; empty where it can."""
        zarr = load("zarr", PURPOSE)
        try:
            group = zarr.open_group(zarr.storage.ZipStore(file), mode="r")
            for _, array in group.arrays():
                for k in range(array.shape[0]):
                    array[k]
        # A damaged archive fails in many ways within the library.
        except Exception as error:
            return str(error) or type(error).__name__
        return ""

    def renumbered(self, file: str, number: int) -> str:
        """Path of a file of a shard that has another number."""
        return re.sub(r"shard-[0-9]+", f"shard-{number:05d}", file)


FORMAT = ZarrArrays()
