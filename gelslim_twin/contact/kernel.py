"""Compiled sweeps of block Gauss-Seidel over the nodes in reach. Import only where they run."""

from __future__ import annotations

from typing import Any

from numba import njit

FREE, STICK, SLIP = 0, 1, 2


@njit(cache=True)
def sweep(
    compliance: Any,
    inverse: Any,
    height: Any,
    lateral: Any,
    friction: float,
    f: Any,
    u: Any,
    touch: Any,
) -> float:
    """One sweep over n nodes, in place; returns the largest change of a force component.

    compliance (3n, 3n), inverse (n, 3, 3) of its diagonal blocks, height (n,) of the tool over
    the rest surface, lateral (n, 2) where a sticking node would be; f and u (3n,) forces and
    motion, touch (n,). A node is free, sticks, or slips on the cone |f_t| = friction |f_z|, along
    the force that would hold it. Without friction only the normal component counts.
    """
    n = len(height)
    largest = 0.0
    for k in range(n):
        a = 3 * k
        rx = lateral[k, 0] - u[a]
        ry = lateral[k, 1] - u[a + 1]
        rz = height[k] - u[a + 2]
        for j in range(3):
            rx += compliance[a, a + j] * f[a + j]
            ry += compliance[a + 1, a + j] * f[a + j]
            rz += compliance[a + 2, a + j] * f[a + j]
        gx = gy = gz = 0.0
        state = FREE
        czz = compliance[a + 2, a + 2]
        if friction == 0.0:
            gz = rz / czz
            state = SLIP
        else:
            gx = inverse[k, 0, 0] * rx + inverse[k, 0, 1] * ry + inverse[k, 0, 2] * rz
            gy = inverse[k, 1, 0] * rx + inverse[k, 1, 1] * ry + inverse[k, 1, 2] * rz
            gz = inverse[k, 2, 0] * rx + inverse[k, 2, 1] * ry + inverse[k, 2, 2] * rz
            state = STICK
            size = (gx * gx + gy * gy) ** 0.5
            if gz < 0.0 and size > -friction * gz:
                dx, dy = gx / size, gy / size
                # f_t = friction |f_z| d and C_zz f_z + C_zt f_t = r_z.
                slope = czz - friction * (compliance[a + 2, a] * dx + compliance[a + 2, a + 1] * dy)
                gz = rz / slope if slope > 0.0 else rz / czz
                gx, gy = -friction * gz * dx, -friction * gz * dy
                state = SLIP
        if gz >= 0.0 or height[k] == float("inf"):
            gx = gy = gz = 0.0
            state = FREE
        ex, ey, ez = gx - f[a], gy - f[a + 1], gz - f[a + 2]
        touch[k] = state
        if ex == 0.0 and ey == 0.0 and ez == 0.0:
            continue
        f[a], f[a + 1], f[a + 2] = gx, gy, gz
        # C is symmetric: its rows stand for its columns and lie together in memory.
        for i in range(3 * n):
            u[i] += compliance[a, i] * ex + compliance[a + 1, i] * ey + compliance[a + 2, i] * ez
        change = max(abs(ex), abs(ey), abs(ez))
        if change > largest:
            largest = change
    return largest
