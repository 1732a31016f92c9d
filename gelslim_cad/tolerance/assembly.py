"""Setting a finger while it is assembled: as its parts fall, or by the live picture."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.tolerance.built import (
    Array,
    Built,
    Errors,
    Setting,
    as_dropped_in,
    built,
    reach_deg,
)
from gelslim_cad.tolerance.causes import no_errors
from gelslim_cad.tolerance.picture import Rays, image_distances_mm, on_sensor, rays

Stage = Literal["as_built", "adjusted"]
STAGES: tuple[Stage, ...] = ("as_built", "adjusted")
TURNS = 3
"""Repetitions of looking and turning; each leaves less than a tenth of the offset."""
TILT_STEP_DEG = 0.1
FREE = 0.05
"""Part of the half picture left free on every side of the gel, where it is not as full."""


def border_points(d: Lookup, e: Errors) -> tuple[Array, Array]:
    """Points x and y (n, 6) of the built gel's border: middle and corners of near and far edge."""
    part = (1 - e["shrinkage_percent"] / 100)[:, None]
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    ends, sides = np.repeat([-x, x], 3), np.tile([0.0, -y, y], 2)
    return part * ends + e["gel_x_mm"][:, None], part * sides + e["gel_y_mm"][:, None]


def assembled(d: Lookup, e: Errors, stage: Stage) -> Built:
    """The n fingers with errors `e` (n,), set in the way of `stage`.

    `as_built`: the camera is glued as it falls into its clamp, the lens is set with the jig.
    `adjusted`: the camera is turned within its play until the gel's picture is upright and in its
    frame, and the lens until nearest and farthest image are equally sharp. The frame is where the
    design has the gel, moved towards the middle where less than `FREE` would be left beside it.
    What remains are the causes `alignment` and `lens focus`, and what the play does not reach.
    """
    setting = as_dropped_in(d, e)
    finger = built(d, e, setting)
    if stage == "as_built":
        return finger
    aim, turn = frame_mm(d), _degrees_per_offset(d)
    largest = reach_deg(d)
    wanted = d["view.pixel_pitch_mm"] * np.stack(
        [e["align_u_px"], e["align_v_px"], e["align_roll_px"]], axis=1
    )
    for _ in range(TURNS):
        ray = rays(finger, *border_points(d, e))
        off = _offsets_mm(finger, ray, aim) - wanted
        tilt = np.stack([setting.pitch_deg, setting.yaw_deg, setting.roll_deg], axis=1)
        tilt = np.clip(tilt - off @ turn.T, -largest, largest)
        sagittal, tangential = image_distances_mm(finger, ray)
        least, most = tangential.min(axis=1), sagittal.max(axis=1)
        focus = 2 * least * most / (least + most)
        setting = Setting(tilt[:, 0], tilt[:, 1], tilt[:, 2], focus)
        finger = built(d, e, setting)
    return finger


def frame_mm(d: Lookup) -> tuple[float, float]:
    """Where on the sensor (u, v) the middle of the gel's picture belongs."""
    none = no_errors(d)
    finger = built(d, none, as_dropped_in(d, none))
    seen = on_sensor(finger, rays(finger, *border_points(d, none)))
    middles = []
    sides = (d["view.sensor_across_mm"], d["view.sensor_along_mm"])
    for place, side in zip(seen, sides, strict=True):
        half = side / 2
        low, high = half + float(place.min()), half - float(place.max())
        towards = min(max(FREE * half - min(low, high), 0.0), abs(high - low) / 2)
        middles.append((low - high) / 2 + (towards if low < high else -towards))
    return middles[0], middles[1]


def _offsets_mm(finger: Built, ray: Rays, aim_mm: tuple[float, float]) -> Array:
    """How far (n, 3) the gel's picture is right and below its frame, and its far edge slopes."""
    u, v = on_sensor(finger, ray)
    middles = [(w.max(axis=1) + w.min(axis=1)) / 2 for w in (u, v)]
    # Points 4 and 5 are the ends of the far edge, which is level in the picture of the design.
    return np.stack([middles[0] - aim_mm[0], middles[1] - aim_mm[1], v[:, 5] - v[:, 4]], axis=1)


def _degrees_per_offset(d: Lookup) -> Array:
    """Tilts (3, 3) of the camera in its clamp that shift and turn the picture by 1 mm."""
    none = no_errors(d, 3)
    tilts = TILT_STEP_DEG * np.eye(3)
    focus = as_dropped_in(d, none).focus_mm
    ends = []
    for sign in (1, -1):
        finger = built(d, none, Setting(sign * tilts[0], sign * tilts[1], sign * tilts[2], focus))
        ends.append(_offsets_mm(finger, rays(finger, *border_points(d, none)), (0.0, 0.0)))
    return np.asarray(np.linalg.inv((ends[0] - ends[1]).T / (2 * TILT_STEP_DEG)))
