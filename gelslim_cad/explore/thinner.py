"""Ways to a thinner finger, one field each, and the price of every one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.checks import margins_batch
from gelslim_cad.checks.relaxation import derive_each, given, relaxations
from gelslim_cad.explore.brightness import RAYS
from gelslim_cad.explore.force_error import MARKER_NOISE_PX
from gelslim_cad.explore.price import Measured, Price, measured, prices
from gelslim_cad.explore.space import ExploreError, changed, illegal
from gelslim_cad.spec import Spec

LIMIT_FIELD, LIMIT_RULE = "design.envelope.max_thickness_mm", "finger.thickness_mm"
LEAST_SAVING_MM, EQUAL_MM = 0.02, 0.005
MOST_STEPS, PER_STEP = 16, 4
"""How far one field may give way, in usual steps, and values tried per step."""
CLOSER = 32
"""Values between the last that misses and the first that reaches."""
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Concession:
    """One field that gives way: the finger it leaves and what it costs.

    `breaks` names the rules that forbid it, in which case light and force error are not known.
    `reaches` tells whether the finger is as thin as asked; True where no thickness was asked for.
    """

    path: str
    before: float
    after: float
    thickness_mm: float
    prices: tuple[Price, ...]
    breaks: tuple[str, ...]
    reaches: bool


@dataclass(frozen=True)
class Offer:
    """The finger as it is, and its concessions, the cheapest in force error or thinnest first."""

    present: Measured
    concessions: tuple[Concession, ...]
    to_mm: float | None

    @property
    def present_mm(self) -> float:
        """Thickness of the finger in mm."""
        return float(self.present.figures["finger.thickness_mm"] or 0.0)


def thinner(
    spec: Spec,
    to_mm: float | None = None,
    rays: int = RAYS,
    noise_px: float = MARKER_NOISE_PX,
) -> Offer:
    """What each field alone buys in thickness, and its price against the finger as it is.

    Without `to_mm` every field gives way by its usual step (`gelslim_cad.checks.relaxation`). With
    it, a field gives way by as little as makes the finger so thin while every rule holds, or else
    by what makes it thinnest.
    The spec's own limit on thickness is left aside. Raises ExploreError where the finger is as thin
    already, or breaks a rule, so that there is nothing to compare with.
    """
    free = changed(spec, {LIMIT_FIELD: None})
    present = measured(free, rays, noise_px)
    if present.failed:
        raise ExploreError(
            f"the finger as it is breaks {', '.join(present.failed)}; mend that first: "
            "`gelslim check` says how"
        )
    thickness = float(present.figures["finger.thickness_mm"] or 0.0)
    if to_mm is not None and thickness <= to_mm:
        raise ExploreError(f"the finger is {thickness:.2f} mm thick, no more than {to_mm:g} mm")
    chosen = _steps(free) if to_mm is None else _as_far_as(free, to_mm)
    found = []
    for path, value in chosen.items():
        after = measured(changed(free, {path: value}), rays, noise_px)
        mm = float(after.figures["finger.thickness_mm"] or 0.0)
        if thickness - mm >= LEAST_SAVING_MM:
            reaches = not after.failed and (to_mm is None or mm <= to_mm)
            cost = prices(present, after)
            old = float(given(free, path))
            found.append(Concession(path, old, value, mm, cost, after.failed, reaches))
    return Offer(present, tuple(sorted(found, key=_order)), to_mm)


def _order(c: Concession) -> tuple[bool, bool, float]:
    return not c.reaches, bool(c.breaks), c.thickness_mm


def _steps(spec: Spec) -> dict[str, float]:
    return {s.path: s.value for s in relaxations(spec) if not illegal(spec, {s.path: s.value})}


def _as_far_as(spec: Spec, to_mm: float) -> dict[str, float]:
    """Per field the least change that reaches `to_mm`, or the thinnest allowed on the way."""
    tried = {}
    for step in relaxations(spec):
        start = float(given(spec, step.path))
        pace = (step.value - start) / PER_STEP
        values = [start + k * pace for k in range(1, MOST_STEPS * PER_STEP + 1)]
        tried[step.path] = [v for v in values if not illegal(spec, {step.path: v})]
    chosen: dict[str, float] = {}
    closer: dict[str, list[float]] = {}
    for path, (thickness, holds) in _judged(spec, tried).items():
        values = tried[path]
        good = np.flatnonzero(holds & (thickness <= to_mm))
        if good.size:
            last = values[good[0] - 1] if good[0] else float(given(spec, path))
            closer[path] = list(np.linspace(last, values[good[0]], CLOSER + 1)[1:])
        elif values:
            allowed = np.where(holds, thickness, np.inf) if holds.any() else thickness
            # The first of equals: what gives way further for nothing is not needed.
            chosen[path] = values[int(np.argmax(allowed <= allowed.min() + EQUAL_MM))]
    for path, (thickness, holds) in _judged(spec, closer).items():
        first = int(np.flatnonzero(holds & (thickness <= to_mm))[0])
        chosen[path] = closer[path][first]
    return chosen


def _judged(
    spec: Spec, tried: Mapping[str, Sequence[float]]
) -> dict[str, tuple[NDArray[np.float64], Flags]]:
    """Per field thickness and whether every rule holds, for each value tried, in one batch."""
    places = [(path, v) for path, values in tried.items() for v in values]
    if not places:
        return {}
    d = derive_each(spec, [{path: v} for path, v in places])
    holds = np.all([m >= 0 for n, m in margins_batch(d).items() if n != LIMIT_RULE], axis=0)
    owner = np.array([p for p, _ in places])
    thickness = np.asarray(d["finger.thickness_mm"], dtype=float)
    return {path: (thickness[owner == path], holds[owner == path]) for path in tried}
