"""Compiled prediction of a marker's position from the motion of its neighbours.

Import it only where it runs, because it loads numba. Arrays as in `matching_kernel`. An affine
motion needs few neighbours and extrapolates safely; near a contact the motion changes so fast
that only a quadratic one follows it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from gelslim_force.detection.darkness_kernel import COMPILED

FOR_QUADRATIC = 12
"""Least number of neighbours for a quadratic motion, which has 6 coefficients per axis."""
_PIVOT = 1e-3


@njit(**COMPILED)
def local_affine(i: Any, reference: Any, near: Any, points: Any, match: Any, trusted: Any) -> Any:
    """Return where the affine motion of its trusted neighbours puts marker i, and their number.

    The number is 0 if they are fewer than 3 or on one line.
    """
    n = 0
    su = sv = suu = suv = svv = sx = sy = sux = svx = suy = svy = total = 0.0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j < 0 or not trusted[j]:
            continue
        u = reference[j, 0] - reference[i, 0]
        v = reference[j, 1] - reference[i, 1]
        dx = points[match[j], 0] - reference[j, 0]
        dy = points[match[j], 1] - reference[j, 1]
        w = 1.0 / (u * u + v * v)
        n += 1
        total += w
        su += w * u
        sv += w * v
        suu += w * u * u
        suv += w * u * v
        svv += w * v * v
        sx += w * dx
        sy += w * dy
        sux += w * u * dx
        svx += w * v * dx
        suy += w * u * dy
        svy += w * v * dy
    if n < 3:
        return 0.0, 0.0, 0
    mu, mv, mx, my = su / total, sv / total, sx / total, sy / total
    auu, auv, avv = suu / total - mu * mu, suv / total - mu * mv, svv / total - mv * mv
    det = auu * avv - auv * auv
    if det <= 0.05 * auu * avv or auu <= 0 or avv <= 0:
        return 0.0, 0.0, 0
    bux, bvx = sux / total - mu * mx, svx / total - mv * mx
    buy, bvy = suy / total - mu * my, svy / total - mv * my
    x = mx - (mu * (bux * avv - bvx * auv) + mv * (bvx * auu - bux * auv)) / det
    y = my - (mu * (buy * avv - bvy * auv) + mv * (bvy * auu - buy * auv)) / det
    return reference[i, 0] + x, reference[i, 1] + y, n


@njit(**COMPILED)
def local_quadratic(
    i: Any, reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any
) -> Any:
    """Return where the quadratic motion of its trusted neighbours puts marker i, and their number.

    The number is 0 if they are too few, or too near to one conic, for six coefficients.
    """
    normal = np.zeros((6, 8))
    row = np.empty(8)
    n = 0
    for k in range(near.shape[1]):
        j = near[i, k]
        if j < 0 or not trusted[j]:
            continue
        u = (reference[j, 0] - reference[i, 0]) / pitch[i]
        v = (reference[j, 1] - reference[i, 1]) / pitch[i]
        w = 1.0 / (u * u + v * v)
        row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, u, v, u * u, u * v, v * v
        row[6] = points[match[j], 0] - reference[j, 0]
        row[7] = points[match[j], 1] - reference[j, 1]
        for a in range(6):
            for b in range(a, 8):
                normal[a, b] += w * row[a] * row[b]
        n += 1
    if n < FOR_QUADRATIC:
        return 0.0, 0.0, 0
    # Elimination from the last unknown upwards: the first one is the motion at the marker itself.
    for a in range(6):
        for b in range(a):
            normal[a, b] = normal[b, a]
    for a in range(5, 0, -1):
        pivot = normal[a, a]
        if pivot < _PIVOT * n:
            return 0.0, 0.0, 0
        for b in range(a):
            share = normal[b, a] / pivot
            for c in range(a):
                normal[b, c] -= share * normal[a, c]
            normal[b, 6] -= share * normal[a, 6]
            normal[b, 7] -= share * normal[a, 7]
    if normal[0, 0] < _PIVOT * n:
        return 0.0, 0.0, 0
    return (
        reference[i, 0] + normal[0, 6] / normal[0, 0],
        reference[i, 1] + normal[0, 7] / normal[0, 0],
        n,
    )


@njit(**COMPILED)
def local_position(
    i: Any, reference: Any, near: Any, pitch: Any, points: Any, match: Any, trusted: Any
) -> Any:
    """Return where the motion of its trusted neighbours puts marker i, and their number or 0."""
    x, y, n = local_quadratic(i, reference, near, pitch, points, match, trusted)
    if n > 0:
        return x, y, n
    return local_affine(i, reference, near, points, match, trusted)
