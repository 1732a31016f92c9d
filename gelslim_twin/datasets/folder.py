"""The format `folder`: a picture file for each frame, and a NumPy file for each array of a shard.

train/00000/press-1-0000042_00010.png
train/00000/force_n.npy        float32 (frames, c, 3), in the order of the rows of the index
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.datasets.formats import FramePlace, Pictures, Shard, require_stills
from gelslim_twin.datasets.picture_files import decoded, encoded
from gelslim_twin.datasets.sample import Sample
from ifem_export.bundle.array_file import save_array

ARRAYS = ".npy"


class FolderWriter:
    """Writes a shard as a folder."""

    def __init__(self, folder: Path, shard: Shard) -> None:
        """Make the folder."""
        self._inner = f"{shard.split}/{shard.number:05d}"
        self._place = folder / self._inner
        self._place.mkdir(parents=True)
        self._pictures = shard.pictures
        self._held: dict[str, list[NDArray[Any]]] = {}

    def add(self, sample: Sample) -> tuple[FramePlace, ...]:
        """Write the pictures of a sample and keep its arrays."""
        found = []
        for frame in sample.frames:
            for name, array in frame.arrays.items():
                self._held.setdefault(name, []).append(array)
            file = self._inner
            if frame.image is not None:
                name = f"{sample.id}_{frame.number:05d}{self._pictures.suffix}"
                (self._place / name).write_bytes(encoded(frame.image, self._pictures))
                file = f"{self._inner}/{name}"
            found.append(FramePlace(file))
        return tuple(found)

    def finish(self) -> None:
        """Write the arrays."""
        for name, arrays in self._held.items():
            with open(self._place / f"{name}{ARRAYS}", "wb") as file:
                save_array(file, np.stack(arrays))

    def abandon(self) -> None:
        """No file is open."""


class Folder:
    """Pictures as files, and arrays of whole shards."""

    def require(self, pictures: Pictures) -> None:
        """Refuse videos. Raises DataSetError."""
        require_stills(pictures, "folder")

    def writer(self, folder: Path, shard: Shard, about: Mapping[str, Any]) -> FolderWriter:
        """Begin a shard."""
        return FolderWriter(folder, shard)

    def complete(
        self, folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
    ) -> None:
        """Nothing describes the whole data set but its index."""

    def problem(self, file: Path) -> str:
        """Why a file cannot be read; empty where it can."""
        try:
            if file.suffix == ARRAYS:
                np.load(file, mmap_mode="r", allow_pickle=False)
            else:
                decoded(file.read_bytes())
        except (OSError, ValueError, EOFError) as error:
            return str(error)
        return ""

    def renumbered(self, file: str, number: int) -> str:
        """Path of a file of a shard that has another number."""
        split, _, *inner = file.split("/")
        return "/".join([split, f"{number:05d}", *inner])


FORMAT = Folder()
