"""The result of a frame as arrays of fixed types, and back."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.tracking.tracks import Tracks

Precision = Literal["float32", "float64"]
"""Precision of positions, displacements and forces; times and wrenches are always float64."""
PER_MARKER = ("places_px", "displacement_px", "status", "dots", "marker_displacement_mm")
PER_NODE = ("displacement_mm", "force_n", "traction_mpa", "contact")
_NO_FIELD = (math.nan, math.nan, math.nan, math.nan)


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
    tracks, field, wrench = result.tracks, result.field, result.wrench
    motion = result.marker_displacement_mm
    arrays: dict[str, NDArray[Any]] = {
        "index": np.array(result.index, dtype=np.int64),
        "time_s": np.array(result.time_s, dtype=np.float64),
        "normal_known": np.array(result.normal_known, dtype=np.bool_),
        "has_tracks": np.array(tracks is not None),
        "has_marker_displacement": np.array(motion is not None),
        "has_field": np.array(field is not None),
        "has_wrench": np.array(wrench is not None),
    }
    arrays |= _marker_arrays(tracks, motion, real)
    arrays |= _node_arrays(field, real)
    torque = np.full(6, np.nan) if wrench is None else wrench.vector
    covariance = np.full((6, 6), np.nan) if wrench is None else wrench.covariance
    arrays["wrench"] = np.array(torque, dtype=np.float64)
    arrays["wrench_covariance"] = np.array(covariance, dtype=np.float64)
    points = None if field is None else np.array(field.points_mm, dtype=np.float64)
    extra = json.dumps({str(key): plain(value) for key, value in result.extra.items()})
    return PackedFrame(arrays, points, tuple(result.problems), extra)


def _marker_arrays(
    tracks: Tracks | None, motion: NDArray[np.float64] | None, real: np.dtype[Any]
) -> dict[str, NDArray[Any]]:
    count = len(tracks) if tracks is not None else 0 if motion is None else len(motion)
    unknown = np.full((count, 3), np.nan)
    return {
        "places_px": np.array(unknown[:, :2] if tracks is None else tracks.positions_px, real),
        "displacement_px": np.array(
            unknown[:, :2] if tracks is None else tracks.displacement_px, real
        ),
        "status": np.array(np.full(count, -1) if tracks is None else tracks.status, np.int8),
        "dots": np.array(np.full(count, -1) if tracks is None else tracks.dots, np.int32),
        "marker_displacement_mm": np.array(unknown if motion is None else motion, real),
    }


def _node_arrays(field: ForceField | None, real: np.dtype[Any]) -> dict[str, NDArray[Any]]:
    none = np.zeros((0, 3))
    scalars = _NO_FIELD
    if field is not None:
        x, y = (float(value) for value in field.centre_of_pressure_mm)
        scalars = (x, y, float(field.slip_margin), float(field.misfit))
    return {
        "displacement_mm": np.array(none if field is None else field.displacement_mm, real),
        "force_n": np.array(none if field is None else field.force_n, real),
        "traction_mpa": np.array(none if field is None else field.traction_mpa, real),
        "contact": np.array(np.zeros(0) if field is None else field.contact, np.bool_),
        "centre_of_pressure_mm": np.array(scalars[:2], dtype=np.float64),
        "slip_margin": np.array(scalars[2], dtype=np.float64),
        "misfit": np.array(scalars[3], dtype=np.float64),
    }


def unpack(
    arrays: Mapping[str, NDArray[Any]],
    points_mm: NDArray[np.float64] | None,
    problems: tuple[str, ...],
    extra: str,
    stage_ms: Mapping[str, float] | None = None,
) -> FrameResult:
    """Return the result of a packed frame, in its precision.

    Arrays of markers and nodes that the frame does not have may be of any length.
    """

    def real(name: str) -> NDArray[np.float64]:
        return np.asarray(arrays[name], dtype=np.float64)

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
    )


def plain(value: Any) -> Any:
    """Return a value as JSON: arrays as lists, dataclasses as objects, other types as text.

    NaN and the infinities, which JSON does not have, become null, "inf" and "-inf".
    """
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [item.name for item in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    return str(value)
