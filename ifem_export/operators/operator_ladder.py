"""Surface operators of one sensor with measured error and time, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from gelslim_core.budget.budget import Budget, BudgetError, shown_share
from gelslim_core.budget.ladder import Choice, Ladder, Rung, Wording
from ifem_export.errors import IfemError
from ifem_export.operators.surface_operator import Rung as OperatorName

BALANCE, ENOUGH = 1.1, 0.03
WORDING = Wording(
    "operator", "error", "per frame", "more layers or a finer pitch make smaller errors"
)


_ERRORS = ("error_field", "error_operator", "error_resultant", "error_edge")
_GAINS = ("noise_node_n_per_mm", "noise_resultant_n_per_mm")


CONTACTS = {
    "small_ball": "a small ball",
    "sharp_punch": "a sharp punch",
    "edge": "a contact at the edge",
    "two_contacts": "two contacts",
}
"""Contacts of `ifem_export.operators.ladder_contacts` in words."""
_UNMEASURED = (
    "this ladder is of an older release and was measured on smooth motions only; build the bundle "
    "again for errors of small and sharp contacts"
)


@dataclass(frozen=True)
class ContactError:
    """Relative errors of the force field (L2) and of the resultant of one contact."""

    field: float
    resultant: float

    @property
    def worst(self) -> float:
        """The larger one."""
        return max(self.field, self.resultant)


def _rounded(rung: MeasuredRung) -> dict[str, Any]:
    """Errors to 1e-6 and gains to four digits, by name."""
    errors = {name: getattr(rung, name) for name in _ERRORS}
    gains = {name: float(f"{getattr(rung, name):.4g}") for name in _GAINS}
    contacts = {
        name: ContactError(round(e.field, 6), round(e.resultant, 6))
        for name, e in rung.contacts.items()
    }
    rounded = {n: None if v is None else round(v, 6) for n, v in errors.items()}
    return {**gains, **rounded, "contacts": contacts}


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
        error_field: L2 error of the force field, for smooth motions that do not reach the edge.
        error_operator: The same against exact condensation on the same mesh, which leaves out the
            error of the mesh.
        error_resultant: Error of the resultant of these motions.
        noise_node_n_per_mm: Standard deviation of a force component at a node per mm of
            independent noise on every surface displacement.
        noise_resultant_n_per_mm: The same for a component of the resultant.
        milliseconds: Median time of a call on one thread.
        n_bytes: Memory that a call reads.
        error_edge: L2 error for smooth motions that reach the pad's edge; None if it was not
            measured.
        contacts: Errors of `CONTACTS` by name; empty in ladders of older releases.
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
    contacts: Mapping[str, ContactError] = field(default_factory=dict)

    @property
    def time_ms(self) -> float:
        """Time of one call in ms; NaN where it was not measured."""
        return math.nan if self.milliseconds is None else self.milliseconds

    @property
    def error(self) -> float:
        """The largest error of field and resultant over all motions, which a budget is about."""
        return max(self.errors.values())

    @property
    def errors(self) -> dict[str, float]:
        """The larger error of field and resultant of each kind of motion; smooth is the first."""
        found = {"smooth": max(self.error_field, self.error_resultant)}
        found |= {name: e.worst for name, e in self.contacts.items()}
        if self.error_edge is not None:
            found["edge"] = max(self.error_edge, found.get("edge", 0.0))
        return found

    @property
    def worst_resultant(self) -> float:
        """Largest error of the resultant over all motions."""
        return max([self.error_resultant, *(e.resultant for e in self.contacts.values())])

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> MeasuredRung:
        """The rung from plain data. Raises TypeError if these are malformed."""
        contacts = {name: ContactError(**e) for name, e in record.get("contacts", {}).items()}
        return cls(**{**record, "contacts": contacts})

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
        """Choose the operator for a budget of its worst error over all motions.

        Args:
            budget: Allowed error and time.

        Returns:
            The choice; a remark tells if contacts were not measured.

        Raises:
            BudgetError: No operator keeps the budget.
        """
        try:
            choice = self.choices.choose(budget)
        except BudgetError as error:
            raise BudgetError(f"{error}{self._limiting(budget)}") from error
        if budget.error is None or all(rung.contacts for rung in self.rungs):
            return choice
        return replace(choice, remarks=(*choice.remarks, _UNMEASURED))

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
        rounded = self.rounded()
        return replace(rounded, rungs=tuple(replace(r, milliseconds=None) for r in rounded.rungs))

    def rounded(self) -> OperatorLadder:
        """The ladder with errors and gains rounded, so that every machine makes the same choice."""
        return replace(self, rungs=tuple(replace(r, **_rounded(r)) for r in self.rungs))

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
            rungs = tuple(MeasuredRung.from_record(r) for r in record["rungs"])
            return cls(**{**record, "rungs": rungs})
        except (AttributeError, KeyError, TypeError) as error:
            raise IfemError(f"the ladder is malformed ({error!r})", field="ladder") from error

    def _limiting(self, budget: Budget) -> str:
        """What keeps the most accurate operator from a budget of error that it keeps else."""
        best = min(self.rungs, key=lambda r: r.error)
        if budget.allows_error(best.error):
            return ""
        worst = max(best.errors, key=lambda name: best.errors[name])
        smooth = best.errors["smooth"]
        if worst not in CONTACTS or not budget.allows_error(smooth):
            return ""
        return (
            f"; the error of {best.label} is {shown_share(best.error)} under {CONTACTS[worst]} and "
            f"{shown_share(smooth)} for smooth motions"
        )

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
