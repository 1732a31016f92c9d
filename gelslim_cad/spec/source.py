"""Where the figures of a library come from."""

from __future__ import annotations

from pydantic import Field

from gelslim_core.yaml.base import Block


class Source(Block):
    """Where figures come from."""

    text: str = Field(min_length=1, description="The sheet, or the reason of an assumption")
    gives: tuple[str, ...] = Field(min_length=1, description="The figures, by dotted path")
    assumed: bool = Field(default=False, description="Whether no sheet states these figures")
