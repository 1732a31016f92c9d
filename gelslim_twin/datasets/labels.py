"""What is true of a frame: its labels, one value per name, and its fields as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import resultant
from gelslim_twin.contact.gel_state import ContactStatus, GelState
from gelslim_twin.datasets.sample import Value
from gelslim_twin.scene.pose import Pose

Array = NDArray[np.float64]
MEANING: Mapping[str, str] = {
    "tool_x_mm": "position of the tool's lowest point, along the finger",
    "tool_y_mm": "the same across the finger",
    "tool_depth_mm": "depth of that point below the surface of the gel at rest",
    "tool_twist_deg": "turn of the tool about the normal of the gel",
    "tool_tilt_x_deg": "its tilt about x",
    "tool_tilt_y_deg": "its tilt about y",
    "fx_n": "force on the gel along the finger",
    "fy_n": "force on the gel across the finger",
    "fz_n": "force on the gel along its outward normal; negative where it is pressed",
    "tx_nmm": "torque on the gel about x through the middle of its surface at rest",
    "ty_nmm": "torque about y",
    "tz_nmm": "torque about z",
    "contact_nodes": "surface nodes in contact",
    "contact_area_mm2": "their number times the area of a cell",
    "contact_x_mm": "centre of the pressure, along the finger; NaN without contact",
    "contact_y_mm": "centre of the pressure, across the finger; NaN without contact",
    "contact_x_min_mm": "least x of a node in contact, displaced; NaN without contact",
    "contact_x_max_mm": "largest x",
    "contact_y_min_mm": "least y",
    "contact_y_max_mm": "largest y",
    "sticking_nodes": "nodes that stick to the tool",
    "slipping_nodes": "nodes that slip",
    "slip_state": "`none` without contact, `stick`, `partial` or `slip`",
    "indentation_mm": "largest depth of a node below its place at rest",
}
"""Every label and what it means, in the order of the table."""


def labels(pose: Pose, state: GelState, points_mm: Array, cell_mm2: float) -> dict[str, Value]:
    """The labels of one frame.

    Args:
        pose: Pose of the tool.
        state: State of the gel.
        points_mm: Surface nodes (c, 3) at rest.
        cell_mm2: Area of a cell of the surface.

    Returns:
        A value for each name of `MEANING`.
    """
    force, torque = resultant(points_mm, state.force_n)
    touched = state.touch != ContactStatus.FREE
    slipping = int((state.touch == ContactStatus.SLIP).sum())
    count = int(touched.sum())
    values: tuple[Value, ...] = (
        *(pose.x_mm, pose.y_mm, pose.depth_mm),
        *(pose.twist_deg, pose.tilt_x_deg, pose.tilt_y_deg),
        *map(float, (*force, *torque)),
        count,
        count * cell_mm2,
        *_region(points_mm + state.displacement_mm, state.force_n[:, 2], touched),
        count - slipping,
        slipping,
        _slip_state(count, slipping),
        -float(state.displacement_mm[:, 2].min(initial=0.0)),
    )
    # A zero has no sign, which would differ from another solver's.
    return {
        name: value + 0.0 if isinstance(value, float) else value
        for name, value in zip(MEANING, values, strict=True)
    }


def _region(
    places_mm: Array, normal_n: Array, touched: NDArray[np.bool_]
) -> tuple[float, float, float, float, float, float]:
    """Centre of pressure x, y, then the extremes of the nodes in contact."""
    if not touched.any():
        return (math.nan,) * 6
    x, y, pressed = places_mm[touched, 0], places_mm[touched, 1], -normal_n[touched]
    total = float(pressed.sum())
    weight = pressed / total if total > 0 else np.full(len(x), math.nan)
    return (
        *(float(weight @ x), float(weight @ y)),
        *(float(x.min()), float(x.max()), float(y.min()), float(y.max())),
    )


def _slip_state(count: int, slipping: int) -> str:
    if count == 0:
        return "none"
    return "stick" if slipping == 0 else "slip" if slipping == count else "partial"


def fields(
    state: GelState,
    observe: tuple[str, ...],
    markers_px: Array | None,
    drawn: NDArray[np.bool_] | None,
) -> dict[str, NDArray[Any]]:
    """The arrays of one frame, of what the scene observes.

    Args:
        state: State of the gel.
        observe: What the scene observes.
        markers_px: Images (m, 2) of the dots' centres, where markers are observed.
        drawn: Whether (m,) a dot is wholly in the picture, where there is one.
    """
    found: dict[str, NDArray[Any]] = {}
    if "displacement" in observe:
        found["displacement_mm"] = state.displacement_mm.astype(np.float32)
    if "force" in observe:
        found["force_n"] = state.force_n.astype(np.float32)
        found["contact"] = state.touch.astype(np.int8)
    if markers_px is not None:
        found["markers_px"] = markers_px.astype(np.float32)
        if drawn is not None:
            found["drawn"] = drawn
    return found
