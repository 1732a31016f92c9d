"""The format `webdataset`: a tar file for each shard, as the package `webdataset` reads it.

The files of a frame follow one another and have its key as the first part of their names:

    press-1-0000042_00010.png
    press-1-0000042_00010.force_n.npy
    press-1-0000042_00010.json       draws and labels
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
import tarfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_twin.datasets.formats import FramePlace, Pictures, Shard, require_stills
from gelslim_twin.datasets.picture_files import decoded, encoded
from gelslim_twin.datasets.sample import Sample, SampleFrame, Value


class TarWriter:
    """Writes a shard as a tar file whose bytes depend on its samples alone."""

    def __init__(self, folder: Path, shard: Shard) -> None:
        """Open the file."""
        self._inner = f"{shard.split}/shard-{shard.number:05d}.tar"
        (folder / shard.split).mkdir()
        self._tar = tarfile.open(folder / self._inner, "w", format=tarfile.USTAR_FORMAT)  # noqa: SIM115
        self._pictures = shard.pictures

    def add(self, sample: Sample) -> tuple[FramePlace, ...]:
        """Write the frames of a sample."""
        found = []
        for frame in sample.frames:
            key = f"{sample.id}_{frame.number:05d}"
            for ending, data in self._members(sample, frame):
                info = tarfile.TarInfo(f"{key}{ending}")
                info.size = len(data)
                info.mode = 0o644
                self._tar.addfile(info, io.BytesIO(data))
            found.append(FramePlace(self._inner, key))
        return tuple(found)

    def _members(self, sample: Sample, frame: SampleFrame) -> Iterator[tuple[str, bytes]]:
        if frame.image is not None:
            yield self._pictures.suffix, encoded(frame.image, self._pictures)
        for name, array in frame.arrays.items():
            stream = io.BytesIO()
            np.save(stream, array)
            yield f".{name}.npy", stream.getvalue()
        known: dict[str, Value] = {
            "id": sample.id,
            "sample": sample.number,
            "seed": sample.seed,
            "split": sample.split,
            "frame": frame.number,
            "time_s": frame.time_s,
            **sample.draws,
            **frame.labels,
        }
        # JSON has no NaN.
        plain = {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in known.items()}
        yield ".json", json.dumps(plain, ensure_ascii=False).encode()

    def finish(self) -> None:
        """Write the end of the file."""
        self._tar.close()

    def abandon(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):
            self._tar.close()


class WebDataSet:
    """Tar files that are read from the first byte to the last."""

    def require(self, pictures: Pictures) -> None:
        """Refuse videos. Raises DataSetError."""
        require_stills(pictures, "webdataset")

    def writer(self, folder: Path, shard: Shard, about: Mapping[str, Any]) -> TarWriter:
        """Begin a shard."""
        return TarWriter(folder, shard)

    def complete(
        self, folder: Path, dataset: Path, shards: Sequence[Shard], about: Mapping[str, Any]
    ) -> None:
        """Nothing describes the whole data set but its index."""

    def problem(self, file: Path) -> str:
        """Why a tar file cannot be read; empty where it can."""
        try:
            with tarfile.open(file) as tar:
                for member in tar:
                    stream = tar.extractfile(member)
                    _try(member.name, b"" if stream is None else stream.read())
        except (OSError, ValueError, EOFError, tarfile.TarError) as error:
            return str(error)
        return ""

    def renumbered(self, file: str, number: int) -> str:
        """Path of a file of a shard that has another number."""
        return re.sub(r"shard-[0-9]+", f"shard-{number:05d}", file)


def _try(name: str, data: bytes) -> None:
    if name.endswith(".npy"):
        np.load(io.BytesIO(data), allow_pickle=False)
    elif name.endswith(".json"):
        json.loads(data)
    else:
        decoded(data)


FORMAT = WebDataSet()
