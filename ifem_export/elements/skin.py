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

    @property
    def plane_n_per_mm(self) -> float:
        """N/(1 - ν²): force per width and strain where the stretch across is held."""
        return self.stiffness_n_per_mm / (1 - self.poissons_ratio**2)


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
        """Sum of N/(1 - ν²) of all layers."""
        return sum(one.plane_n_per_mm for one in self.membranes)

    def to_record(self) -> dict[str, Any]:
        """Plain values, for `from_record`."""
        return asdict(self)

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Skin:
        """The skin of plain values. Raises KeyError, TypeError or IfemError for others."""
        layers = (record["coat"], record["fabric"])
        coat, fabric = (None if one is None else Membrane(**one) for one in layers)
        return cls(coat, fabric, record["friction"])


def layers_of(skin: Skin | None) -> Skin:
    """A skin with its layers; a coat of 1 N/mm where the gel counts as bare."""
    if skin is not None and skin.membranes:
        return skin
    return Skin(Membrane(1.0), friction=None if skin is None else skin.friction)


def restiffened(skin: Skin | None, stiffness_n_per_mm: float) -> Skin:
    """The skin with another membrane stiffness of all layers together.

    Coat and fabric keep their proportion; where there are none, it is a coat. Without stiffness
    there are no layers.

    Args:
        skin: As designed; None for a bare gel.
        stiffness_n_per_mm: At least 0.

    Raises:
        IfemError: The stiffness is negative or not finite.
    """
    layers = layers_of(skin)
    if stiffness_n_per_mm == 0:
        return replace(layers, coat=None, fabric=None)
    factor = stiffness_n_per_mm / layers.stiffness_n_per_mm
    coat, fabric = (
        None if one is None else replace(one, stiffness_n_per_mm=factor * one.stiffness_n_per_mm)
        for one in (layers.coat, layers.fabric)
    )
    return replace(layers, coat=coat, fabric=fabric)
