"""The gallery's sensor and scenes, states solved once, and calls timed in turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.bench_data import ROOT
from bench.rigs.twin_effects import MECHANICS, Bench
from gelslim.scene_sensor import spec_bundle
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import make_plan
from gelslim_twin.planning.question import question
from gelslim_twin.planning.sensor_figures import bundle_figures
from gelslim_twin.scene.reader import LoadedScene, read_scene
from gelslim_twin.simulation.picture import Viewer
from gelslim_twin.simulation.scene_mechanics import mechanics_of
from gelslim_twin.simulation.sensor import BUNDLE, TwinSensor, store_sensor, stored_sensor

SPEC = ROOT / "designs" / "gelslim2.yaml"
SCENES = ROOT / "designs" / "scenes"
QUICK = ("press_sphere", "release")
SLOW_MS = 100.0
"""A call this slow is timed once: it is seconds in all, and noise is a small part of it."""

Use = Mapping[str, str]


def kept_sensor(folder: Path) -> TwinSensor:
    """The design's sensor with its traced light, stored in `folder`."""
    store_sensor(TwinSensor(spec_bundle(SPEC)), folder)
    return stored_sensor(folder)


def gallery(quick: bool) -> list[LoadedScene]:
    """Every scene of designs/scenes by name, or two."""
    paths = sorted(SCENES.glob("*.yaml"))
    return [read_scene(p) for p in paths if not quick or p.stem in QUICK]


def turns_ms(calls: Sequence[Callable[[], Any]], rounds: int) -> list[float]:
    """Median milliseconds of CPU of calls made in turns, so that a busy machine hinders all alike.

    CPU time of the process, which runs one thread: waiting for other work does not count. Nor does
    the first round (compiling, set-up).
    """
    spent = np.empty((rounds + 1, len(calls)))
    for row in spent:
        for k, call in enumerate(calls):
            started = time.process_time()
            call()
            row[k] = time.process_time() - started
    return [float(v) for v in 1000 * np.median(spent[1:], axis=0)]


def mechanics_key(plan: Plan) -> str:
    """Tells apart what plans make of the gel."""
    names = ("normal_contact", *MECHANICS)
    return repr([(c.effect, c.rung_parameters) for c in plan.included if c.effect in names])


def plan_key(plan: Plan) -> str:
    """Tells apart what plans do."""
    return repr([(c.effect, c.rung_parameters) for c in plan.included])


@dataclass(frozen=True)
class KeptBench(Bench):
    """A bench that solves equal mechanics once."""

    kept: dict[str, tuple[list[GelState], float]] = field(default_factory=dict, compare=False)

    def solved(self, **use: str) -> tuple[list[GelState], float]:
        """States and milliseconds per pose of the first time."""
        return self.states_of(self.plan(**use))

    def states_of(self, plan: Plan) -> tuple[list[GelState], float]:
        """The same for a plan."""
        key = mechanics_key(plan)
        if key not in self.kept:
            if "nonlinearity" not in plan.order:
                # The first time compiles, and makes columns of the compliance.
                self.solve(plan)
            started = time.process_time()
            states = self.solve(plan)
            self.kept[key] = states, 1000 * (time.process_time() - started) / len(states)
        return self.kept[key]

    def solve(self, plan: Plan) -> list[GelState]:
        """States of the poses, solved now."""
        contact = mechanics_of(self.loaded, plan, self.compliance)
        return list(contact.states(self.poses))

    def mechanics_ms(self, plans: Sequence[Plan], rounds: int) -> list[float]:
        """Per pose; mechanics whose first time was long are not solved again."""
        every = {mechanics_key(p): p for p in plans}
        found = {key: self.states_of(p)[1] for key, p in every.items()}
        brief = [key for key, ms in found.items() if ms < SLOW_MS]
        again = turns_ms([partial(self.solve, every[key]) for key in brief], rounds)
        found |= {k: ms / len(self.poses) for k, ms in zip(brief, again, strict=True)}
        return [found[mechanics_key(p)] for p in plans]

    @cached_property
    def asked(self) -> Any:
        """The scene's own question, every override of it back to `auto`."""
        return question(self.loaded, bundle_figures(self.folder / BUNDLE))

    def own_plan(self, use: Use) -> Plan:
        """A plan for what the scene observes; effects not in `use` are `auto`."""
        c = self.asked.circumstances
        given = {
            n: p.model_copy(update={"use": use.get(n, "auto")}) for n, p in c.parameters.items()
        }
        return make_plan(replace(self.asked, circumstances=replace(c, parameters=given)))

    def own_viewer(self, plan: Plan) -> Viewer:
        """How a plan has the sensor seen."""
        return Viewer(self.sensor, plan, self.loaded.scene)

    def whole_use(self, without: Sequence[str] = ()) -> dict[str, str]:
        """Every effect on that does something, but for `without`."""
        c = self.asked.circumstances
        idle = {e.name for e in EFFECTS if e.is_null(c) and not e.provides}
        return {e.name: "off" if e.name in idle or e.name in without else "on" for e in EFFECTS}

    def tolerance(self, observable: str) -> float:
        """Of the scene, in N or px."""
        return float(self.asked.tolerance(observable))

    def peak(self, states: Sequence[GelState]) -> tuple[GelState, GelState]:
        """The state with the largest forces, and the gel a usual step before it."""
        at = int(np.argmax([np.abs(s.force_n).sum() for s in states]))
        state, before = states[at], states[max(0, at - 1)]
        if at > 0 and self.step_s > 0:
            apart = self.poses[at].time_s - self.poses[at - 1].time_s
            before = before.blended(state, max(0.0, 1 - self.step_s / apart))
        return state, before
