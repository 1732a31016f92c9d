"""State of the gel at one pose, and the error of a contact that has none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import IfemError

Array = NDArray[np.float64]


class ContactStatus(IntEnum):
    """Contact status of a surface node: no contact, sticking or slipping."""

    FREE = 0
    STICK = 1
    SLIP = 2


@dataclass(frozen=True, eq=False)
class GelState:
    """Fields over the c surface nodes of the pad.

    Attributes:
        displacement_mm: Displacement (c, 3) in mm.
        force_n: Nodal forces (c, 3) in N on the gel.
        touch: Contact status (c,), values of `ContactStatus`.
        solver: Report of the solver: residual, penetration_mm, complementarity, iterations.
    """

    displacement_mm: Array
    force_n: Array
    touch: NDArray[np.int8]
    solver: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def at_rest(cls, nodes: int) -> GelState:
        """The undeformed gel without contact."""
        nothing = np.zeros((nodes, 3))
        return cls(nothing, nothing, np.zeros(nodes, dtype=np.int8))

    def blended(self, later: GelState, part: float) -> GelState:
        """Linear interpolation to a later state, at `part` (0 ... 1) of the way."""
        if part == 0.0:
            return self
        u = (1 - part) * self.displacement_mm + part * later.displacement_mm
        f = (1 - part) * self.force_n + part * later.force_n
        touch = self.touch if part < 0.5 else later.touch
        return GelState(u, f, touch, self.solver if part < 0.5 else later.solver)


@dataclass(frozen=True, eq=False)
class StickTargets:
    """Displacements with which n nodes stick to the tool at the end of a load step.

    Attributes:
        target_mm: Those displacements (n, 3).
        ahead_mm: Initial guess (n, 3) of the displacement, in which the tool carries nodes that it
            touched before.
        dragged_mm: Way (n, 3) of the point of the tool at the node.
        share: Part (n,) of the step in which the node is in contact.
        share_rate: Derivative (n,) of that part by the height of the tool over the node, in 1/mm.
    """

    target_mm: Array
    ahead_mm: Array
    dragged_mm: Array
    share: Array
    share_rate: Array

    def at(self, nodes: NDArray[np.intp]) -> StickTargets:
        """Those of some of the nodes."""
        return StickTargets(*(getattr(self, f.name)[nodes] for f in fields(self)))


@dataclass(frozen=True, eq=False)
class TouchedNodes:
    """The n nodes in contact, as the last load step solved them.

    Attributes:
        nodes: Their numbers (n,) among the surface nodes.
        normal: Unit normals (n, 3) into the tool.
        targets: Where they would stick to the tool.
    """

    nodes: NDArray[np.intp]
    normal: Array
    targets: StickTargets


@dataclass(frozen=True, eq=False)
class AnchoredState(GelState):
    """A state with the displacement (c, 3) at which its sticking nodes are fixed to the tool.

    Without it the errors within the solver's tolerance would add up from step to step.
    """

    anchor_mm: NDArray[np.float64] | None = None
    touched: TouchedNodes | None = field(default=None, kw_only=True)
    """The nodes in contact, from which derivatives are taken; None where they are not known."""


def anchor_mm(state: GelState) -> NDArray[np.float64]:
    """Displacement (c, 3) at which nodes stick; of a plain state its own displacement."""
    held = state.anchor_mm if isinstance(state, AnchoredState) else None
    return state.displacement_mm if held is None else held


class ContactError(IfemError):
    """A contact did not converge to the tolerance, or its input is invalid.

    Attributes:
        residual: Smallest residual reached, relative to the forces; NaN where there is none.
    """

    def __init__(self, message: str, residual: float = float("nan")) -> None:
        super().__init__(message)
        self.residual = residual

    def __reduce__(self) -> tuple[type[ContactError], tuple[str, float]]:
        """Parts for pickling, so that worker processes can raise it."""
        return (type(self), (str(self), self.residual))
