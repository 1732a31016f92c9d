"""Directions and ways in words, as the finger lies on the bench with its gel upwards."""

from __future__ import annotations

import math

from gelslim_cad.assembly.order import Vector, Way

STRAIGHT_DEG = 1.0
"""Directions that are inclined by less count as parallel to an axis."""
_WORDS: tuple[tuple[Vector, str], ...] = (
    ((0.0, 0.0, -1.0), "down"),
    ((0.0, 0.0, 1.0), "up"),
    ((1.0, 0.0, 0.0), "towards the tip"),
    ((-1.0, 0.0, 0.0), "towards the gripper"),
    ((0.0, -1.0, 0.0), "to the left"),
    ((0.0, 1.0, 0.0), "to the right"),
)


def direction_in_words(direction: Vector) -> str:
    """A direction such as `down, tilted by 23° towards the gripper`."""
    shares = [
        (sum(a * b for a, b in zip(axis, direction, strict=True)), text) for axis, text in _WORDS
    ]
    shares.sort(key=lambda found: -found[0])
    along, main = shares[0]
    tilt = math.degrees(math.acos(min(1.0, along)))
    if tilt < STRAIGHT_DEG:
        return main
    return f"{main}, tilted by {tilt:.0f}° {shares[1][1]}"


def way_in_words(way: Way) -> str:
    """A way such as `up, then 12 mm towards the tip`."""
    words = [
        direction_in_words(leg.direction)
        if math.isinf(leg.length_mm)
        else f"{leg.length_mm:.0f} mm {direction_in_words(leg.direction)}"
        for leg in way
    ]
    return ", then ".join(words)
