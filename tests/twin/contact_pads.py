"""Small pads, their dense compliance, and the laws of contact written out."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
YOUNGS_MPA = 0.147


@cache
def small_pad(
    poisson: float = 0.49, cells: int = 12, layers: int = 3, size: float = 12.0, thick: float = 2.0
) -> Bundle:
    """A square pad of `cells` x `cells` x `layers`, centred."""
    pitch = size / cells
    mesh = PadMesh.from_occupancy(
        np.ones((cells, cells, layers), dtype=bool),
        (pitch, pitch, thick / layers),
        (-size / 2, -size / 2, -thick),
    )
    return build_bundle(mesh, Material(YOUNGS_MPA, poisson, 1000.0), "bbar", with_stiffness=False)


@cache
def dense_compliance(bundle: Bundle) -> Array:
    """C (3c, 3c) of the surface by a dense factor of the whole pad."""
    stiffness = bundle.stiffness_matrix.toarray()
    free = _unknowns(np.asarray(bundle.mesh.free))
    surface = np.searchsorted(free, _unknowns(np.asarray(bundle.mesh.surface)))
    loads = np.zeros((len(free), len(surface)))
    loads[surface, np.arange(len(surface))] = 1.0
    return np.asarray(cho_solve(cho_factor(stiffness[np.ix_(free, free)]), loads)[surface])


def _unknowns(nodes: NDArray[np.int32]) -> NDArray[np.int64]:
    return (3 * nodes.astype(np.int64)[:, None] + np.arange(3)).ravel()


def violations(
    compliance: Array, force: Array, height: Array, target: Array, friction: float
) -> dict[str, float]:
    """How far forces (n, 3) are from each law of contact, relative to force and depth.

    pull and penetration; force across a gap; beyond the cone; slip inside the cone; slip that
    is not opposed by the friction force, in degrees.
    """
    u = (compliance @ force.reshape(-1)).reshape(-1, 3)
    push, side = -force[:, 2], np.hypot(force[:, 0], force[:, 1])
    most, depth = max(push.max(initial=0.0), 1e-30), max(-height.min(initial=0.0), 1e-30)
    gap = height - u[:, 2]
    slip = u[:, :2] - target
    far = np.hypot(slip[:, 0], slip[:, 1])
    on = push > 1e-9 * most
    slides = on & (side > friction * push * (1 - 1e-4)) & (friction > 0)
    moving = slides & (far > 1e-3 * depth)
    against = -(force[:, :2] * slip).sum(axis=1)[moving] / (side * far)[moving]
    return {
        "pull": max(0.0, -push.min(initial=0.0)) / most,
        "penetration": max(0.0, -gap.min(initial=0.0)) / depth,
        "complementarity": np.abs(push * gap)[on].max(initial=0.0) / (most * depth),
        "cone": max(0.0, (side - friction * push).max(initial=0.0)) / most,
        "slip_inside": far[on & ~slides].max(initial=0.0) / depth if friction > 0 else 0.0,
        "angle_deg": float(np.degrees(np.arccos(np.clip(against, -1, 1))).max(initial=0.0)),
    }
