"""One problem for a value that fits no member of a union, where pydantic reports one per member."""

from __future__ import annotations

from gelslim_core.yaml.nodes import PathPart
from gelslim_core.yaml.place import Complaint

_LIMITS = frozenset(("greater_than", "greater_than_equal", "less_than", "less_than_equal"))


def settle_unions(complaints: list[Complaint]) -> list[Complaint]:
    """`complaints` with those of one union at one place reduced to the member meant.

    A union's members are labels in the location that name no node. Of several members the one
    whose complaints go deepest was meant, then the one with fewest; for a plain value it is the
    one whose limits the value breaks, as its type was right.
    """
    groups: dict[tuple[PathPart, ...], dict[PathPart, list[Complaint]]] = {}
    settled: list[Complaint] = []
    for complaint in complaints:
        label = _label(complaint)
        if label is None:
            settled.append(complaint)
        else:
            base = complaint.place.parts[: complaint.place.depth]
            groups.setdefault(base, {}).setdefault(label, []).append(complaint)
    for base, members in groups.items():
        settled += _meant(base, list(members.values()))
    return settled


def _label(complaint: Complaint) -> PathPart | None:
    labels = complaint.place.labels
    if complaint.kind == "missing":
        labels = labels[:-1]
    return labels[0] if labels else None


def _meant(base: tuple[PathPart, ...], members: list[list[Complaint]]) -> list[Complaint]:
    if len(members) == 1:
        return members[0]
    deep = [m for m in members if all(_is_deep(base, complaint) for complaint in m)]
    if deep:
        return min(deep, key=lambda m: (_wrong_kinds(m), len(m)))
    flat = [complaint for member in members for complaint in member]
    limits = [complaint for complaint in flat if complaint.kind in _LIMITS]
    literals = [complaint for complaint in flat if complaint.kind == "literal_error"]
    return (limits or literals or flat)[:1]


def _is_deep(base: tuple[PathPart, ...], complaint: Complaint) -> bool:
    # A rule of a member is only looked at when all else of it fits.
    deep_kinds = ("missing", "value_error", "assertion_error")
    return len(complaint.place.parts) > len(base) or complaint.kind in deep_kinds


def _wrong_kinds(member: list[Complaint]) -> int:
    return sum(complaint.kind == "literal_error" for complaint in member)
