"""Elastic data: what the bezel is made of, and how stiff a rubber strip is under pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = float | NDArray[np.float64]


@dataclass(frozen=True)
class Elastic:
    """Young's modulus in MPa and Poisson's ratio."""

    youngs_modulus_mpa: float
    poissons_ratio: float


PRINTED = {
    "sla": Elastic(2200.0, 0.40),
    "fdm": Elastic(2000.0, 0.38),
    "sls": Elastic(1700.0, 0.40),
}
"""Tough resin (Formlabs Tough 2000: 2.2 GPa in tension), PETG (data sheets: 1.9 to 2.1 GPa), PA12
(EOS PA 2200: 1.7 GPa). Poisson's ratios are assumed."""
METALS = {"aluminium": Elastic(70_000.0, 0.33), "steel": Elastic(200_000.0, 0.30)}
"""EN AW-5754 and stainless steel 1.4301, figures of EN 1999-1-1 and EN 10088-1."""
ACRYLIC = Elastic(3200.0, 0.37)
"""Cast sheet, PLEXIGLAS GS data sheet: 3300 MPa; 3200 MPa by ISO 527 of other makers."""
FILLER = 0.9
"""Lindley's φ for soft rubbers (Engineering Design with Natural Rubber, table 3: 0.93 at 30 IRHD,
0.85 at 40)."""
LEAST_STRETCH = 0.1
"""A strip that is pressed to less is no longer described; the rule of the shims fails before."""


def bezel_elastic(material: str, print_process: str) -> Elastic:
    """Elastic data of a bezel of a spec's `bezel_material`, printed by its `print_process`."""
    return PRINTED[print_process] if material == "printed" else METALS[material]


def rubber_modulus_mpa(shore_a: Real) -> Real:
    """Young's modulus of a rubber from its hardness.

    A. N. Gent, On the relation between indentation hardness and Young's modulus (1958):
    E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)).

    Args:
        shore_a: Hardness S, Shore A.

    Returns:
        Young's modulus in MPa.
    """
    return 0.0981 * (56 + 7.62336 * shore_a) / (0.137505 * (254 - 2.54 * shore_a))


def strip_modulus_mpa_per_mm(
    shore_a: Real, thickness_mm: Real, width_mm: Real, compressed_by_mm: Real
) -> Real:
    """Pressure per compression of a long rubber strip that cannot slip on its faces.

    Gent and Lindley (1959): the effective modulus of a long strip is 4/3 E (1 + φ S²), with the
    shape factor S = width / (2 thickness), and the pressure at the stretch λ is E_c (λ⁻² - λ) / 3.
    What is returned is that pressure over the compression (the secant).

    Args:
        shore_a: Hardness, Shore A.
        thickness_mm: Free thickness.
        width_mm: Width of the strip, the shorter side of its face.
        compressed_by_mm: Compression at which the secant is taken.

    Returns:
        The foundation's modulus in MPa/mm.
    """
    shape = width_mm / (2 * thickness_mm)
    effective = 4 / 3 * rubber_modulus_mpa(shore_a) * (1 + FILLER * shape**2)
    stretch = np.maximum(1 - compressed_by_mm / thickness_mm, LEAST_STRETCH)
    return effective / thickness_mm * (1 + stretch + stretch**2) / (3 * stretch**2)
