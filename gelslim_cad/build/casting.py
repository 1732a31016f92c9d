"""The silicone to mix for the castings of one finger."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape

WASTE_RATIO = 0.25
"""Volume that stays in cup, syringe, gate and vents, divided by that of the cavity."""
LEAST_PART_G = 0.25
"""Least mass of a part: half a step of a scale of 0.01 g is then 2 % of it."""
MM3_PER_ML = 1000.0


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
    batch: float = 1.0
    """Mass that is mixed, as a multiple of that for one gel."""

    @classmethod
    def of(cls, d: Dimensions) -> Casting:
        """The casting of one gel."""
        return cls(
            gel_volume_mm3=GelShape.of(d).volume_mm3,
            shrinkage_percent=d["manufacturing.gel_shrinkage_percent"],
            density_kg_m3=d["material.gel.density_kg_m3"],
            mix_a=d["material.gel.mix_ratio_a"],
            mix_b=d["material.gel.mix_ratio_b"],
        )

    @property
    def cavity_volume_mm3(self) -> float:
        """Liquid that fills the mould, gel / (1 - s)³ for the linear shrinkage s."""
        return self.gel_volume_mm3 / (1 - self.shrinkage_percent / 100) ** 3

    @property
    def mixed_volume_mm3(self) -> float:
        """Liquid to mix, cavity (1 + waste), times the batch."""
        return self.cavity_volume_mm3 * (1 + WASTE_RATIO) * self.batch

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

    def weighable(self) -> Casting:
        """A batch large enough that a scale resolves both parts; the same where one gel's is."""
        smaller = min(self.mass_a_g, self.mass_b_g)
        if smaller >= LEAST_PART_G:
            return self
        return replace(self, batch=self.batch * LEAST_PART_G / smaller)

    def lines(self) -> tuple[tuple[str, str, float, str], ...]:
        """Rows (quantity, formula, value, unit) for the building instructions."""
        whole = self.mix_a + self.mix_b
        gel, cavity, mixed = (
            volume_mm3 / MM3_PER_ML
            for volume_mm3 in (self.gel_volume_mm3, self.cavity_volume_mm3, self.mixed_volume_mm3)
        )
        return (
            ("cured gel", "outline area · thickness less the crown", gel, "ml"),
            ("linear shrinkage", "given", self.shrinkage_percent, "%"),
            ("mould cavity", "gel / (1 - s)³", cavity, "ml"),
            ("waste", "cup, syringe, gate and vents", 100 * WASTE_RATIO, "%"),
            ("batch", "so that the scale resolves both parts", self.batch, "gels"),
            ("liquid to mix", "cavity · (1 + waste) · batch", mixed, "ml"),
            ("mass to mix", "volume · density", self.mass_g, "g"),
            ("part A", f"mass · {self.mix_a:g} / {whole:g}", self.mass_a_g, "g"),
            ("part B", f"mass · {self.mix_b:g} / {whole:g}", self.mass_b_g, "g"),
        )
