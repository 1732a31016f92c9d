"""Setting a finger while it is assembled: as its parts fall, or by the live picture."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.tolerance.built import Array, Built, Errors, Setting, as_dropped_in, built, rocking
from gelslim_cad.tolerance.causes import no_errors
from gelslim_cad.tolerance.picture import image_distances_mm, on_sensor, rays

Stage = Literal["as_built", "adjusted"]
STAGES: tuple[Stage, ...] = ("as_built", "adjusted")
TURNS = 3
"""Repetitions of looking and turning; each leaves less than a twentieth of the offset."""
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
    aim = frame_mm(d)
    for _ in range(TURNS):
        setting = _adjusted(d, e, setting, finger, aim)
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


def _adjusted(
    d: Lookup, e: Errors, old: Setting, finger: Built, aim_mm: tuple[float, float]
) -> Setting:
    ray = rays(finger, *border_points(d, e))
    u, v = on_sensor(finger, ray)
    pixel = d["view.pixel_pitch_mm"]
    off_u = (u.max(axis=1) + u.min(axis=1)) / 2 - aim_mm[0] - pixel * e["align_u_px"]
    off_v = (v.max(axis=1) + v.min(axis=1)) / 2 - aim_mm[1] - pixel * e["align_v_px"]
    # An edge of the gel from -y to +y, which is level in the picture of the design.
    across_u, across_v = u[:, 5] - u[:, 4], v[:, 5] - v[:, 4]
    lean = (across_v - 2 * pixel * e["align_roll_px"]) / across_u
    largest = {name: c.spread for name, c in rocking(d).items()}

    def turned(name: str, angle_deg: Array, by_rad: Array) -> Array:
        return np.clip(angle_deg + np.degrees(by_rad), -largest[name], largest[name])

    sagittal, tangential = image_distances_mm(finger, ray)
    least, most = tangential.min(axis=1), sagittal.max(axis=1)
    return Setting(
        pitch_deg=turned("rock_pitch_deg", old.pitch_deg, off_v / finger.image_mm),
        yaw_deg=turned("rock_yaw_deg", old.yaw_deg, off_u / finger.image_mm),
        roll_deg=turned("rock_roll_deg", old.roll_deg, lean),
        focus_mm=2 * least * most / (least + most),
    )
