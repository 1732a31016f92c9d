"""How much silicone to mix for one gel: volumes, masses of parts A and B. Needs no CAD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from gelslim_cad.geometry.gel_shape import GelShape

WASTE_RATIO = 0.25
"""Volume that stays in cup, syringe, gate and vents, divided by that of the cavity."""
SCALE_MM3_PER_ML = 1000.0


@dataclass(frozen=True)
class Casting:
    """One casting. Volumes in mm³, masses in g, density in kg/m³, ratios without unit."""

    gel_volume_mm3: float
    """The cured gel."""
    shrinkage_percent: float
    """Linear."""
    density_kg_m3: float
    mix_a: float
    mix_b: float
    """Parts A and B by mass."""
    waste_ratio: float = WASTE_RATIO
    batch: float = 1.0
    """Mass that is mixed, as a multiple of that for one gel."""

    @property
    def cavity_volume_mm3(self) -> float:
        """Liquid that fills the mould, gel / (1 - s)³ for the linear shrinkage s."""
        return self.gel_volume_mm3 / (1 - self.shrinkage_percent / 100) ** 3

    @property
    def mixed_volume_mm3(self) -> float:
        """Liquid to mix, cavity (1 + waste), times the batch."""
        return self.cavity_volume_mm3 * (1 + self.waste_ratio) * self.batch

    @property
    def mass_g(self) -> float:
        """Mass to mix: 1 mm³ at 1 kg/m³ is 10⁻⁶ g."""
        return self.mixed_volume_mm3 * self.density_kg_m3 * 1e-6

    @property
    def mass_a_g(self) -> float:
        """Part A, mass a / (a + b)."""
        return self.mass_g * self.mix_a / (self.mix_a + self.mix_b)

    @property
    def mass_b_g(self) -> float:
        """Part B, mass b / (a + b)."""
        return self.mass_g * self.mix_b / (self.mix_a + self.mix_b)

    def weighable(self, scale_step_g: float = 0.01, error: float = 0.02) -> Casting:
        """A batch large enough that half a step of the scale is at most `error` of either part.

        The same casting where one gel's worth will do. Raises ValueError unless both are > 0.
        """
        if not (scale_step_g > 0 and error > 0):
            raise ValueError(
                f"scale_step_g = {scale_step_g:g} and error = {error:g}: both must be > 0"
            )
        least = scale_step_g / 2 / error
        smaller = min(self.mass_a_g, self.mass_b_g)
        return self if smaller >= least else replace(self, batch=self.batch * least / smaller)

    def lines(self) -> tuple[tuple[str, str, float, str], ...]:
        """Rows (quantity, formula, value, unit) for the building instructions."""
        ml = SCALE_MM3_PER_ML
        return (
            (
                "cured gel",
                "outline area · thickness less the crown",
                self.gel_volume_mm3 / ml,
                "ml",
            ),
            ("linear shrinkage", "given", self.shrinkage_percent, "%"),
            ("mould cavity", "gel / (1 - s)³", self.cavity_volume_mm3 / ml, "ml"),
            ("waste", "cup, syringe, gate and vents", 100 * self.waste_ratio, "%"),
            ("batch", "so that the scale resolves both parts", self.batch, "gels"),
            ("liquid to mix", "cavity · (1 + waste) · batch", self.mixed_volume_mm3 / ml, "ml"),
            ("mass to mix", "volume · density", self.mass_g, "g"),
            ("part A", f"mass · {self.mix_a:g} / {self.mix_a + self.mix_b:g}", self.mass_a_g, "g"),
            ("part B", f"mass · {self.mix_b:g} / {self.mix_a + self.mix_b:g}", self.mass_b_g, "g"),
        )


def cast_gel(d: Mapping[str, Any] | Any, waste_ratio: float = WASTE_RATIO) -> Casting:
    """The casting of one gel of `d` (Dimensions, or any lookup by dotted name).

    Raises ValueError for a negative waste ratio.
    """
    if not waste_ratio >= 0:
        raise ValueError(f"waste_ratio = {waste_ratio:g}: must be >= 0; 0.25 is usual")
    return Casting(
        gel_volume_mm3=GelShape.of(d).volume_mm3,
        shrinkage_percent=float(d["manufacturing.gel_shrinkage_percent"]),
        density_kg_m3=float(d["material.gel.density_kg_m3"]),
        mix_a=float(d["material.gel.mix_ratio_a"]),
        mix_b=float(d["material.gel.mix_ratio_b"]),
        waste_ratio=waste_ratio,
    )
