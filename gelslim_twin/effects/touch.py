"""How large and how hard a contact is: estimates that err on the large side, in closed form."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

NONLINEAR_EXCESS = ((0.0, 0.0), (0.05, 0.02), (0.15, 0.08), (0.30, 0.21), (0.50, 0.47))
"""Neo-Hookean over linear force, less one, by indentation over thickness (measured, PHYSICS 5)."""


RIDGES = 1.25
"""Rings and bumps press up to 1.19 as hard as the disc of their area."""


@dataclass(frozen=True)
class Footprint:
    """Of the undeformed shapes below the gel's surface, by depth."""

    area_mm2: Callable[[float], float]
    volume_mm3: Callable[[float], float]
    reach_mm: Callable[[float], float]
    """Largest distance from the tool's axis."""
    steepest: Callable[[float], float]
    """Largest slope; infinite for shapes with walls."""
    width_mm: Callable[[float], float]
    """Across the narrowest shape."""


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
    squeezed: float
    """Share of the indentation that goes sideways, the rest compresses the gel."""
    squeezed_at_rim: float
    """The same where no gel lies around the contact: at the rim of the pad."""
    strain: float
    """Depth over thickness, or over the width of the narrowest shape if that is more."""

    @property
    def sideways_mm(self) -> float:
        """How far a frictionless surface moves aside at most.

        By 0.75 of the depth (0.73 at a wedge, measured); under wide tools by what is squeezed out
        past the rim: a d/(2 h) in the mean over the layer, half as much again at its face
        (lubrication with a free face), 1.2 times that in the middle of a square's sides, and as
        much again where the pad's rim cuts the contact (measured: 1.09 of that).
        """
        wide = self.squeezed_at_rim * self.radius_mm * self.indentation
        return 0.75 * max(self.depth_mm, 1.2 * 1.2 * wide)

    @property
    def nonlinear_excess(self) -> float:
        """Share by which a linear gel under-reads the force.

        The measured table, of a compressible gel under a ball; of what is squeezed out, the layer
        that gets thinner: d/h³ becomes the integral of 1/(h - d)³, ((1 - e)^-2 - 1)/(2 e) as much.
        """
        table, e = nonlinear_excess(self.strain), min(self.indentation, 0.8)
        thinner = ((1 - e) ** -2 - 1) / (2 * e) - 1 if e > 0 else 0.0
        return table + self.squeezed * max(0.0, thinner - table)


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
        return Touch(d, d / thickness_mm, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, d / thickness_mm)
    volume, h = footprint.volume_mm3(d), thickness_mm
    e, nu = youngs_modulus_mpa, poissons_ratio
    g = e / (2 * (1 + nu))
    confined = e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    a = math.sqrt(area / math.pi)
    half_space = 2 * e / (1 - nu * nu) * a * volume / area
    squeeze = 3 * g * volume * area / (8 * math.pi * h**3)

    compress = confined * volume / h

    def layer(stronger: float, further: float) -> float:
        out = stronger * squeeze * (1 + further * h / a) ** 4
        # A thin layer cannot be softer than in uniaxial stress, E V / h.
        return max(e * volume / h, compress * out / (compress + out))

    normal = 1.1 * half_space + layer(1.0, 1.2)
    free = squeeze * (1 + 1.2 * h / a) ** 4
    return Touch(
        d,
        d / h,
        area,
        a,
        normal,
        max(normal, 1.1 * half_space + layer(4.0, 0.5)),
        g * area / h + 8 * g * a / (2 - nu),
        compress / (compress + free),
        compress / (compress + squeeze),
        max(d / h, d / footprint.width_mm(d)),
    )
