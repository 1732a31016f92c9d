"""What every block of an input file shares: frozen, strict, no unknown keys, no NaN."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, ConfigDict


class Block(BaseModel):
    """A frozen block of an input file; units live in the field names."""

    starting_point: ClassVar[str] = "start from an example of this kind of file"
    """Remedy for a file that holds nothing of the model."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=False,
        validate_default=True,
    )
