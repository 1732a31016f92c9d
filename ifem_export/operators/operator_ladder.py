"""Surface operators of one sensor with their measured error and time, and the choice among them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from gelslim_core.budget.budget import Budget, shown_share
from gelslim_core.budget.ladder import Choice, Ladder, Rung, Wording
from ifem_export.errors import IfemError
from ifem_export.operators.surface_operator import Rung as OperatorName

BALANCE, ENOUGH = 1.1, 0.03
WORDING = Wording(
    "operator", "field error", "per frame", "more layers or a finer pitch make smaller errors"
)


def operator_label(rung: str, parameters: Mapping[str, float]) -> str:
    """Name of an operator with its parameters."""
    inside = ", ".join(f"{k} {v:g}" for k, v in parameters.items())
    return f"{rung} ({inside})" if inside else rung


@dataclass(frozen=True)
class MeasuredRung:
    """One operator. Errors are relative: of the field (L2, worst of the fields) and resultant.

    `error_edge` is that of fields that reach the pad's edge, which `error_field` leaves out; None
    where nobody measured it. `error_operator` is against exact condensation on the same mesh,
    without the mesh's own error.
    `noise_…` are gains: standard deviation of a force component, at a node and of the resultant,
    per mm of independent noise on every surface displacement.
    """

    rung: OperatorName
    parameters: Mapping[str, float]
    error_field: float
    error_operator: float
    error_resultant: float
    noise_node_n_per_mm: float
    noise_resultant_n_per_mm: float
    milliseconds: float
    n_bytes: int
    error_edge: float | None = None

    @property
    def label(self) -> str:
        """Name with parameters."""
        return operator_label(self.rung, self.parameters)


@dataclass(frozen=True)
class OperatorLadder:
    """Rungs of one sensor as they were measured, and what they were measured against."""

    rungs: tuple[MeasuredRung, ...]
    reference: str
    layers: int
    formulation: str
    poissons_ratio: float

    @property
    def choices(self) -> Ladder:
        """The rungs by label, to choose from.

        The work of an operator is the memory that a call goes through: it is counted, and orders
        the operators as the clock does (`docs/data/stiffness_ladder.json`).
        """
        rungs = tuple(Rung(r.label, r.error_field, r.milliseconds, r.n_bytes) for r in self.rungs)
        return Ladder(rungs, WORDING)

    def choose(self, budget: Budget) -> Choice:
        """The operator's label for a budget, kept by motions that stay off the pad's edge.

        Where the edge errs more than asked, a remark says so. Raises BudgetError where none keeps
        the budget.
        """
        choice = self.choices.choose(budget)
        return replace(choice, remarks=(*choice.remarks, *self._at_edge(choice.rung, budget)))

    def named(self, label: str) -> MeasuredRung | None:
        """The rung called `label`, if there is one."""
        return next((r for r in self.rungs if r.label == label), None)

    def balanced(self) -> MeasuredRung:
        """What a bundle starts with: least work within 3 % or a tenth of the smallest error.

        Markers a millimetre apart leave more than 3 % open, whatever the operator.
        """
        most = max(ENOUGH, BALANCE * min(r.error_field for r in self.rungs))
        return next(r for r in self._by_work() if r.error_field <= most)

    def timed(self, times_ms: Mapping[str, float]) -> OperatorLadder:
        """The same rungs with other times, by label; errors stay. Others keep their times."""
        rungs = (replace(r, milliseconds=times_ms.get(r.label, r.milliseconds)) for r in self.rungs)
        return replace(self, rungs=tuple(rungs))

    def to_record(self) -> dict[str, Any]:
        """Plain data."""
        return {**asdict(self), "rungs": [asdict(r) for r in self.rungs]}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> OperatorLadder:
        """From plain data; raises IfemError where it is malformed."""
        try:
            rungs = tuple(MeasuredRung(**r) for r in record["rungs"])
            return cls(**{**record, "rungs": rungs})
        except (KeyError, TypeError) as error:
            raise IfemError(f"the ladder is malformed ({error!r})") from error

    def _at_edge(self, rung: Rung, budget: Budget) -> tuple[str, ...]:
        found = self.named(rung.name)
        if found is None or found.error_edge is None or budget.allows_error(found.error_edge):
            return ()
        told = (
            f"where the motion reaches the gel's edge the field error of {rung.name} is "
            f"{shown_share(found.error_edge)}, outside the calibrated range"
        )
        edges = [(r.error_edge, r) for r in self._by_work() if r.error_edge is not None]
        for error, other in edges:
            if budget.allows(max(error, other.error_field), other.milliseconds):
                return (f"{told}; {other.label} keeps the budget there too",)
        least, best = min(edges, key=lambda pair: pair[0])
        return (f"{told}; least there has {best.label}, {shown_share(least)}",)

    def _by_work(self) -> list[MeasuredRung]:
        return sorted(self.rungs, key=lambda r: r.n_bytes)


def chosen_rung(
    ladder: OperatorLadder | None, label: str, budget: Budget | None = None
) -> MeasuredRung | None:
    """Rung for a budget; without one the rung called `label`, else None.

    Raises BudgetError where none keeps it, IfemError for a budget without a ladder.
    """
    if budget is None or budget.unlimited:
        return ladder.named(label) if ladder else None
    if ladder is None:
        raise IfemError("this bundle holds no measured ladder: build it with one, or name a rung")
    return ladder.named(ladder.choose(budget).rung.name)
