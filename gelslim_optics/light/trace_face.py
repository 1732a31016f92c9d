"""Compiled physics at one face: Fresnel's equations, random numbers, mirrors and coats, arrival.

Importing this module loads numba. Its functions are compiled into `trace_kernel`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from gelslim_optics.light.trace_crossing import COMPILED
from gelslim_optics.light.trace_geometry import ARRIVED, ELEVATION, SLOPE, SLOPE_ALONG

STEP = np.uint64(0x9E3779B97F4A7C15)
MIX_A = np.uint64(0xBF58476D1CE4E5B9)
MIX_B = np.uint64(0x94D049BB133111EB)
S11, S27, S30, S31 = np.uint64(11), np.uint64(27), np.uint64(30), np.uint64(31)
FOUR, ONE = np.uint64(4), np.uint64(1)


@njit(**COMPILED)
def scramble(z: Any) -> Any:
    """Finaliser of splitmix64 (Steele, Lea and Flood 2014)."""
    z = (z ^ (z >> S30)) * MIX_A
    z = (z ^ (z >> S27)) * MIX_B
    return z ^ (z >> S31)


@njit(**COMPILED)
def uniform(path: Any, bounce: Any, slot: Any) -> float:
    """Random number in [0, 1) for the key of a path, the bounce and the slot."""
    z = path + STEP * (FOUR * np.uint64(bounce) + np.uint64(slot) + ONE)
    return float(scramble(z) >> S11) * 2.0**-53


@njit(**COMPILED)
def fresnel(n1: float, n2: float, cosine: float) -> Any:
    """Reflectance of unpolarised light and cosine of refraction; (1, 0) in total reflection."""
    if n1 == n2:
        return 0.0, cosine
    ratio = n1 / n2
    square = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    if square <= 0.0:
        return 1.0, 0.0
    behind = math.sqrt(square)
    rs = (n1 * cosine - n2 * behind) / (n1 * cosine + n2 * behind)
    rp = (n1 * behind - n2 * cosine) / (n1 * behind + n2 * cosine)
    return 0.5 * (rs * rs + rp * rp), behind


@njit(**COMPILED)
def map_arrival(
    shape: Any,
    box: Any,
    e: int,
    ray: Any,
    w: float,
    cosine: float,
    ny: float,
    nz: float,
    sums: Any,
    heat: Any,
    fans: Any,
) -> None:
    """Add the flux w that reaches the mapped face at the position and direction of the ray."""
    x, y, z, dx, dy, dz = ray[0], ray[1], ray[2], ray[3], ray[4], ray[5]
    ay, az, by, bz = shape[e, 0], shape[e, 1], shape[e, 2], shape[e, 3]
    if shape[e, 7] == 0.0:
        ty, tz = by - ay, bz - az
        part = ((y - ay) * ty + (z - az) * tz) / (ty * ty + tz * tz)
    else:
        cy, cz = shape[e, 4], shape[e, 5]
        py, pz, qy, qz = ay - cy, az - cz, by - cy, bz - cz
        ry, rz = y - cy, z - cz
        sweep = abs(math.atan2(py * qz - pz * qy, py * qy + pz * qz))
        part = abs(math.atan2(py * rz - pz * ry, py * ry + pz * rz)) / sweep
    if ay > by:
        part = 1.0 - part
    nx, ns = heat.shape
    i = int(nx * (x - box[2]) / (box[3] - box[2]))
    j = int(ns * part)
    heat[min(max(i, 0), nx - 1), min(max(j, 0), ns - 1)] += w
    sums[ARRIVED] += w
    sums[ELEVATION] += w * math.asin(min(1.0, cosine))
    # Normal to the right of the face; y grows along (|nz|, -ny sign nz).
    up = -nz if nz < 0 else nz
    ty, tz = up, -ny if nz > 0 else ny
    across = dy * ty + dz * tz
    sums[SLOPE] -= w * across / max(cosine, 1e-12)
    sums[SLOPE_ALONG] -= w * dx / max(cosine, 1e-12)
    px, ps, turns, rises = fans.shape[0], fans.shape[1], fans.shape[2], fans.shape[3]
    i, j = int(px * (x - box[2]) / (box[3] - box[2])), int(ps * part)
    turn = int(turns * (0.5 + math.atan2(across, dx) / (2 * math.pi)))
    rise = int(rises * cosine)
    cell = fans[min(max(i, 0), px - 1), min(max(j, 0), ps - 1), turn % turns, min(rise, rises - 1)]
    cell[0] += w
    cell[1] += w * dx / max(cosine, 1e-12)
    cell[2] += w * across / max(cosine, 1e-12)


@njit(**COMPILED)
def turn_back(
    coats: Any, coat: int, ray: Any, path: Any, bounce: int, normal: Any, cosine: float
) -> float:
    """Reflect the ray at an opaque surface; returns the reflectance."""
    reflectance = coats[coat, 1]
    if reflectance == 0.0:
        return 0.0
    nx, ny, nz = normal
    if coats[coat, 2] > 0.0:
        deep2 = uniform(path, bounce, 1)
        turn = 2 * math.pi * uniform(path, bounce, 2)
        deep, wide = math.sqrt(deep2), math.sqrt(1.0 - deep2)
        a, b = wide * math.cos(turn), wide * math.sin(turn)
        # (tx, ty, tz) and (ux, uy, uz) span the face.
        if nx != 0.0:
            tx, ty, tz, ux, uy, uz = 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
        else:
            tx, ty, tz, ux, uy, uz = 1.0, 0.0, 0.0, 0.0, -nz, ny
        ray[3] = a * tx + b * ux - deep * nx
        ray[4] = a * ty + b * uy - deep * ny
        ray[5] = a * tz + b * uz - deep * nz
        return reflectance
    for i in range(3):
        ray[3 + i] -= 2 * cosine * normal[i]
    return reflectance
