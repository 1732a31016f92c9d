"""What a worker needs to know of a data set, and the choice of frames."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from gelslim_twin.datasets.built_sensors import BuiltSensor, gel_ranges
from gelslim_twin.datasets.formats import DataSetError, Pictures
from gelslim_twin.datasets.splits import Division
from gelslim_twin.planning.plan import Plan
from gelslim_twin.scene.distribution import Range
from gelslim_twin.scene.draw import Drawn, drawn, drawn_number
from gelslim_twin.scene.reader import LoadedScene
from ifem_export.bundle.bundle import Bundle

FORMAT = "gelslim-dataset/1"
_EVERY = re.compile(r"every:([1-9][0-9]{0,5})\Z")


@dataclass(frozen=True)
class FrameChoice:
    """Which frames of a sample are kept.

    Attributes:
        every: Every how many frames from the first one on; 0 for the last frame alone.
    """

    every: int = 0

    @classmethod
    def parsed(cls, text: str) -> FrameChoice:
        """`last`, `all` or `every:K`.

        Raises:
            DataSetError: It is none of these.
        """
        if text in ("last", "all"):
            return cls(0 if text == "last" else 1)
        found = _EVERY.match(text)
        if found is None:
            raise DataSetError(f"frames {text!r}: write last, all, or every:K such as every:5")
        return cls(int(found.group(1)))

    def __str__(self) -> str:
        """As `parsed` reads it."""
        return {0: "last", 1: "all"}.get(self.every, f"every:{self.every}")

    def of(self, count: int) -> range:
        """Numbers of the frames that are kept of `count`."""
        return range(count - 1, count) if self.every == 0 else range(0, count, self.every)


@dataclass(frozen=True)
class DataSetJob:
    """A data set but for the number of its samples.

    Attributes:
        loaded: The scene.
        plan: Effects of all samples.
        sensor_folder: Folder of the stored sensor.
        sensor_key: Hash of the sensor.
        sensors: The built sensors.
        gel: Range of each quantity of the gel that is drawn.
        division: Splits.
        format: Name of the format.
        pictures: Encoding of the pictures.
        frames: Frames that are kept.
        frames_per_shard: Frames of a shard, at most, but at least one sample.
        out: Folder of the data set.
        over_tolerance: Where the effects may miss the tolerance, from `missed`.
    """

    loaded: LoadedScene
    plan: Plan
    sensor_folder: str
    sensor_key: str
    sensors: tuple[BuiltSensor, ...]
    gel: tuple[tuple[str, Range], ...]
    division: Division
    format: str
    pictures: Pictures
    frames: FrameChoice
    frames_per_shard: int
    out: str
    over_tolerance: Mapping[str, Mapping[str, Any]]

    @cached_property
    def key(self) -> str:
        """Hash of all that decides the content of a sample and its file."""
        loaded = self.loaded
        parts = (
            FORMAT,
            loaded.scene.model_dump_json(exclude={"look"}),
            repr(loaded.poses),
            repr(loaded.tools),
            "" if loaded.look is None else loaded.look.digest,
            self.plan.to_json(),
            self.sensor_key,
            repr((self.sensors, self.gel, self.division)),
            repr((self.format, self.pictures, str(self.frames), self.frames_per_shard)),
            *_digests_of_files(loaded),
        )
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    @property
    def out_folder(self) -> Path:
        """Folder of the data set."""
        return Path(self.out)

    def drawn(self, number: int) -> Drawn:
        """What sample `number` has."""
        return drawn(self.loaded.scene, number, len(self.loaded.tools), len(self.sensors))

    def drawn_tool(self, number: int) -> int:
        """Number of the tool of sample `number`, which is found without the rest."""
        return drawn_number(self.loaded.scene.seed, number, "tool", len(self.loaded.tools))

    def sample_id(self, number: int) -> str:
        """Name of a sample: that of the scene, its seed and the number."""
        name = re.sub(r"[^A-Za-z0-9_-]", "_", self.loaded.scene.name)
        return f"{name}-{self.loaded.scene.seed}-{number:07d}"


def gel_of(loaded: LoadedScene, bundle: Bundle) -> tuple[tuple[str, Range], ...]:
    """Ranges of the gel that are drawn, in order."""
    return tuple(sorted(gel_ranges(loaded.scene.vary.gel, bundle).items()))


def _digests_of_files(loaded: LoadedScene) -> list[str]:
    """Hashes of the files that the scene names: meshes and tables of poses."""
    scene = loaded.scene
    names = {
        *(getattr(one, "file", "") for tool in loaded.tools for one in tool.indenters),
        *(motion.csv or "" for motion in (scene.motion, *(scene.vary.motions or ()))),
    }
    return [
        hashlib.sha256((loaded.folder / name).read_bytes()).hexdigest()
        for name in sorted(names - {""})
    ]
