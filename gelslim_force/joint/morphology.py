"""Boolean pictures made wider and narrower by steps along rows and columns, and filled.

They are those of `scipy.ndimage` with its cross-shaped element and what lies outside false, by one
distance or one flood from the edge instead of a pass per step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def widened(picture: Mask, steps: int) -> Mask:
    """Places (rows, columns) up to `steps` away from a true one."""
    return np.asarray(_distance(picture, False) <= steps)


def narrowed(picture: Mask, steps: int) -> Mask:
    """True places (rows, columns) more than `steps` away from a false one, or from the outside."""
    return np.asarray(_distance(~picture, True) > steps)


def closed(picture: Mask, steps: int) -> Mask:
    """Without gaps up to twice `steps` wide; the outside does not narrow it at the edge."""
    edge = 2 * steps
    wide = np.zeros([n + 2 * edge for n in picture.shape], dtype=bool)
    inner = slice(edge, -edge)
    wide[inner, inner] = picture
    return narrowed(widened(wide, steps), steps)[inner, inner]


def opened(picture: Mask, steps: int) -> Mask:
    """Without specks up to twice `steps` wide."""
    return widened(narrowed(picture, steps), steps)


def filled(picture: Mask) -> Mask:
    """Without holes: what is false remains so where it is connected to the edge of the picture."""
    from gelslim_force.joint.kernels.region_kernel import fill_holes

    found = np.empty(picture.shape, dtype=bool)
    fill_holes(picture, found)
    return found


def _distance(picture: Mask, outside: bool) -> NDArray[np.int64]:
    from gelslim_force.joint.kernels.region_kernel import city_block

    distance = np.empty(picture.shape, dtype=np.int64)
    city_block(np.ascontiguousarray(picture), outside, distance)
    return distance
