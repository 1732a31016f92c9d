"""Compiled block Gauss-Seidel with Coulomb's law solved exactly at every node.

At a node, with all other forces held, its force f and motion u = r0 + W f obey

    u_z <= h,  f_z <= 0,  f_z (u_z - h) = 0
    |f_t| <= μ |f_z|;  slip s = u_t - target is 0 inside the cone and opposed to f_t on it

which is one scalar equation where the node slips: with f_z eliminated, (A + a) f_t = b for some
a >= 0, and |f_t(a)| = μ |f_z(a)| changes sign between a = 0 (sticking) and infinity.
(Jourdan, Alart and Jean 1998 for the sweeps; Bonnefon and Daviet 2011 for the node's equation.)
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

FREE, STICK, SLIP = 0, 1, 2
MOST_HALVINGS = 60
CLOSE = 1e-13


@njit(cache=True)
def node_force(w: Any, rx: float, ry: float, rz: float, friction: float) -> Any:
    """Force (fx, fy, fz) of one node and whether it is free, sticks or slips.

    w (3, 3) own compliance, (rx, ry, rz) from the motion without its force to where it would
    stick and to the tool's height.
    """
    if not rz < 0.0:
        return 0.0, 0.0, 0.0, FREE
    wzz = w[2, 2]
    if friction == 0.0:
        return 0.0, 0.0, rz / wzz, SLIP
    cx, cy = w[0, 2] / wzz, w[1, 2] / wzz
    axx, axy = w[0, 0] - cx * w[0, 2], w[0, 1] - cx * w[1, 2]
    ayy = w[1, 1] - cy * w[1, 2]
    bx, by = rx - cx * rz, ry - cy * rz
    low, fx, fy = 0.0, 0.0, 0.0
    # The larger eigenvalue of A is at most its trace: a unit for the search.
    high, size = -1.0, axx + ayy
    a = 0.0
    for step in range(MOST_HALVINGS):
        pxx, pyy = axx + a, ayy + a
        det = pxx * pyy - axy * axy
        fx, fy = (pyy * bx - axy * by) / det, (pxx * by - axy * bx) / det
        fz = rz / wzz - cx * fx - cy * fy
        tangential = math.sqrt(fx * fx + fy * fy)
        excess = tangential + friction * fz
        if step == 0 and excess <= 0.0:
            return fx, fy, fz, STICK
        if abs(excess) <= CLOSE * tangential:
            break
        if excess > 0.0:
            low = a
        else:
            high = a
        # Newton's step, kept between the bounds.
        gx, gy = -(pyy * fx - axy * fy) / det, -(pxx * fy - axy * fx) / det
        slope = (fx * gx + fy * gy) / tangential - friction * (cx * gx + cy * gy)
        ahead = a - excess / slope if slope < 0.0 else -1.0
        if high < 0.0:
            a = ahead if ahead > low else 2.0 * a + size
            a = min(a, 16.0 * (low + size))
        elif low < ahead < high:
            a = ahead
        else:
            a = 0.5 * (low + high)
        if high >= 0.0 and high - low <= CLOSE * high:
            break
    # Exactly on the cone, whatever the search left.
    tangential = math.sqrt(fx * fx + fy * fy)
    slope = wzz - friction * (w[0, 2] * fx + w[1, 2] * fy) / tangential
    fz = rz / slope if slope > 0.0 else rz / wzz - cx * fx - cy * fy
    scale = -friction * fz / tangential
    return fx * scale, fy * scale, fz, SLIP


@njit(cache=True)
def own_compliance(compliance: Any, frames: Any, own: Any) -> None:
    """own (n, 3, 3): the compliance of each node in its frame, of compliance (3n, 3n).

    frames (n, 3, 3) have the axes of a node in their columns.
    """
    for k in range(len(own)):
        q = frames[k]
        for p in range(3):
            for r in range(3):
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += q[a, p] * compliance[3 * k + a, 3 * k + b] * q[b, r]
                own[k, p, r] = total


@njit(cache=True)
def _wanted(
    k: int, own: Any, frames: Any, height: Any, target: Any, friction: Any, f: Any, u: Any
) -> Any:
    """Force along x, y, z that node k takes if the others keep theirs, and its touch."""
    a, q, w = 3 * k, frames[k], own[k]
    # Forces and motion so far in the node's frame.
    f0 = q[0, 0] * f[a] + q[1, 0] * f[a + 1] + q[2, 0] * f[a + 2]
    f1 = q[0, 1] * f[a] + q[1, 1] * f[a + 1] + q[2, 1] * f[a + 2]
    f2 = q[0, 2] * f[a] + q[1, 2] * f[a + 1] + q[2, 2] * f[a + 2]
    u0 = q[0, 0] * u[a] + q[1, 0] * u[a + 1] + q[2, 0] * u[a + 2]
    u1 = q[0, 1] * u[a] + q[1, 1] * u[a + 1] + q[2, 1] * u[a + 2]
    u2 = q[0, 2] * u[a] + q[1, 2] * u[a + 1] + q[2, 2] * u[a + 2]
    r0 = target[k, 0] - u0 + w[0, 0] * f0 + w[0, 1] * f1 + w[0, 2] * f2
    r1 = target[k, 1] - u1 + w[1, 0] * f0 + w[1, 1] * f1 + w[1, 2] * f2
    r2 = height[k] - u2 + w[2, 0] * f0 + w[2, 1] * f1 + w[2, 2] * f2
    g0, g1, g2, state = node_force(w, r0, r1, r2, friction[k])
    gx = q[0, 0] * g0 + q[0, 1] * g1 + q[0, 2] * g2
    gy = q[1, 0] * g0 + q[1, 1] * g1 + q[1, 2] * g2
    gz = q[2, 0] * g0 + q[2, 1] * g1 + q[2, 2] * g2
    return gx, gy, gz, state


@njit(cache=True)
def sweep(
    compliance: Any,
    own: Any,
    frames: Any,
    height: Any,
    target: Any,
    friction: Any,
    relaxation: float,
    backwards: bool,
    f: Any,
    u: Any,
    touch: Any,
) -> float:
    """One sweep over n nodes, in place; returns |change of f| (root of the sum of squares).

    compliance (3n, 3n); frames (n, 3, 3) with the two tangents and the normal of each node in
    columns, own (n, 3, 3) each node's compliance in its frame; height (n,) the most it may move
    along its normal, target (n, 2) where it would stick along its tangents; friction (n,)
    coefficient of each node; f and u (3n,) forces and motion along x, y, z; touch (n,).
    `relaxation` is the share of each node's change that is made.
    """
    n = len(height)
    total = 0.0
    for number in range(n):
        k = n - 1 - number if backwards else number
        a = 3 * k
        gx, gy, gz, state = _wanted(k, own, frames, height, target, friction, f, u)
        touch[k] = state
        ex = relaxation * (gx - f[a])
        ey = relaxation * (gy - f[a + 1])
        ez = relaxation * (gz - f[a + 2])
        if ex == 0.0 and ey == 0.0 and ez == 0.0:
            continue
        if relaxation == 1.0:
            f[a], f[a + 1], f[a + 2] = gx, gy, gz
        else:
            f[a], f[a + 1], f[a + 2] = f[a] + ex, f[a + 1] + ey, f[a + 2] + ez
        # C is symmetric: its rows stand for its columns and lie together in memory.
        for i in range(3 * n):
            u[i] += compliance[a, i] * ex + compliance[a + 1, i] * ey + compliance[a + 2, i] * ez
        total += ex * ex + ey * ey + ez * ez
    return math.sqrt(total)


@njit(cache=True)
def sweeps(
    compliance: Any,
    own: Any,
    frames: Any,
    height: Any,
    target: Any,
    friction: Any,
    relaxation: float,
    turn: int,
    most: int,
    tolerance: float,
    least_rate: float,
    changes: Any,
    f: Any,
    u: Any,
    touch: Any,
) -> Any:
    """Sweeps, to and fro, until the forces seem to be near the solution.

    Arguments are those of `sweep` and:

        turn: number of the first sweep; those with an odd number go backwards.
        most: most sweeps.
        tolerance: error of the forces over the forces that counts as near.
        least_rate: least rate of convergence that is assumed.
        changes: (3,) of the forces in the last sweeps, the latest last; kept up to date.

    Returns the number of sweeps, and whether the remainder of a geometric series of the last
    changes is within the tolerance.
    """
    for number in range(most):
        change = sweep(
            compliance, own, frames, height, target, friction, relaxation,
            (turn + number) % 2 == 1, f, u, touch,
        )  # fmt: skip
        changes[0], changes[1], changes[2] = changes[1], changes[2], change
        rate = least_rate
        if 0.0 < changes[0] < math.inf:
            rate = max(rate, math.sqrt(change / changes[0]))
        if rate >= 1.0:
            continue
        size = 0.0
        for value in f:
            size += value * value
        if change * rate / (1.0 - rate) / relaxation <= tolerance * math.sqrt(size):
            return number + 1, True
    return most, False


@njit(cache=True)
def answers(
    own: Any,
    frames: Any,
    height: Any,
    target: Any,
    friction: Any,
    f: Any,
    u: Any,
    g: Any,
    touch: Any,
) -> None:
    """Force g (3n,) that each node would take if the others kept f: g = f at the solution."""
    for k in range(len(height)):
        a = 3 * k
        g[a], g[a + 1], g[a + 2], touch[k] = _wanted(k, own, frames, height, target, friction, f, u)


@njit(cache=True)
def motion(compliance: Any, f: Any, u: Any) -> None:
    """u (3n,) += C f, by the rows of nodes with a force: C is symmetric."""
    for k in range(len(f) // 3):
        a = 3 * k
        x, y, z = f[a], f[a + 1], f[a + 2]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        for i in range(len(f)):
            u[i] += compliance[a, i] * x + compliance[a + 1, i] * y + compliance[a + 2, i] * z
