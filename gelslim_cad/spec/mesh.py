"""The finite-element mesh of the pad."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

Count = Annotated[int, Field(ge=1, le=400)]


class Mesh(Block):
    """Cells of the pad mesh: by pitch (a divisor of the marker pitch) or by counts."""

    nodes_per_marker_pitch: int = Field(
        default=2,
        ge=1,
        le=20,
        description="Mesh cells per marker pitch; nodes meet markers",
    )
    cells_along: Count | None = Field(
        default=None, description="Cells along the finger, instead of nodes_per_marker_pitch"
    )
    cells_across: Count | None = Field(
        default=None, description="Cells across the finger, instead of nodes_per_marker_pitch"
    )
    layers: int = Field(
        default=4,
        ge=1,
        le=32,
        description="Cell layers through the thickness; one is the paper's form",
    )
    element: Literal["full", "bbar", "incompatible"] = Field(
        default="bbar",
        description="Hex-8 element: full 2×2×2 integration, B-bar (mean dilatation) or "
        "incompatible modes (best in bending)",
    )
    weighting: Literal["cell_centre", "volume_fraction"] = Field(
        default="cell_centre",
        description="Cells that the gel's outline or crown cuts: kept or dropped whole by their "
        "centre, or scaled by the share of their volume that the gel fills",
    )
    least_fill: float = Field(
        default=0.01,
        gt=0,
        le=1,
        description="Share of its volume below which volume_fraction drops a cell",
    )

    @model_validator(mode="after")
    def _both(self) -> Mesh:
        if (self.cells_along is None) != (self.cells_across is None):
            raise FieldError(
                "cells_along",
                "must be given together with cells_across, or neither",
                "add the other or delete it",
                ("cells_across",),
            )
        return self
