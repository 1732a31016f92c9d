"""What to change so that enough fingers keep every rule: one change after the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec import Spec
from gelslim_cad.tolerance.margins import RULES
from gelslim_cad.tolerance.yields import ALL, Yield, yield_of

Change = Mapping[str, Any]
MOST_STEPS = 12
LEAST_GAIN = 0.005
"""Gain of yield below which a change is not worth a step."""
FREE_MM = 0.02
"""Thickness below which a change costs none."""
MARGIN_PATH, BORDER_PATH = "design.optics.image_margin", "design.mirror.border_mm"
MARGIN_STEP, BORDER_STEP_MM, BACK_WALL_STEP_MM = 0.01, 0.3, 0.1
LARGEST_MARGIN, MARGIN_FOUND = 0.3, 5e-4
COVERAGE = ("coverage.along", "coverage.across", "coverage.markers")
SHIMMED_MM = 0.05
"""Play of a camera between shims, or in a clamp that is fitted to it."""
PRICE_STEP = 0.005


@dataclass(frozen=True)
class Step:
    """One change of the spec and what it leads to.

    Attributes:
        words: The change for people; empty for the spec as it is.
        change: Fields of the spec by path with their new values.
        thickness_mm: Thickness of the finger with this and all earlier changes.
        yields: Yields with them, by rule.
    """

    words: str
    change: Change
    thickness_mm: float
    yields: Mapping[str, Yield]

    @property
    def share(self) -> float:
        """Share of fingers that keep every rule."""
        return self.yields[ALL].share

    def worst_rule(self) -> str:
        """The rule that the fewest fingers keep."""
        return min((r for r in self.yields if r in RULES), key=lambda r: self.yields[r].share)


@dataclass(frozen=True)
class Plan:
    """Changes in order, each the best next one; the first step is the spec as it is.

    Attributes:
        wanted: The yield that was asked for.
        steps: The steps.
        reached: Whether the last step has that yield.
    """

    wanted: float
    steps: tuple[Step, ...]

    @property
    def reached(self) -> bool:
        """Whether the last step has the yield that was asked for."""
        return self.steps[-1].share >= self.wanted

    def changes(self) -> dict[str, Any]:
        """All fields to change, with their last values."""
        return {path: value for step in self.steps for path, value in step.change.items()}


def with_values(spec: Spec, values: Change) -> Spec:
    """The spec with other values at some paths. Raises ValueError where it does not accept them."""
    content = spec.model_dump()
    for path, value in values.items():
        *blocks, last = path.split(".")
        inner = content
        for block in blocks:
            inner = inner[block]
        inner[last] = value
    return Spec.model_validate(content)


def plan(spec: Spec, wanted: float, count: int, seed: int, d: Dimensions | None = None) -> Plan:
    """Look for changes of a spec that give a yield; free ones first, then by yield per mm.

    Args:
        spec: The finger.
        wanted: The yield to reach, from 0 to 1.
        count: Number of samples.
        seed: Their seed.
        d: Dimensions of the spec, where they are known already.

    Returns:
        The changes with yield and thickness after each. An image margin that was changed is in
        the end the least that reaches the yield.
    """
    steps = [_step("", {}, derive(spec) if d is None else d, count, seed)]
    while steps[-1].share < wanted and len(steps) <= MOST_STEPS:
        best = _best(spec, steps[-1], count, seed)
        if best is None:
            break
        steps.append(best)
        spec = with_values(spec, best.change)
    done = Plan(wanted, tuple(steps))
    return _trimmed(spec, done, count, seed) if MARGIN_PATH in done.changes() else done


def _step(words: str, change: Change, d: Dimensions, count: int, seed: int) -> Step:
    return Step(words, change, d["finger.thickness_mm"], yield_of(d, count, seed))


def _best(spec: Spec, now: Step, count: int, seed: int) -> Step | None:
    """The change that gains most yield for the thickness it costs; None where none gains."""
    failing = {c.id for c in check(derive(spec)) if c.status == "fail"}
    tried = [
        step
        for words, change in _changes(spec)
        if (step := _tried(spec, words, change, failing, count, seed)) is not None
        and step.share - now.share >= LEAST_GAIN
    ]

    def worth(step: Step) -> tuple[bool, float]:
        cost = step.thickness_mm - now.thickness_mm
        gain = step.share - now.share
        return cost <= FREE_MM, gain if cost <= FREE_MM else gain / cost

    return max(tried, key=worth, default=None)


def _tried(
    spec: Spec, words: str, change: Change, failing: set[str], count: int, seed: int
) -> Step | None:
    """A change with its yield; None where the spec or a further design rule forbids it."""
    try:
        d = derive(with_values(spec, change))
    except ValueError:
        return None
    if any(c.status == "fail" and c.id not in failing for c in check(d)):
        return None
    return _step(words, change, d, count, seed)


def _changes(spec: Spec) -> Iterator[tuple[str, Change]]:
    optics, tolerance = spec.design.optics, spec.tolerance
    if not tolerance.adjusted:
        yield "Adjust camera and lens by the live picture", {"tolerance.adjusted": True}
    if tolerance.acrylic != "measured":
        yield "Measure the acrylic, and give its thickness", {"tolerance.acrylic": "measured"}
    loose, play = spec.design.housing.camera_seat == "loose", spec.design.housing.camera_play_mm
    if loose:
        words = "Press the camera against points by springs"
        yield words, {"design.housing.camera_seat": "preloaded"}
    if loose and (spec.design.housing.fit_clearance_mm if play is None else play) > SHIMMED_MM:
        path = "design.housing.camera_play_mm"
        yield f"Shim the camera to {SHIMMED_MM:g} mm of play", {path: SHIMMED_MM}
    margin = round(min(optics.image_margin + MARGIN_STEP, LARGEST_MARGIN), 4)
    yield f"Image margin {margin:g}", {MARGIN_PATH: margin}
    border = round(min(spec.design.mirror.border_mm + BORDER_STEP_MM, 5.0), 3)
    yield f"Mirror border {border:g} mm", {BORDER_PATH: border}
    both = {MARGIN_PATH: margin, BORDER_PATH: border}
    yield f"Image margin {margin:g} and mirror border {border:g} mm", both
    blur = round(0.9 * optics.blur_per_diameter, 3)
    yield (
        f"Blur of {blur:g} marker diameters at most",
        {"design.optics.blur_per_diameter": blur},
    )
    wall = round(spec.design.housing.back_wall_mm - BACK_WALL_STEP_MM, 3)
    if spec.design.envelope.max_thickness_mm is not None:
        yield f"Back wall {wall:g} mm", {"design.housing.back_wall_mm": wall}
        more = round(1.1 * optics.blur_per_diameter, 3)
        words = f"Blur of {more:g} marker diameters, for a thinner finger"
        yield words, {"design.optics.blur_per_diameter": more}
    px = round(1.05 * optics.min_px_per_marker, 2)
    yield f"{px:g} px per marker at least", {"design.optics.min_px_per_marker": px}


def _trimmed(spec: Spec, done: Plan, count: int, seed: int) -> Plan:
    """The plan with the image margin, in the end, no larger than it must be."""
    if not done.reached:
        return done
    margin = least_margin(spec, done.wanted, count, seed)
    if margin is None or margin > spec.design.optics.image_margin - MARGIN_FOUND:
        return done
    last, words, change = (
        done.steps[-1],
        f"Image margin {margin:g} is enough",
        {MARGIN_PATH: margin},
    )
    kept = done.steps
    if MARGIN_PATH in last.change:
        named = f"Image margin {last.change[MARGIN_PATH]:g}"
        words = last.words.replace(named, f"Image margin {margin:g}")
        change, kept = {**last.change, **change}, done.steps[:-1]
    final = _step(words, change, derive(with_values(spec, change)), count, seed)
    return Plan(done.wanted, (*kept, final))


def least_margin(
    spec: Spec,
    wanted: float,
    count: int,
    seed: int,
    *,
    low: float = 0.0,
    rules: tuple[str, ...] = (ALL,),
) -> float | None:
    """The least `image_margin` with which every one of some rules reaches a yield, by bisection.

    Args:
        spec: The finger; its own margin does not count.
        wanted: The yield.
        count: Number of samples.
        seed: Their seed, the same for every margin, so that the yield rises with the margin.
        low: A margin that is known to be too small.
        rules: The rules, or `ALL` for all of them together.

    Returns:
        The margin to `MARGIN_FOUND`; None where no legal margin reaches the yield.
    """

    def enough(margin: float) -> bool:
        found = yield_of(derive(with_values(spec, {MARGIN_PATH: margin})), count, seed)
        return all(found[rule].share >= wanted for rule in rules if rule in found)

    high = LARGEST_MARGIN
    for margin in (spec.design.optics.image_margin, 0.05, 0.1, 0.2, LARGEST_MARGIN):
        if margin > low and enough(margin):
            high = margin
            break
    else:
        return None
    if enough(low):
        return low
    while high - low > MARGIN_FOUND:
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return round(high + MARGIN_FOUND / 2, 4)


def thickness_per_percent(spec: Spec, d: Dimensions, count: int, seed: int) -> float | None:
    """Thickness in mm that a per cent of yield costs, by a small step of the image margin.

    None where the step gains nothing, or no such finger exists.
    """
    margin = spec.design.optics.image_margin + PRICE_STEP
    if margin > LARGEST_MARGIN:
        return None
    more = derive(with_values(spec, {MARGIN_PATH: margin}))
    gain = 100 * (yield_of(more, count, seed)[ALL].share - yield_of(d, count, seed)[ALL].share)
    if not more.feasible() or gain <= 0:
        return None
    return (more["finger.thickness_mm"] - d["finger.thickness_mm"]) / gain
