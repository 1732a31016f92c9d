"""Linear isotropic elastic material."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ifem_export.errors import MaterialError


@dataclass(frozen=True)
class Material:
    """Linear isotropic elastic solid.

    Attributes:
        youngs_modulus_mpa: Young's modulus E, > 0.
        poissons_ratio: Poisson's ratio, -1 < ν < 0.5; at 0.5 the bulk modulus is infinite.
        density_kg_m3: Mass density, > 0; static forces do not depend on it.

    Raises:
        MaterialError: A constant is not a finite number or is out of range.
    """

    youngs_modulus_mpa: float
    poissons_ratio: float
    density_kg_m3: float

    def __post_init__(self) -> None:
        for name in ("youngs_modulus_mpa", "poissons_ratio", "density_kg_m3"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise _refusal(name, value, "must be a number")
            if not math.isfinite(value):
                raise _refusal(name, value, "must be finite")
        if self.youngs_modulus_mpa <= 0.0:
            reason = "must be > 0 (a gel is typically 0.05 to 1 MPa)"
            raise _refusal("youngs_modulus_mpa", self.youngs_modulus_mpa, reason)
        if not -1.0 < self.poissons_ratio < 0.5:
            reason = (
                "must lie strictly between -1 and 0.5; "
                "for a nearly incompressible gel use 0.49 to 0.4999"
            )
            raise _refusal("poissons_ratio", self.poissons_ratio, reason)
        if self.density_kg_m3 <= 0.0:
            raise _refusal("density_kg_m3", self.density_kg_m3, "must be > 0")

    @property
    def lame_lambda_mpa(self) -> float:
        """First Lamé constant λ = E ν / ((1+ν)(1-2ν))."""
        e, nu = self.youngs_modulus_mpa, self.poissons_ratio
        return e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus (second Lamé constant) G = E / (2(1+ν))."""
        return self.youngs_modulus_mpa / (2.0 * (1.0 + self.poissons_ratio))

    @property
    def bulk_modulus_mpa(self) -> float:
        """Bulk modulus κ = E / (3(1-2ν))."""
        return self.youngs_modulus_mpa / (3.0 * (1.0 - 2.0 * self.poissons_ratio))


def _refusal(name: str, value: Any, reason: str) -> MaterialError:
    return MaterialError(f"{name} = {value!r}: {reason}", field=name, value=value)
