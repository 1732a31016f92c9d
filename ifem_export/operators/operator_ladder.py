"""Surface operators of one sensor with measured error and time, and the choice among them."""

from __future__ import annotations

import math
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


_ERRORS = ("error_field", "error_operator", "error_resultant", "error_edge")
_GAINS = ("noise_node_n_per_mm", "noise_resultant_n_per_mm")


def _rounded(rung: MeasuredRung) -> dict[str, Any]:
    """Errors to 1e-6 and gains to four digits, by name."""
    errors = {name: getattr(rung, name) for name in _ERRORS}
    gains = {name: float(f"{getattr(rung, name):.4g}") for name in _GAINS}
    return gains | {n: None if v is None else round(v, 6) for n, v in errors.items()}


def operator_label(rung: str, parameters: Mapping[str, float]) -> str:
    """Name of an operator with its parameters."""
    inside = ", ".join(f"{k} {v:g}" for k, v in parameters.items())
    return f"{rung} ({inside})" if inside else rung


@dataclass(frozen=True)
class MeasuredRung:
    """One measured operator. All errors are relative and the largest of several test motions.

    Attributes:
        rung: Name of the operator.
        parameters: Its parameters.
        error_field: L2 error of the force field, for motions that do not reach the pad's edge.
        error_operator: The same against exact condensation on the same mesh, which leaves out the
            error of the mesh.
        error_resultant: Error of the resultant.
        noise_node_n_per_mm: Standard deviation of a force component at a node per mm of
            independent noise on every surface displacement.
        noise_resultant_n_per_mm: The same for a component of the resultant.
        milliseconds: Median time of a call on one thread.
        n_bytes: Memory that a call reads.
        error_edge: L2 error for motions that reach the pad's edge; None if it was not measured.
    """

    rung: OperatorName
    parameters: Mapping[str, float]
    error_field: float
    error_operator: float
    error_resultant: float
    noise_node_n_per_mm: float
    noise_resultant_n_per_mm: float
    milliseconds: float | None
    n_bytes: int
    error_edge: float | None = None

    @property
    def time_ms(self) -> float:
        """Time of one call in ms; NaN where it was not measured."""
        return math.nan if self.milliseconds is None else self.milliseconds

    @property
    def error(self) -> float:
        """The larger of the errors of field and resultant, which a budget is about."""
        return max(self.error_field, self.error_resultant)

    @property
    def label(self) -> str:
        """Name with parameters."""
        return operator_label(self.rung, self.parameters)


@dataclass(frozen=True)
class OperatorLadder:
    """The measured surface operators of one sensor.

    Attributes:
        rungs: The operators.
        reference: Description of the reference solution.
        layers: Layers of cells of the pad.
        formulation: Hex-8 formulation.
        poissons_ratio: Poisson's ratio of the gel.
    """

    rungs: tuple[MeasuredRung, ...]
    reference: str
    layers: int
    formulation: str
    poissons_ratio: float

    @property
    def choices(self) -> Ladder:
        """The rungs by label, to choose from.

        The work of an operator is the memory that a call reads. It is counted rather than timed,
        and orders the operators as their times do (`docs/data/stiffness_ladder.json`).
        """
        rungs = tuple(Rung(r.label, r.error, r.time_ms, r.n_bytes) for r in self.rungs)
        return Ladder(rungs, WORDING)

    def choose(self, budget: Budget) -> Choice:
        """Choose the operator for a budget, which holds for motions that do not reach the edge.

        Args:
            budget: Allowed error and time.

        Returns:
            The choice; a remark tells if the error at the pad's edge is larger than allowed.

        Raises:
            BudgetError: No operator keeps the budget.
        """
        choice = self.choices.choose(budget)
        return replace(choice, remarks=(*choice.remarks, *self._edge_remarks(choice.rung, budget)))

    def named(self, label: str) -> MeasuredRung | None:
        """The rung with this label, or None."""
        return next((r for r in self.rungs if r.label == label), None)

    def balanced(self) -> MeasuredRung:
        """Default rung of a bundle: the least work with a small error.

        Small is an error of at most 3 %, or of at most 1.1 times the smallest error of the ladder.
        With markers a millimetre apart the interpolation alone has an error above 3 %.
        """
        most = max(ENOUGH, BALANCE * min(r.error for r in self.rungs))
        return next(r for r in self._by_work() if r.error <= most)

    def untimed(self) -> OperatorLadder:
        """Return the ladder as every machine finds it: without times, errors and gains rounded.

        The last digits are round-off, which differs between processors.
        """
        return replace(
            self,
            rungs=tuple(replace(r, milliseconds=None, **_rounded(r)) for r in self.rungs),
        )

    def timed(self, times_ms: Mapping[str, float]) -> OperatorLadder:
        """The same rungs with other times in ms, by label; rungs not named keep theirs."""
        rungs = (replace(r, milliseconds=times_ms.get(r.label, r.milliseconds)) for r in self.rungs)
        return replace(self, rungs=tuple(rungs))

    def to_record(self) -> dict[str, Any]:
        """The ladder as plain data for JSON."""
        return {**asdict(self), "rungs": [asdict(r) for r in self.rungs]}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> OperatorLadder:
        """The ladder from plain data. Raises IfemError if these are malformed."""
        try:
            rungs = tuple(MeasuredRung(**r) for r in record["rungs"])
            return cls(**{**record, "rungs": rungs})
        except (KeyError, TypeError) as error:
            raise IfemError(f"the ladder is malformed ({error!r})", field="ladder") from error

    def _edge_remarks(self, rung: Rung, budget: Budget) -> tuple[str, ...]:
        chosen = self.named(rung.name)
        if chosen is None or chosen.error_edge is None or budget.allows_error(chosen.error_edge):
            return ()
        remark = (
            f"where the motion reaches the gel's edge the field error of {rung.name} is "
            f"{shown_share(chosen.error_edge)}, outside the calibrated range"
        )
        edges = [(r.error_edge, r) for r in self._by_work() if r.error_edge is not None]
        for error, other in edges:
            if budget.allows(max(error, other.error), other.time_ms):
                return (f"{remark}; {other.label} keeps the budget there too",)
        least, best = min(edges, key=lambda pair: pair[0])
        return (f"{remark}; {best.label} has the smallest error there, {shown_share(least)}",)

    def _by_work(self) -> list[MeasuredRung]:
        return sorted(self.rungs, key=lambda r: r.n_bytes)


def chosen_rung(
    ladder: OperatorLadder | None, label: str, budget: Budget | None = None
) -> MeasuredRung | None:
    """The rung for a budget; without a budget the rung with this label, or None.

    Raises BudgetError if no rung keeps the budget, and IfemError for a budget without a ladder.
    """
    if budget is None or budget.unlimited:
        return ladder.named(label) if ladder else None
    if ladder is None:
        raise IfemError(
            "this bundle holds no measured ladder: build it with one, or name a rung",
            field="ladder",
        )
    return ladder.named(ladder.choose(budget).rung.name)
