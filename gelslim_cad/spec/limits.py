"""Numbers of a spec with their limits: fields of the models."""

from __future__ import annotations

from typing import Any

from pydantic import Field
from pydantic_core import PydanticUndefined


def between(least: float, most: float, description: str, default: Any = PydanticUndefined) -> Any:
    """A field for a number from `least` to `most`; one without a default must be given."""
    return Field(default=default, ge=least, le=most, description=description)


def above(limit: float, most: float, description: str, default: Any = PydanticUndefined) -> Any:
    """A field for a number greater than `limit` and at most `most`."""
    return Field(default=default, gt=limit, le=most, description=description)
