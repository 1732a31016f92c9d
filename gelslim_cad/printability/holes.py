"""Round holes of a solid."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FULL_TURN = 0.95
"""Share of a turn from which faces on one axis count as a hole, and not as a rounded corner."""
DECIMALS = 4
Key = tuple[float, ...]


@dataclass(frozen=True)
class RoundHole:
    """A cylindrical hole, or one step of it: diameter and both ends of its axis, mm."""

    diameter_mm: float
    ends_mm: NDArray[np.float64]


def round_holes(solid: Any) -> tuple[RoundHole, ...]:
    """All round holes, the narrowest first; each step of a stepped hole is one.

    Args:
        solid: A `cadquery` solid.

    Returns:
        The cylindrical faces that look at their axis and go round it.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.TopAbs import TopAbs_Orientation

    turns: dict[Key, float] = defaultdict(float)
    for face in solid.Faces():
        adaptor = BRepAdaptor_Surface(face.wrapped)
        if adaptor.GetType() != GeomAbs_SurfaceType.GeomAbs_Cylinder:
            continue
        cylinder = adaptor.Cylinder()
        outwards = face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_FORWARD
        if outwards == cylinder.Direct():
            continue
        turn = abs(adaptor.LastUParameter() - adaptor.FirstUParameter()) / (2 * math.pi)
        turns[_key(cylinder, adaptor.FirstVParameter(), adaptor.LastVParameter())] += turn
    found = sorted(key for key, turn in turns.items() if turn > FULL_TURN)
    return tuple(RoundHole(2 * key[0], np.array(key[1:]).reshape(2, 3)) for key in found)


def _key(cylinder: Any, low: float, high: float) -> Key:
    """Radius and ends of a cylindrical face, the same for the pieces of one hole."""
    place, way = cylinder.Axis().Location(), cylinder.Axis().Direction()
    at, along = (np.array([p.X(), p.Y(), p.Z()]) for p in (place, way))
    ends = (np.round(at + v * along, DECIMALS) + 0.0 for v in (low, high))
    first, second = sorted(tuple(end.tolist()) for end in ends)
    return (round(cylinder.Radius(), DECIMALS), *first, *second)
