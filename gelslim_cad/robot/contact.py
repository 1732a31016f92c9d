"""The gel as a contact of simulators of rigid bodies: stiffness, damping, friction.

A rigid simulator gives each contact point a spring. Here the springs of the points together have
the stiffness of the whole pad between the window, to which it is bonded, and a flat object, on
which friction holds it. A small object meets a softer gel: the twin and the bundle know that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.materials import GEL_FRICTION

LONGEST_STEP_S = 1e-3
STEPS_PER_TIME = 4.0
"""Time steps in 1 / √s, the time in which a contact settles: more than two are stable."""
TERMS = 400
"""Odd terms of the series along each side."""
IMPEDANCE = 0.95
"""Share of the contact's own dynamics in MuJoCo's mixture (solimp): the rest is the free motion."""
POINTS = 4
"""Contact points of a flat object, which share the stiffness."""
DAMPING_RATIO = 1.0
"""Critical. Assumed: soft silicone damps strongly, and a rigid model needs it to settle."""
TORSION_M = 3e-3
"""Friction against twist, as a length: two thirds of the radius of a small contact. Assumed."""


@dataclass(frozen=True)
class GelContact:
    """Contact of the gel.

    Attributes:
        friction: Coefficient of friction.
        stiffness_n_m: Normal stiffness of the whole pad.
        effective_kg: Mass that the damping and the form of MuJoCo are reckoned with.
    """

    friction: float
    stiffness_n_m: float
    effective_kg: float

    @property
    def torsion_m(self) -> float:
        """Coefficient of friction against twist: moment over normal force."""
        return self.friction * TORSION_M

    @property
    def damping_n_s_m(self) -> float:
        """Normal damping, 2 ζ √(K m)."""
        return 2 * DAMPING_RATIO * math.sqrt(self.stiffness_n_m * self.effective_kg)

    @property
    def solref(self) -> tuple[float, float]:
        """MuJoCo's direct form, (-stiffness, -damping) per contact point and unit of mass.

        With a constant impedance d, one point has the stiffness k = s / ((1 - d) w), where w is the
        inverse of the effective mass. The points together shall have K, so s = K (1 - d) w / n.
        The motion of a point then obeys a = -s r - c v, which is critically damped for c = 2 √s.
        """
        s = self.stiffness_n_m / POINTS * (1 - IMPEDANCE) / self.effective_kg
        return -s, -2 * DAMPING_RATIO * math.sqrt(s)

    @property
    def timestep_s(self) -> float:
        """Time step at which a simulation with these contacts is stable."""
        return min(LONGEST_STEP_S, 1 / (STEPS_PER_TIME * math.sqrt(-self.solref[0])))

    @property
    def solimp(self) -> tuple[float, float, float]:
        """MuJoCo's impedance, the same at every depth."""
        return IMPEDANCE, IMPEDANCE, 1e-3


def apparent_modulus_mpa(
    youngs_modulus_mpa: float,
    poissons_ratio: float,
    sides_mm: tuple[float, float],
    thickness_mm: float,
) -> float:
    """Modulus of a bonded rectangular layer under a flat plate that sticks to it.

    The layer cannot spread at its faces, so pressure builds up in it that is zero at its edges:
    ∇²p - κ² p = -κ² K ε with κ² = 12 G / (K t²). Its mean is a double Fourier series over the odd
    m and n. To it comes the modulus of free compression (the pressure method of Gent and Lindley,
    Proc. Inst. Mech. Eng. 173 (1959), with compressibility as in J. M. Kelly, Earthquake-Resistant
    Design with Rubber, 2nd ed., 1997).

    Args:
        youngs_modulus_mpa: Young's modulus E.
        poissons_ratio: Poisson's ratio ν.
        sides_mm: Sides of the rectangle.
        thickness_mm: Thickness t.

    Returns:
        Mean stress over mean strain, in MPa.
    """
    e, nu = youngs_modulus_mpa, poissons_ratio
    shear, bulk = e / (2 * (1 + nu)), e / (3 * (1 - 2 * nu))
    kappa2 = 12 * shear / (bulk * thickness_mm**2)
    odd = 2 * np.arange(TERMS) + 1.0
    a, b = sides_mm
    weight = (8 / (math.pi**2 * odd**2))[:, None] * (8 / (math.pi**2 * odd**2))
    waves = (math.pi * odd / a)[:, None] ** 2 + (math.pi * odd / b) ** 2
    return float(e + bulk * np.sum(weight * kappa2 / (kappa2 + waves)))


JAW_KG = 0.1
"""Mass of a jaw with its slide and share of the drive. Assumed."""


def gel_contact(d: Lookup, finger_kg: float) -> GelContact:
    """The contact of a finger's gel with the object that the spec wants gripped.

    Args:
        d: Dimensions of the finger.
        finger_kg: Mass of the finger, which moves with a jaw.

    Returns:
        The contact; its effective mass is that of MuJoCo for a finger and a jaw on one slide and an
        object that is free: the mean of the inverse inertia over the three directions.
    """
    gel = GelShape.of(d)
    mean_thickness = gel.volume_mm3 / gel.area_mm2
    modulus = apparent_modulus_mpa(
        d["material.gel.youngs_modulus_mpa"],
        d["material.gel.poissons_ratio"],
        (gel.length_mm, gel.width_mm),
        mean_thickness,
    )
    object_kg = max(d["design.mount.object_mass_g"], 1.0) * 1e-3
    return GelContact(
        GEL_FRICTION,
        modulus * gel.area_mm2 / mean_thickness * 1e3,
        1 / (1 / object_kg + 1 / (3 * (finger_kg + JAW_KG))),
    )
