"""How large and how hard a contact is: estimates that err on the large side, in closed form."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

NONLINEAR_EXCESS = ((0.0, 0.0), (0.05, 0.02), (0.15, 0.08), (0.30, 0.21), (0.50, 0.47))
"""Neo-Hookean over linear force, less one, by indentation over thickness (measured, PHYSICS 5)."""


@dataclass(frozen=True)
class Footprint:
    """Of the undeformed shapes below the gel's surface, by depth."""

    area_mm2: Callable[[float], float]
    volume_mm3: Callable[[float], float]
    reach_mm: Callable[[float], float]
    """Largest distance from the tool's axis."""
    steepest: Callable[[float], float]
    """Largest slope; infinite for shapes with walls."""


@dataclass(frozen=True)
class Touch:
    """The deepest contact of a motion."""

    depth_mm: float
    indentation: float
    """Depth over thickness of the gel."""
    area_mm2: float
    radius_mm: float
    """Of the disc of the same area."""
    normal_n: float
    """Frictionless, linear gel."""
    stick_n: float
    """The same with full stick, which keeps an incompressible layer from squeezing out."""
    shear_n_per_mm: float
    """Tangential force per mm of sideways motion with full stick, G A / h and the border's part."""


def nonlinear_excess(indentation: float) -> float:
    """Share by which a linear gel under-reads the force: the table, straight beyond its end."""
    e = max(0.0, indentation)
    points = NONLINEAR_EXCESS
    for (e0, x0), (e1, x1) in itertools.pairwise(points):
        if e <= e1:
            return x0 + (x1 - x0) * (e - e0) / (e1 - e0)
    (e0, x0), (e1, x1) = points[-2:]
    # Beyond the table the excess grows faster than straight: double the last slope.
    return x1 + 2 * (x1 - x0) / (e1 - e0) * (e - e1)


def touch(
    footprint: Footprint,
    depth_mm: float,
    thickness_mm: float,
    youngs_modulus_mpa: float,
    poissons_ratio: float,
) -> Touch:
    """The contact at `depth_mm`, none for a depth of 0 or less.

    The normal force adds the half-space under a flat punch, 2 E* a δ (Boussinesq; δ the mean
    overlap V/A), which is all there is on a thick gel, to that of a thin bonded layer, which
    compresses, M V/h, and squeezes out sideways, 3 G V A / (8 π h³) (lubrication with a free
    upper face; four times as much where it sticks): the softer of the two governs, so they act
    in series. The gel around the contact is in the way of what is squeezed out, as if the radius
    were larger by 1.2 h, or 0.5 h where it sticks. These two are fitted to solved contacts
    (ν 0.32 to 0.495, radius over thickness 0.7 to 3): the sum is 1.0 to 1.9 times those.
    """
    d = max(0.0, depth_mm)
    area = footprint.area_mm2(d) if d > 0 else 0.0
    if area <= 0:
        return Touch(d, d / thickness_mm, 0.0, 0.0, 0.0, 0.0, 0.0)
    volume, h = footprint.volume_mm3(d), thickness_mm
    e, nu = youngs_modulus_mpa, poissons_ratio
    g = e / (2 * (1 + nu))
    confined = e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    a = math.sqrt(area / math.pi)
    half_space = 2 * e / (1 - nu * nu) * a * volume / area
    squeeze = 3 * g * volume * area / (8 * math.pi * h**3)

    def layer(stronger: float, further: float) -> float:
        out = stronger * squeeze * (1 + further * h / a) ** 4
        compress = confined * volume / h
        # A thin layer cannot be softer than in uniaxial stress, E V / h.
        return max(e * volume / h, compress * out / (compress + out))

    normal = 1.1 * half_space + layer(1.0, 1.2)
    return Touch(
        d,
        d / h,
        area,
        a,
        normal,
        max(normal, 1.1 * half_space + layer(4.0, 0.5)),
        g * area / h + 8 * g * a / (2 - nu),
    )
