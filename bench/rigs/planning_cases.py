"""One scene planned and carried out: time and error of the planner's choice, everything on beside.

Times are CPU time of one process with one thread. Poses are all solved; of the pictures four are
drawn, and their mean time counts for every pose. Both plans find the compliance of the pad on disk.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from agreement import Outcome, Trial
from random_contact_scenes import random_contact

from bench.rigs.twin_rig import mechanics_key
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.grey_sizes import SHADING
from gelslim_twin.planning.plan import Plan, summed_error
from gelslim_twin.planning.planner import make_plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.scene_task import planned, viewer_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor
from ifem_export.compliance.columns import SurfaceCompliance

Made = TypeVar("Made")
LONGER = 4
"""Factor on the poses of a random scene, which has few."""
FRAMES = 4


def spent(make: Callable[[], Made]) -> tuple[Made, float]:
    """What a call returns, and its CPU time in ms."""
    started = time.process_time()
    made = make()
    return made, 1000 * (time.process_time() - started)


@dataclass(frozen=True)
class Run:
    """A scene carried out by a plan."""

    outcome: Outcome
    gel_ms: float
    frames_ms: float

    @property
    def ms(self) -> float:
        """Of all poses and frames."""
        return self.gel_ms + self.frames_ms


@dataclass(frozen=True)
class Case:
    """A scene on its sensor, with every effect left to the planner."""

    trial: Trial
    kept: dict[str, tuple[GelState, ...]] = field(default_factory=dict)
    """States by `mechanics_key`: equal mechanics are solved once where time is no matter."""

    @classmethod
    def of_gallery(cls, loaded: LoadedScene, sensor: TwinSensor, folder: Path) -> Case:
        """A scene of the gallery on its sensor, which `folder` keeps."""
        asked = question(loaded, bundle_figures(folder / BUNDLE))
        return cls(_left_to_planner(Trial(loaded, sensor, folder, asked)))

    @classmethod
    def of_seed(cls, seed: int, folder: Path) -> Case:
        """A random scene of the tests, with more poses."""
        finger, values = random_contact(seed)
        for move in values["motion"]["waypoints"]:
            move["steps"] *= LONGER
        return cls(_left_to_planner(Trial.of(finger, values, folder)))

    def with_tolerance(self, force_n: float, image_px: float) -> Case:
        """The same scene with another tolerance."""
        asked = replace(self.trial.asked, force_n=force_n, image_px=image_px)
        return Case(replace(self.trial, asked=asked), self.kept)

    @cached_property
    def whole(self) -> Plan:
        """Everything on that does something, each effect by the rung that the tolerance asks."""
        c = self.trial.asked.circumstances
        use = {e.name: "off" if e.is_null(c) and not e.provides else "on" for e in EFFECTS}
        # A compressed picture is rounded, and two that hardly differ may be rounded apart.
        use["compression"] = "off"
        given = {n: p.model_copy(update={"use": use[n]}) for n, p in c.parameters.items()}
        asked = replace(self.trial.asked, circumstances=replace(c, parameters=given))
        return _observed(make_plan(asked), self.trial.asked.observe)

    def chosen(self, pad: SurfaceCompliance) -> Plan:
        """The planner's choice, with a probe where it pays."""
        viewer = partial(viewer_of, self.trial.loaded, self.trial.sensor)
        return planned(self.trial.loaded, self.trial.asked, lambda: pad, viewer)

    def run(
        self, plan: Plan, pad: SurfaceCompliance | None = None, known: Run | None = None
    ) -> Run:
        """Solve all poses, and draw some pictures where they are observed. Raises ContactError.

        `pad` is the compliance that a probe has used, as in a simulation; by default it is read.
        The gel of a `known` run by a plan with the same mechanics is not solved again: its time
        would differ by the load of the machine only.
        """
        poses, pad = self.trial.poses, pad or self.trial.compliance

        def solved() -> tuple[GelState, ...]:
            return tuple(mechanics_of(self.trial.loaded, plan, pad).states(poses))

        if known is not None and mechanics_key(known.outcome.plan) == mechanics_key(plan):
            states, gel_ms = known.outcome.states, known.gel_ms
        else:
            states, gel_ms = spent(solved)
        self.kept[mechanics_key(plan)] = states
        outcome = self.trial.carried_out(plan, states)
        seen = {"markers", "image"} & {*self.trial.asked.observe}
        if not seen:
            return Run(outcome, gel_ms, 0.0)
        at = np.unique(np.linspace(0, len(poses) - 1, FRAMES).astype(int))
        self._draw(outcome, int(at[-1]))
        each = [spent(lambda k=int(k): self._draw(outcome, k))[1] for k in at]
        return Run(outcome, gel_ms, float(np.mean(each)) * len(poses))

    def outcome(self, plan: Plan) -> Outcome:
        """The scene carried out by a plan, without its times. Raises ContactError."""
        key = mechanics_key(plan)
        found = self.trial.carried_out(plan, self.kept.get(key, ()))
        self.kept[key] = found.states
        return found

    def draw_once(self, outcome: Outcome) -> None:
        """Draw a picture, so that no time counts what is computed once for a camera."""
        if {"markers", "image"} & {*self.trial.asked.observe}:
            self._draw(outcome, len(outcome.states) - 1)

    def _draw(self, outcome: Outcome, at: int) -> None:
        outcome.dots_px(at)
        if "image" in self.trial.asked.observe:
            before = outcome.states[at - 1] if at else None
            outcome.viewer.frame(outcome.states[at], before, at, outcome.step_s(at))

    def used(self, found: Outcome, whole: Outcome) -> dict[str, float]:
        """Per observable, the error against everything on over the tolerance."""
        asked = self.trial.asked
        apart = self.trial.differences(whole, found, asked.observe)
        return {o: error / asked.tolerance(o) for o, error in apart.items()}


