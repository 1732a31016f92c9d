"""Ground truth of each frame: pose, wrench, fields and marker positions."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import resultant
from gelslim_twin.contact.gel_state import ContactStatus, GelState
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
COLUMNS = (
    "frame", "time_s", "x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg",
    "fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm", "sticking_nodes", "slipping_nodes",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class FrameTruth:
    """One frame."""

    number: int
    time_s: float
    pose: Pose
    """Tool at that time."""
    state: GelState
    markers_px: Array | None
    """(m, 2) images of the dots' centres, where markers are observed."""
    centroids_px: Array | None
    """(m, 2) centroids of the dots drawn, where a picture was."""
    drawn: NDArray[np.bool_] | None


def wrench_csv(frames: Sequence[FrameTruth], points_mm: Array) -> bytes:
    """A line per frame: tool pose, true wrench on the gel about the sensor origin, contact."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(COLUMNS)
    for frame in frames:
        force, torque = resultant(points_mm, frame.state.force_n)
        p, touch = frame.pose, frame.state.touch
        place = (p.x_mm, p.y_mm, p.depth_mm, p.twist_deg, p.tilt_x_deg, p.tilt_y_deg)
        numbers = [repr(float(v)) for v in (frame.time_s, *place, *force, *torque)]
        nodes = [int((touch == kind).sum()) for kind in (ContactStatus.STICK, ContactStatus.SLIP)]
        table.writerow([frame.number, *numbers, *nodes])
    return out.getvalue().encode()


def fields_npz(frames: Sequence[FrameTruth], points_mm: Array, observe: Sequence[str]) -> bytes:
    """Arrays over the frames: only what the scene observes.

    points_mm (c, 3), time_s (n,), displacement_mm (n, c, 3), force_n (n, c, 3), touch (n, c),
    markers_px (n, m, 2), centroids_px (n, m, 2), drawn (n, m).
    """
    held: dict[str, Array] = {
        "points_mm": points_mm,
        "time_s": np.array([f.time_s for f in frames]),
    }
    if "displacement" in observe:
        held["displacement_mm"] = np.stack([f.state.displacement_mm for f in frames])
    if "force" in observe:
        held["force_n"] = np.stack([f.state.force_n for f in frames])
        held["touch"] = np.stack([f.state.touch for f in frames])
    for name in ("markers_px", "centroids_px", "drawn"):
        values = [getattr(f, name) for f in frames]
        if all(v is not None for v in values):
            held[name] = np.stack(values)
    stream = io.BytesIO()
    np.savez(stream, **held)  # type: ignore[arg-type]
    return stream.getvalue()
