"""Material properties of gel and acrylic."""

from __future__ import annotations

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

STIFF_GEL_MPA = 5.0


class GelMaterial(Block):
    """Platinum-cure silicone of the pad."""

    name: str = Field(default="XP-565 silicone", max_length=80, description="Gel, for the BOM")
    youngs_modulus_mpa: float = Field(default=0.147, gt=0, le=2000, description="Young's modulus E")
    poissons_ratio: float = Field(default=0.3223, ge=0, lt=0.5, description="Poisson's ratio")
    youngs_modulus_tolerance_ratio: float = Field(
        default=0.1,
        gt=0,
        le=1,
        description="Standard deviation of Young's modulus between batches, as a part of it",
    )
    poissons_ratio_tolerance: float = Field(
        default=0.02, gt=0, le=0.2, description="Standard deviation of Poisson's ratio"
    )
    density_kg_m3: float = Field(default=1020.0, ge=200, le=4000, description="Density")
    refractive_index: float = Field(default=1.41, ge=1, le=2, description="Refractive index")
    coat_reflectance: float = Field(
        default=0.5, ge=0, le=0.98, description="Part of the light that the painted coat scatters"
    )
    mix_ratio_a: float = Field(default=15.0, gt=0, le=1000, description="Parts A by mass")
    mix_ratio_b: float = Field(default=1.0, gt=0, le=1000, description="Parts B by mass")


class AcrylicMaterial(Block):
    """PMMA of the light guide."""

    refractive_index: float = Field(default=1.4906, gt=1, le=2, description="Refractive index")
    absorption_per_m: float = Field(
        default=2.0, ge=0, le=200, description="Absorption coefficient per metre"
    )


class Material(Block):
    """Gel and acrylic."""

    gel: GelMaterial = Field(default=GelMaterial(), description="The gel")
    acrylic: AcrylicMaterial = Field(default=AcrylicMaterial(), description="The light guide")
    allow_stiff_gel: bool = Field(
        default=False, description="Accept a gel stiffer than 5 MPa (no tactile gel is)"
    )

    @model_validator(mode="after")
    def _soft(self) -> Material:
        modulus = self.gel.youngs_modulus_mpa
        if modulus > STIFF_GEL_MPA and not self.allow_stiff_gel:
            raise FieldError(
                "gel.youngs_modulus_mpa",
                f"must be <= {STIFF_GEL_MPA:g} MPa",
                f"did you mean {modulus / 1000:g}, that is {modulus:g} kPa? Tactile gels have "
                "about 0.05 to 1 MPa; set material.allow_stiff_gel: true for a stiffer one",
            )
        return self