def without(plan: Plan, effect: str) -> Plan:
    """The same plan without an effect."""
    return replace(plan, order=tuple(name for name in plan.order if name != effect))


def optional(plan: Plan) -> tuple[str, ...]:
    """The effects of a plan that might be left out."""
    provides = {e.name for e in EFFECTS if e.provides}
    return tuple(name for name in plan.order if name not in provides)


def _promised(plan: Plan, observable: str) -> float:
    """The combined error of all effects but compression, which neither plan includes."""
    counted = [c for c in plan.choices if c.shares and c.effect != "compression"]
    return summed_error(counted, observable)


def _observed(plan: Plan, observe: tuple[str, ...]) -> Plan:
    """The plan without effects on which nothing observed depends."""
    seen = {"force", "displacement"}
    seen |= {"markers"} if {"markers", "image"} & {*observe} else set()
    seen |= {"image"} if "image" in observe else set()
    kept = {e.name for e in EFFECTS if seen & {*e.provides, *e.refines}}
    return replace(plan, order=tuple(name for name in plan.order if name in kept))


def _left_to_planner(trial: Trial) -> Trial:
    c = trial.asked.circumstances
    given = {n: p.model_copy(update={"use": "auto"}) for n, p in c.parameters.items()}
    given["compression"] = given["compression"].model_copy(update={"use": "off"})
    asked = replace(trial.asked, circumstances=replace(c, parameters=given))
    return replace(trial, asked=asked)


def prepared(case: Case) -> None:
    """Put the compliance of the pad on disk, which no time counts, by solving a linear gel."""
    case.outcome(without(case.whole, "nonlinearity"))


def measured(
    case: Case, level: float | None, every: Run, with_needless: bool = True
) -> dict[str, Any]:
    """The row of a case: times, used tolerance, and effects kept without need.

    Args:
        case: The scene with its tolerance.
        level: Relative tolerance that was asked for, None for the scene's own.
        every: Everything on, carried out.
        with_needless: Whether effects are left out one by one, and then as many as possible of
            those found needless at once, which takes long at large strain.

    Raises:
        ContactError: A contact is not solved.
    """
    asked = case.trial.asked
    pad = case.trial.compliance
    plan, planning_ms = spent(lambda: case.chosen(pad))
    run = case.run(plan, pad, every)
    used = case.used(run.outcome, every.outcome)
    doubtful = 0.0
    if "image" in asked.observe:
        pair = (every.outcome, run.outcome, ("image",))
        doubtful = case.trial.differences(*pair, doubtful=True)["image"] / asked.image_px
    kept = optional(plan)
    needless, at_once = list[str](), plan

    def is_kept(less: Plan, name: str) -> bool:
        """Whether a plan without an effect keeps the tolerance."""
        found = case.outcome(less)
        if max(case.used(found, every.outcome).values()) > 1.0:
            return False
        apart_px = case.trial.light_apart_px if name == SHADING else None
        return apart_px is None or apart_px(run.outcome, found) <= asked.image_px

    for name in kept if with_needless else ():
        if is_kept(without(plan, name), name):
            needless.append(name)
            # Several effects that are needless one by one may share what is left of the tolerance.
            if len(needless) == 1 or is_kept(without(at_once, name), name):
                at_once = without(at_once, name)
    return {
        "level": level,
        "observe": list(asked.observe),
        "force_n": asked.force_n,
        "image_px": asked.image_px,
        "poses": len(case.trial.poses),
        "whole": list(case.whole.order),
        "whole_ms": every.ms,
        "chosen": {c.effect: c.rung for c in plan.included},
        "probed": plan.probe_ms > 0,
        "ms": run.ms,
        "planning_ms": planning_ms,
        "used": used,
        "with_doubtful": max(doubtful, *used.values()),
        "promised": {o: _promised(plan, o) / asked.tolerance(o) for o in asked.observe},
        "over": [o for o, _ in plan.over_tolerance],
        "kept": len(kept),
        "needless": needless if with_needless else None,
        "needless_at_once": len(kept) - len(optional(at_once)) if with_needless else None,
    }
