"""The result of a frame as arrays of fixed types, and back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.record import plain
from gelslim_force.forces.wrench import Wrench
from gelslim_force.tracking.tracks import Tracks

Precision = Literal["float32", "float64"]
"""Precision of positions, displacements and forces; times and wrenches are always float64."""
PER_MARKER = ("places_px", "displacement_px", "status", "dots", "marker_displacement_mm")
PER_NODE = ("displacement_mm", "force_n", "traction_mpa", "contact")
_NO_NODES = np.zeros((0, 3))
NO_FIELD = ForceField(
    _NO_NODES, _NO_NODES, _NO_NODES, _NO_NODES, np.zeros(0, np.bool_), np.full(2, np.nan),
    slip_margin=math.nan, misfit=math.nan,
)  # fmt: skip
"""What stands for the field of a frame that has none; `NO_WRENCH` for its wrench."""
NO_WRENCH = Wrench(np.full(3, np.nan), np.full(3, np.nan), np.full((6, 6), np.nan))


@dataclass(frozen=True, eq=False)
class PackedFrame:
    """A frame with m markers and c nodes; m or c is 0 if it has none."""

    arrays: Mapping[str, NDArray[Any]]
    """By name: those of `PER_MARKER` and `PER_NODE`, and others such as `index` and `wrench`."""
    points_mm: NDArray[np.float64] | None
    """(c, 3) nodes at rest; None without a field."""
    problems: tuple[str, ...]
    extra: str
    """A JSON object."""

    @property
    def markers(self) -> int:
        """m."""
        return len(self.arrays["places_px"])

    @property
    def nodes(self) -> int:
        """c."""
        return len(self.arrays["force_n"])


def pack(result: FrameResult, precision: Precision) -> PackedFrame:
    """Copy a result into arrays; missing arrays have length 0 and missing numbers are NaN."""
    real = np.dtype(precision)
    field, wrench = result.field or NO_FIELD, result.wrench or NO_WRENCH
    motion = result.marker_displacement_mm
    count = 0 if motion is None else len(motion)
    tracks = _no_tracks(count) if result.tracks is None else result.tracks
    if motion is None:
        motion = np.full((len(tracks), 3), np.nan)
    arrays: dict[str, NDArray[Any]] = {
        "index": np.array(result.index, np.int64),
        "time_s": np.array(result.time_s, np.float64),
        "stamp_s": np.array(_or_nan(result.stamp_s), np.float64),
        "sensor_s": np.array(_or_nan(result.sensor_s), np.float64),
        "normal_known": np.array(result.normal_known, np.bool_),
        "has_tracks": np.array(result.tracks is not None),
        "has_marker_displacement": np.array(result.marker_displacement_mm is not None),
        "has_field": np.array(result.field is not None),
        "has_wrench": np.array(result.wrench is not None),
        "places_px": np.array(tracks.positions_px, real),
        "displacement_px": np.array(tracks.displacement_px, real),
        "status": np.array(tracks.status, np.int8),
        "dots": np.array(tracks.dots, np.int32),
        "marker_displacement_mm": np.array(motion, real),
        "displacement_mm": np.array(field.displacement_mm, real),
        "force_n": np.array(field.force_n, real),
        "traction_mpa": np.array(field.traction_mpa, real),
        "contact": np.array(field.contact, np.bool_),
        "centre_of_pressure_mm": np.array(field.centre_of_pressure_mm, np.float64),
        "slip_margin": np.array(field.slip_margin, np.float64),
        "misfit": np.array(field.misfit, np.float64),
        "wrench": np.array(wrench.vector, np.float64),
        "wrench_covariance": np.array(wrench.covariance, np.float64),
    }
    points = None if result.field is None else np.array(field.points_mm, dtype=np.float64)
    extra = json.dumps({str(key): plain(value) for key, value in result.extra.items()})
    return PackedFrame(arrays, points, tuple(result.problems), extra)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _no_tracks(markers: int) -> Tracks:
    unknown, nothing = np.full((markers, 2), np.nan), np.full(markers, -1)
    return Tracks(unknown, unknown, nothing, nothing)


def unpack(
    arrays: Mapping[str, NDArray[Any]],
    points_mm: NDArray[np.float64] | None,
    problems: tuple[str, ...],
    extra: str,
    stage_ms: Mapping[str, float] | None = None,
) -> FrameResult:
    """Return the result of a packed frame, in its precision.

    Arrays of markers and nodes that the frame does not have may be of any length. Frames of the
    first version, which have no stamps, are read too.
    """

    def real(name: str) -> NDArray[np.float64]:
        return np.asarray(arrays[name], dtype=np.float64)

    def stamp(name: str) -> float | None:
        found = float(arrays.get(name, math.nan))
        return None if math.isnan(found) else found

    tracks = field = wrench = None
    if arrays["has_tracks"]:
        tracks = Tracks(
            real("places_px"),
            real("displacement_px"),
            np.asarray(arrays["status"], np.int64),
            np.asarray(arrays["dots"], np.int64),
        )
    if arrays["has_field"] and points_mm is not None:
        field = ForceField(
            points_mm=points_mm,
            displacement_mm=real("displacement_mm"),
            force_n=real("force_n"),
            traction_mpa=real("traction_mpa"),
            contact=np.asarray(arrays["contact"], np.bool_),
            centre_of_pressure_mm=real("centre_of_pressure_mm"),
            slip_margin=float(arrays["slip_margin"]),
            misfit=float(arrays["misfit"]),
        )
    if arrays["has_wrench"]:
        both = real("wrench")
        wrench = Wrench(both[:3], both[3:], real("wrench_covariance"))
    has_motion = bool(arrays["has_marker_displacement"])
    return FrameResult(
        index=int(arrays["index"]),
        time_s=float(arrays["time_s"]),
        tracks=tracks,
        marker_displacement_mm=real("marker_displacement_mm") if has_motion else None,
        field=field,
        wrench=wrench,
        normal_known=bool(arrays["normal_known"]),
        stage_ms=dict(stage_ms or {}),
        problems=problems,
        extra=json.loads(extra),
        stamp_s=stamp("stamp_s"),
        sensor_s=stamp("sensor_s"),
    )
