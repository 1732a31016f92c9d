"""The columns of a data set of LeRobot: those that it knows, and the tactile ones, which are ours.

Columns below `observation.` and `action` are what a policy of LeRobot takes. It has no settled
names for tactile data, so everything else stands below `tactile.`, which policies leave alone;
`TACTILE_SCHEMA` is its version, and a data set without any such column is valid too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.outputs.wrench_csv import AXES
from gelslim_twin.datasets.sample import Sample, SampleFrame, Value

TACTILE_SCHEMA = "gelslim-tactile/1"
PICTURE = "observation.images.tactile"
WRENCH, STATE, ACTION = "observation.wrench", "observation.state", "action"
POSE = (
    *("tool_x_mm", "tool_y_mm", "tool_depth_mm"),
    *("tool_twist_deg", "tool_tilt_x_deg", "tool_tilt_y_deg"),
)
"""Labels of a frame that make up the state: the pose of the tool."""
COUNTERS = ("timestamp", "frame_index", "episode_index", "index", "task_index")
"""Columns of every data set of LeRobot."""
RENUMBERED = ("episode_index", "index")
"""Those of them that change where a sample is missing."""


@dataclass(frozen=True)
class Feature:
    """A column as `meta/info.json` describes it.

    Attributes:
        dtype: Name of a type of NumPy, `string`, `image` or `video`.
        shape: Shape of one value; (1,) of a number.
        names: Names of the components, where there are any.
    """

    dtype: str
    shape: tuple[int, ...]
    names: tuple[str, ...] | None = None

    def record(self) -> dict[str, Any]:
        """The feature as JSON."""
        names = None if self.names is None else list(self.names)
        return {"dtype": self.dtype, "shape": list(self.shape), "names": names}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Feature:
        """Read what `record` gave."""
        names = record["names"]
        return cls(record["dtype"], tuple(record["shape"]), None if names is None else tuple(names))

    @property
    def visual(self) -> bool:
        """Whether the values are pictures."""
        return self.dtype in ("image", "video")


def counter_features() -> dict[str, Feature]:
    """The columns of every data set of LeRobot, which its loader adds to the others."""
    return {name: Feature("float32" if name == "timestamp" else "int64", (1,)) for name in COUNTERS}


def features_of(sample: Sample, *, video: bool) -> dict[str, Feature]:
    """The columns of a data set of which this is a sample, but for the counters and the picture."""
    features = {name: _feature(name, values) for name, values in columns_of(sample).items()}
    image = sample.frames[0].image
    if image is None:
        return features
    picture = Feature(
        "video" if video else "image", (*image.shape[:2], 3), ("height", "width", "channels")
    )
    return {PICTURE: picture, **features}


def columns_of(sample: Sample) -> dict[str, NDArray[Any]]:
    """Values (t, ...) of the t frames of a sample by column, but for the counters and the picture.

    The action of a frame is the pose of the next one, so a policy that follows it repeats the
    motion; the last frame keeps its own pose.
    """
    frames = sample.frames
    labels = frames[0].labels
    columns: dict[str, NDArray[Any]] = {}
    pose = [name for name in POSE if name in labels]
    if pose:
        state = _vectors(frames, pose)
        columns[STATE] = state
        columns[ACTION] = np.concatenate([state[1:], state[-1:]])
    if all(axis in labels for axis in AXES):
        columns[WRENCH] = _vectors(frames, AXES)
    columns["tactile.time_s"] = np.array([f.time_s for f in frames], dtype=np.float32)
    taken = {*pose, *(AXES if WRENCH in columns else ())}
    for name in labels:
        if name not in taken:
            columns[f"tactile.{name}"] = _scalars([f.labels[name] for f in frames])
    for name in frames[0].arrays:
        columns[f"tactile.{name}"] = np.stack([f.arrays[name] for f in frames])
    return columns


def pictures_of(sample: Sample) -> Iterator[NDArray[np.uint8]]:
    """The pictures (h, w, 3) of a sample; a grey one has three equal channels, as LeRobot wants."""
    for frame in sample.frames:
        if frame.image is not None:
            grey = frame.image.ndim == 2
            yield np.repeat(frame.image[..., None], 3, axis=2) if grey else frame.image


def _vectors(frames: tuple[SampleFrame, ...], names: Any) -> NDArray[np.float32]:
    return np.array([[f.labels[name] for name in names] for f in frames], dtype=np.float32)


def _scalars(values: list[Value]) -> NDArray[Any]:
    if any(isinstance(value, str) for value in values):
        return np.array([str(value) for value in values], dtype=object)
    if all(isinstance(value, int) for value in values):
        return np.array(values, dtype=np.int64)
    return np.array(values, dtype=np.float32)


def _feature(name: str, values: NDArray[Any]) -> Feature:
    if values.dtype == object:
        return Feature("string", (1,))
    names = {WRENCH: AXES, STATE: POSE, ACTION: POSE}.get(name)
    if names is not None and values.shape[1] != len(names):
        names = None
    return Feature(str(values.dtype), values.shape[1:] or (1,), names)
