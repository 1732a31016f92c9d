"""A state of the gel that remembers where on the tool its nodes stick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.gel_state import GelState


@dataclass(frozen=True, eq=False)
class HeldState(GelState):
    """A state and the motion (c, 3) that nodes would have if they stuck exactly.

    What is left of a solver's tolerance would else add up from step to step.
    """

    held_mm: NDArray[np.float64] | None = None


def held_mm(state: GelState) -> NDArray[np.float64]:
    """(c, 3); of a state without memory its displacement."""
    held = state.held_mm if isinstance(state, HeldState) else None
    return state.displacement_mm if held is None else held
