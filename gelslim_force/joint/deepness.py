"""How deep a contact is, and what is assumed of deep ones.

The rims of a deep contact are steep. What the mesh does not resolve there is a larger share of the
light, and pressures differ more from node to node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.settings import JointSettings

Array = NDArray[np.float64]
FULLY = 1.4
"""Depth from which a contact is wholly deep, over that from which it begins to be."""


def deepness(height_mm: Array, deep_mm: float) -> float:
    """0 for contacts up to the depth `deep_mm`, growing to 1 at `FULLY` times that.

    `height_mm` (n,) is the motion of the nodes in contact, or of more nodes, along z.
    """
    depth = -float(height_mm.min(initial=0.0))
    return min(max((depth / deep_mm - 1.0) / (FULLY - 1.0), 0.0), 1.0)


def light_share_at(settings: JointSettings, deep: float) -> float:
    """The share of the light of a contact between shallow, 0, and deep, 1."""
    return (1 - deep) * settings.light_share + deep * settings.deep_light_share


def least_pressure_at(settings: JointSettings, deep: float) -> float:
    """The least pressure of a contact between shallow, 0, and deep, 1."""
    return (1 - deep) * settings.least_pressure + deep * settings.deep_least_pressure


@dataclass(frozen=True)
class TractionSigma:
    """Standard deviations of what tractions are assumed to be.

    Attributes:
        rough_mpa: Of the difference of the tractions of neighbouring nodes.
        tangential_mpa: Of what tangential tractions deviate from the part in common.
        ratio: Of that part over the pressure, along each direction; 0 for none in common.
    """

    rough_mpa: float
    tangential_mpa: float
    ratio: float


def traction_sigma(
    settings: JointSettings, deep: float, youngs_modulus_mpa: float, traction_mpa: Array
) -> TractionSigma:
    """What is assumed of the tractions of a contact.

    Args:
        settings: Has the shares of the modulus and of the mean pressure.
        deep: As `deepness` gives it.
        youngs_modulus_mpa: Of the gel.
        traction_mpa: (p, 3) present ones of the nodes; means are weighted by the pressure.
    """
    pressing = np.maximum(-traction_mpa[:, 2], 0.0)
    whole = max(float(pressing.sum()), 1e-12)
    mean = float(pressing @ pressing) / whole
    sheared = mean * float(np.linalg.norm(traction_mpa[:, :2].sum(axis=0))) / whole
    share = (1 - deep) * settings.shear_share + deep * settings.deep_shear_share
    least = (1 - deep) * settings.tangential_stress + deep * settings.deep_tangential_stress
    return TractionSigma(
        max(settings.roughness * youngs_modulus_mpa, settings.deep_roughness * deep * mean),
        max(least * youngs_modulus_mpa, share * sheared),
        (1 - deep) * settings.shear_ratio,
    )
