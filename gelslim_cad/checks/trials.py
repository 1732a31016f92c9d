"""Relaxed versions of a design, each of them solved once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gelslim_cad.checks.relaxation import Relaxation, derive_each
from gelslim_cad.geometry.names import DimensionName
from gelslim_cad.spec import Spec

Changes = tuple[Relaxation, ...]
FIGURES: tuple[DimensionName, ...] = (
    "finger.thickness_mm",
    "finger.length_mm",
    "view.marker_across_px",
    "view.marker_along_px",
)
"""Dimensions that a trial keeps."""


@dataclass(frozen=True)
class Trial:
    """A relaxed design.

    Attributes:
        figures: Values of `FIGURES`.
        is_feasible: Whether its fold keeps all limits.
    """

    figures: Mapping[str, float]
    is_feasible: bool

    @property
    def thickness_mm(self) -> float:
        """Thickness of the finger."""
        return self.figures["finger.thickness_mm"]


@dataclass(frozen=True)
class Trials:
    """Relaxed versions of one design; each is solved when it is first asked for.

    Attributes:
        spec: The design.
    """

    spec: Spec
    _known: dict[Changes, Trial] = field(default_factory=dict)

    def of(self, sets: Sequence[Changes]) -> list[Trial]:
        """The design with each set of changes; all that are new are solved in one batch."""
        new = [chosen for chosen in dict.fromkeys(sets) if chosen not in self._known]
        if new:
            batch = derive_each(self.spec, [{s.path: s.value for s in chosen} for chosen in new])
            feasible = batch.feasible()
            columns = {name: np.broadcast_to(batch[name], len(new)) for name in FIGURES}
            for k, chosen in enumerate(new):
                figures = {str(name): float(column[k]) for name, column in columns.items()}
                self._known[chosen] = Trial(figures, bool(feasible[k]))
        return [self._known[chosen] for chosen in sets]
