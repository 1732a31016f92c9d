"""Linear isotropic elastic material."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ifem_export.errors import MaterialError


@dataclass(frozen=True)
class Material:
    """Linear isotropic elastic solid.

    Args:
        youngs_modulus_mpa: Young's modulus E, > 0.
        poissons_ratio: ν, -1 < ν < 0.5 (0.5 itself has an infinite bulk modulus).
        density_kg_m3: mass density, > 0; statics do not use it.

    Raises:
        MaterialError: a constant is not a finite number or is out of range.
    """

    youngs_modulus_mpa: float
    poissons_ratio: float
    density_kg_m3: float

    def __post_init__(self) -> None:
        for name in ("youngs_modulus_mpa", "poissons_ratio", "density_kg_m3"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise MaterialError(f"{name} = {value!r}: must be a number")
            if not math.isfinite(value):
                raise MaterialError(f"{name} = {value!r}: must be finite")
        if self.youngs_modulus_mpa <= 0.0:
            raise MaterialError(
                f"youngs_modulus_mpa = {self.youngs_modulus_mpa!r}: must be > 0 "
                "(a gel is typically 0.05 to 1 MPa)"
            )
        if not -1.0 < self.poissons_ratio < 0.5:
            raise MaterialError(
                f"poissons_ratio = {self.poissons_ratio!r}: must lie strictly between -1 and 0.5; "
                "for a nearly incompressible gel use 0.49 to 0.4999"
            )
        if self.density_kg_m3 <= 0.0:
            raise MaterialError(f"density_kg_m3 = {self.density_kg_m3!r}: must be > 0")

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

    @property
    def constrained_modulus_mpa(self) -> float:
        """Modulus of uniaxial strain, M = λ + 2G."""
        return self.lame_lambda_mpa + 2.0 * self.shear_modulus_mpa
