"""How the images of dots move at the poses of a probe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.contact.corrected_contact import LinearStep
from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import rounded_up
from gelslim_twin.simulation.sensor import nodes_to_markers
from ifem_export.bundle.bundle import Bundle

DOTS_SAFETY, SMOOTH_DOTS_SAFETY = 3.3, 1.75
"""Factors on the speed of the images of dots between these poses, and for straight presses by tools
without walls. In 171 random scenes 3.0 was needed, where a wall lets go of the gel (seed 3209),
and 1.57 without walls."""


def moving_dots(
    c: Circumstances, bundle: Bundle, steps: Sequence[LinearStep]
) -> tuple[float, float]:
    """The largest displacement of the image of a dot, and the largest speed.

    Args:
        c: The circumstances of the scene.
        bundle: The sensor.
        steps: The poses of the probe.

    Returns:
        The displacement from rest in px, and the speed with its safety factor in mm/s: that of the
        image over the scale, since a camera hardly sees a dot that moves towards it. Both are
        infinite where the sensor has no dots. The speed is infinite too where walls slide: a dot
        jumps where one passes it, in a step that a probe may miss.
    """
    if bundle.markers is None:
        return math.inf, math.inf
    seen = _images_px(bundle, steps)
    away_px = max(_farthest(px, seen[0]) for px in seen)
    if c.has_sliding_walls:
        return rounded_up(away_px), math.inf
    speeds_px = [
        _farthest(px, before_px) / (other.pose.time_s - one.pose.time_s)
        for (one, before_px), (other, px) in pairwise(zip(steps, seen[1:], strict=True))
    ]
    smooth = c.motion.is_straight and not c.has_walls
    safety = SMOOTH_DOTS_SAFETY if smooth else DOTS_SAFETY
    fastest_px = max(speeds_px, default=0.0)
    return rounded_up(away_px), rounded_up(safety * fastest_px / c.sensor.px_per_mm)


def _images_px(bundle: Bundle, steps: Sequence[LinearStep]) -> list[NDArray[np.float64]]:
    """Images (m, 2) of the dots at rest and at each pose."""
    assert bundle.markers is not None
    to_markers = nodes_to_markers(bundle)
    heights = to_markers @ np.asarray(bundle.mesh.surface_mm)[:, 2]
    rest_mm = np.column_stack([bundle.markers.positions_mm, heights])
    camera = VirtualCamera.from_record(bundle.camera)
    moved_mm = (to_markers @ step.state.displacement_mm for step in steps)
    return [camera.project(rest_mm), *(camera.project(rest_mm + mm) for mm in moved_mm)]


def _farthest(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(one - other, axis=1).max(initial=0.0))
