"""The chains that a validation compares: ours, and the paper's choices.

The paper's: one layer of full cells, the printed compensation, and for a known shape the cap of
the indenter below the rim of the patch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gelslim_force.force_estimator import ForceSettings
from gelslim_force.pipeline_settings import PipelineSettings

Knows = Literal["depth", "shape", "cap", "nothing"]
"""The surface's true height, or the indenter's shape (`cap`: with the paper's model of it)."""


@dataclass(frozen=True)
class Chain:
    """One way to estimate."""

    name: str
    settings: PipelineSettings
    knows: Knows


CHAINS: tuple[Chain, ...] = (
    Chain("ours, depth known", PipelineSettings(), "depth"),
    Chain("ours, depth, pcg", PipelineSettings(rung="pcg"), "depth"),
    Chain("ours, shape known", PipelineSettings(), "shape"),
    Chain("ours, tangential", PipelineSettings(), "nothing"),
    Chain(
        "paper, shape known",
        PipelineSettings(
            rung="paper", compensation="printed", force=ForceSettings(method="direct")
        ),
        "cap",
    ),
    Chain(
        "paper, depth known",
        PipelineSettings(
            rung="paper", compensation="printed", force=ForceSettings(method="direct")
        ),
        "depth",
    ),
)
