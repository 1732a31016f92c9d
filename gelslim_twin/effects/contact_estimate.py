"""Closed-form estimates of size and force of a contact, which rather overestimate."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

NONLINEAR_EXCESS = ((0.0, 0.0), (0.05, 0.02), (0.15, 0.08), (0.30, 0.21), (0.50, 0.47))
"""Indentation over thickness, and neo-Hookean over linear force minus one (computed)."""
DEEPEST_SHARE = 0.9
"""Largest depth of a contact as a part of the thickness of the gel."""
RIDGES = 1.25
"""Factor for rings and bumps, whose force is up to 1.19 times that of the disc of their area."""


@dataclass(frozen=True)
class Footprint:
    """Size of the part of a tool below the gel's undeformed surface, as functions of depth."""

    area_mm2: Callable[[float], float]
    volume_mm3: Callable[[float], float]
    reach_mm: Callable[[float], float]
    """Largest distance from the tool's axis."""
    steepest: Callable[[float], float]
    """Largest slope; infinite for shapes with walls."""
    width_mm: Callable[[float], float]
    """Width of the narrowest shape."""


@dataclass(frozen=True)
class ContactEstimate:
    """Size, stiffness and force of the deepest contact of a motion."""

    depth_mm: float
    indentation: float
    """Depth over thickness of the gel."""
    area_mm2: float
    radius_mm: float
    """Radius of the disc of the same area."""
    normal_n: float
    """Normal force without friction on a linear gel."""
    stick_n: float
    """The same with full stick, which prevents an incompressible layer from flowing sideways."""
    shear_n_per_mm: float
    """Tangential stiffness with full stick: G A / h and the part of the surrounding gel."""
    squeezed: float
    """Share of the indentation that displaces gel sideways; the rest compresses it."""
    squeezed_at_rim: float
    """The same at the rim of the pad, where no gel surrounds the contact."""
    strain: float
    """Depth over thickness, or over the width of the narrowest shape if that is more."""

    @property
    def sideways_mm(self) -> float:
        """Largest sideways displacement of a frictionless surface.

        It is 0.75 of the depth (0.73 in solved contacts of a wedge). Under wide tools the gel
        flows past the rim of the tool: a d/(2 h) in the mean over the layer, half as much again at
        its face (lubrication with a free face), 1.2 times that at the middle of a square's sides,
        and 1.2 times again where the pad's rim cuts the contact (1.09 in solved contacts).
        """
        wide = self.squeezed_at_rim * self.radius_mm * self.indentation
        return 0.75 * max(self.depth_mm, 1.2 * 1.2 * wide)

    @property
    def nonlinear_excess(self) -> float:
        """Share by which a linear gel underestimates the force.

        For the compressed part it is the table, which was computed for a compressible gel under a
        ball. For the displaced part the layer becomes thinner: d/h³ becomes the integral of
        1/(h - d)³, which is larger by the factor ((1 - e)^-2 - 1)/(2 e).
        """
        table, e = nonlinear_excess(self.strain), min(self.indentation, 0.8)
        thinner = ((1 - e) ** -2 - 1) / (2 * e) - 1 if e > 0 else 0.0
        return table + self.squeezed * max(0.0, thinner - table)


def nonlinear_excess(indentation: float) -> float:
    """The table of the nonlinear excess, interpolated linearly."""
    e = max(0.0, indentation)
    points = NONLINEAR_EXCESS
    for (e0, x0), (e1, x1) in itertools.pairwise(points):
        if e <= e1:
            return x0 + (x1 - x0) * (e - e0) / (e1 - e0)
    (e0, x0), (e1, x1) = points[-2:]
    # Beyond the table the excess grows faster than linearly, hence twice the last slope.
    return x1 + 2 * (x1 - x0) / (e1 - e0) * (e - e1)


def contact_estimate(
    footprint: Footprint,
    depth_mm: float,
    thickness_mm: float,
    youngs_modulus_mpa: float,
    poissons_ratio: float,
) -> ContactEstimate:
    """Estimate the contact at `depth_mm`; it is empty for a depth of 0 or less.

    The normal force is the sum of two parts. The first is that of a half-space under a flat
    punch, 2 E* a δ (Boussinesq, with the mean overlap δ = V/A), which is all there is on a thick
    gel. The second is that of a thin bonded layer: compression, M V/h, in series with sideways
    flow, 3 G V A / (8 π h³) (lubrication with a free upper face; four times as much with stick).
    The surrounding gel hinders the flow as if the radius were larger by 1.2 h, or by 0.5 h with
    stick. These two lengths are fitted to solved contacts (ν from 0.32 to 0.495, radius over
    thickness from 0.7 to 3), for which the sum is 1.0 to 1.9 times the solved force.
    """
    d = max(0.0, depth_mm)
    area = footprint.area_mm2(d) if d > 0 else 0.0
    if area <= 0:
        return ContactEstimate(
            d, d / thickness_mm, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, d / thickness_mm
        )
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
    return ContactEstimate(
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
