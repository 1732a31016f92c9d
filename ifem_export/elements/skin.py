"""What covers the gel: a coat of paint and a fabric, each a membrane."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ifem_export.errors import IfemError


@dataclass(frozen=True)
class Membrane:
    """An isotropic elastic membrane.

    Attributes:
        stiffness_n_per_mm: N = E t, force per width and strain of a narrow strip, > 0.
        poissons_ratio: Contraction across over stretch along, 0 to below 0.5.

    Raises:
        IfemError: A value is outside its range.
    """

    stiffness_n_per_mm: float
    poissons_ratio: float = 0.3

    def __post_init__(self) -> None:
        if not 0 < self.stiffness_n_per_mm < np.inf:
            raise IfemError(
                f"stiffness_n_per_mm = {self.stiffness_n_per_mm}: must be positive and finite",
                field="stiffness_n_per_mm",
                value=self.stiffness_n_per_mm,
            )
        if not 0 <= self.poissons_ratio < 0.5:
            raise IfemError(
                f"poissons_ratio = {self.poissons_ratio}: must be at least 0 and below 0.5",
                field="poissons_ratio",
                value=self.poissons_ratio,
            )


@dataclass(frozen=True)
class Skin:
    """What covers the gel.

    Attributes:
        coat: The paint; None where its stiffness is left out.
        fabric: The fabric over it; None for none.
        friction: Coefficient of friction against objects, where it is known.
    """

    coat: Membrane | None = None
    fabric: Membrane | None = None
    friction: float | None = None

    @property
    def membranes(self) -> tuple[Membrane, ...]:
        """The layers that there are."""
        return tuple(one for one in (self.coat, self.fabric) if one is not None)

    @property
    def stiffness_n_per_mm(self) -> float:
        """Sum of the stiffness of all layers."""
        return sum(one.stiffness_n_per_mm for one in self.membranes)

    @property
    def plane_stiffness_n_per_mm(self) -> float:
        """Sum of N/(1 - ν²) of all layers: force per width and strain, held across."""
        return sum(m.stiffness_n_per_mm / (1 - m.poissons_ratio**2) for m in self.membranes)

    def scaled(self, factor: float) -> Skin:
        """The skin with all layers stiffer by a factor > 0. Raises IfemError for another one."""
        coat, fabric = (
            None if m is None else replace(m, stiffness_n_per_mm=factor * m.stiffness_n_per_mm)
            for m in (self.coat, self.fabric)
        )
        return replace(self, coat=coat, fabric=fabric)

    def to_record(self) -> dict[str, Any]:
        """Plain values, for `from_record`."""
        return asdict(self)

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Skin:
        """The skin of plain values. Raises KeyError, TypeError or IfemError for others."""
        layers = (record["coat"], record["fabric"])
        coat, fabric = (None if one is None else Membrane(**one) for one in layers)
        return cls(coat, fabric, record["friction"])
