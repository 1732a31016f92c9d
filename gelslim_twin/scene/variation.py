"""Ranges that a data set draws from: each scene of it a pure function of seed and number."""

from __future__ import annotations

import hashlib
from typing import Annotated, Any

from pydantic import Field, model_validator

from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError

Range = Annotated[tuple[float, float], Field(description="Lowest and highest value")]
_TWO_53 = 2.0**53


class Variation(Block):
    """Ranges, drawn evenly; what is left out stays as the scene says."""

    x_mm: Range | None = Field(default=None, description="Added to the start, along the finger")
    y_mm: Range | None = Field(default=None, description="Added to the start, across the finger")
    depth_factor: Range | None = Field(default=None, description="Times every depth of a press")
    lateral_factor: Range | None = Field(default=None, description="Times every shear and slide")
    direction_deg: Range | None = Field(
        default=None, description="Turns every shear and slide about the gel's normal"
    )
    twist_factor: Range | None = Field(default=None, description="Times every twist")
    size_factor: Range | None = Field(
        default=None, description="Times every length of the indenters"
    )
    friction: Range | None = Field(default=None, description="Coefficient of friction")

    @model_validator(mode="after")
    def _ranges(self) -> Variation:
        for name in type(self).model_fields:
            pair = getattr(self, name)
            if pair is not None and pair[0] > pair[1]:
                raise FieldError(name, f"{pair[0]:g} is above {pair[1]:g}", "swap the two")
        for name in ("depth_factor", "size_factor"):
            pair = getattr(self, name)
            if pair is not None and pair[0] <= 0:
                raise FieldError(name, "must be above 0", "raise the lower end")
        if self.friction is not None and not 0 <= self.friction[0] <= self.friction[1] <= 10:
            raise FieldError("friction", "must lie in 0 to 10", "correct the range")
        return self

    def drawn(self, seed: int, number: int) -> dict[str, float]:
        """The values of scene `number`; every name has a stream of its own."""
        given: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        return {
            name: pair[0] + _unit(seed, number, name) * (pair[1] - pair[0])
            for name, pair in given.items()
            if pair is not None
        }


def _unit(seed: int, number: int, name: str) -> float:
    """An even number in 0 ... 1 from the hash of what it is for: the same on every machine."""
    digest = hashlib.sha256(f"{seed}/{number}/{name}".encode()).digest()
    return (int.from_bytes(digest[:8], "big") >> 11) / _TWO_53
