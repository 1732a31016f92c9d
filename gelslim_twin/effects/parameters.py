"""What every effect's block in a scene has in common."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gelslim_core.yaml.base import Block

Use = Literal["auto", "on", "off"]


class EffectParameters(Block):
    """Whether to simulate an effect, beside its own parameters."""

    use: Use = Field(
        default="auto", description="Let the planner decide, always simulate, or never"
    )
