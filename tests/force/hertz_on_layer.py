"""Heights of a bonded layer under Hertz's pressure by a closed form, and its forces on nodes."""

from __future__ import annotations

import numpy as np
from bonded_layer import stiffness_factor
from numpy.typing import NDArray
from scipy.special import j0
from sensor_samples import sensor_bundle

from gelslim_force.joint.node_lattice import NodeLattice

Array = NDArray[np.float64]
RADIUS_MM, PRESSURE_MPA, PERIOD_MM, WAVES = 2.4, 0.02, 24.0, 240


def pressure(points_mm: Array) -> Array:
    """Hertz's pressure about the origin."""
    away = (points_mm**2).sum(axis=-1) / RADIUS_MM**2
    return np.asarray(PRESSURE_MPA * np.sqrt(np.maximum(1 - away, 0.0)))


def true_heights(points_mm: Array) -> Array:
    """Heights (n,) of an endless bonded layer by its closed form: Johnson, Contact Mechanics, 5.8.

    Hertz's pressure has the transform 2π p a² (sin t - t cos t) / t³ with t = k a.
    """
    gel, thickness = sensor_bundle().material, 2.0
    k = (np.arange(6000) + 0.5) * 0.02
    t = RADIUS_MM * k
    load = PRESSURE_MPA * RADIUS_MM**2 * (np.sin(t) - t * np.cos(t)) / t**3
    by_wave = 2 * (1 - gel.poissons_ratio**2) / gel.youngs_modulus_mpa
    by_wave = by_wave * stiffness_factor(k * thickness, gel.poissons_ratio) * load * 0.02
    return -np.asarray(j0(np.hypot(*points_mm.T)[:, None] * k) @ by_wave)


def nodal_forces(lattice: NodeLattice) -> Array:
    """(c, 3) ∫ N_j p by a fine midpoint rule."""
    parts = (np.arange(-20, 20) + 0.5) / 20
    at = lattice.origin_mm + lattice.place * lattice.step_mm
    force = np.zeros((len(at), 3))
    for u in parts:
        for v in parts:
            weight = (1 - abs(u)) * (1 - abs(v)) * np.prod(lattice.step_mm) / 20**2
            force[:, 2] -= weight * pressure(at + lattice.step_mm * [u, v])
    return force
