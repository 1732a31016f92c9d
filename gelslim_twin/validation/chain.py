"""The variants of the pipeline (chains) that a validation compares: ours and the paper's.

The paper uses one layer of fully integrated cells, the projection compensation as printed, forces
as stiffness times displacement, and for a known shape the cap of the indenter below the rim of the
contact patch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_core.budget.budget import Budget
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.estimator import ForceSettings
from gelslim_force.settings import PipelineSettings
from gelslim_twin.contact.gel_state import GelState
from ifem_export.bundle.bundle import Bundle

Knows = Literal["contact", "depth", "shape", "cap", "nothing"]
"""What the chain is given: the true heights (`depth`), with the true contact region (`contact`), or
the shape of the indenter (`shape`; `cap` with the paper's model of it)."""


@dataclass(frozen=True)
class Chain:
    """One variant of the pipeline."""

    name: str
    settings: PipelineSettings
    knows: Knows
    needs_even_layers: bool = False
    """It does not take crowned pads and cut cells."""


_PAPER = PipelineSettings(
    rung="paper", compensation="printed", force=ForceSettings(method="direct")
)
CHAINS: tuple[Chain, ...] = (
    Chain("ours, contact known", PipelineSettings(), "contact"),
    Chain("ours, depth known", PipelineSettings(), "depth"),
    Chain("ours, depth, neo-Hookean", PipelineSettings(gel="neo_hookean"), "depth", True),
    Chain("ours, shape known", PipelineSettings(), "shape"),
    Chain("ours, shape, neo-Hookean", PipelineSettings(gel="neo_hookean"), "shape", True),
    Chain("ours, tangential", PipelineSettings(), "nothing"),
    Chain("paper, depth known", _PAPER, "depth", True),
    Chain("paper, shape known", _PAPER, "cap", True),
)


def chains_for(bundle: Bundle, budget: Budget | None = None) -> tuple[Chain, ...]:
    """The chains for a bundle's pad; those that name no operator get the budget."""
    mesh = bundle.mesh
    even = mesh.fill is None and mesh.surface_shift is None
    return tuple(_budgeted(c, budget) for c in CHAINS if even or not c.needs_even_layers)


def _budgeted(chain: Chain, budget: Budget | None) -> Chain:
    if chain.settings.rung is not None:
        return chain
    return replace(chain, settings=replace(chain.settings, budget=budget))


Array = NDArray[np.float64]


class KnownContact:
    """The true normal motion and contact region as a normal source, one state per frame."""

    def __init__(self, states: Iterable[GelState]) -> None:
        self._left: Iterator[GelState] = iter(states)

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> GelState:
        """The frame's state. Raises StopIteration beyond the last."""
        return next(self._left)

    def motion(
        self, seen: GelState, lateral_mm: NDArray[np.float64] | None = None
    ) -> NormalReading:
        """True heights, without doubt, and the nodes truly touched."""
        w = seen.displacement_mm[:, 2]
        return NormalReading(w, np.zeros(len(w)), seen.touch > 0)
