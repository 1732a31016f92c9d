"""The mechanical model of a plan: linear contact, friction, large strain, relaxation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.planning.plan import Choice, Plan
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.simulation.simulate import Mechanics


def mechanics_of(
    loaded: LoadedScene, plan: Plan, sensor: TwinSensor, folder: Path | None = None
) -> Mechanics:
    """The mechanical model of a planned scene; the pad's compliance is stored in `folder`.

    Only modules of effects in the plan are imported. Raises ValueError or OSError for an STL file
    that cannot be read.
    """
    chosen = {choice.effect: choice for choice in plan.included}
    if "normal_contact" not in chosen:
        return Untouched(len(sensor.points_mm))
    solver = import_module(chosen["normal_contact"].implementation)
    from gelslim_twin.contact.compliance import SurfaceCompliance
    from gelslim_twin.contact.tool import Tool

    tolerance, friction = _tolerance(chosen["normal_contact"]), 0.0
    if "friction" in chosen:
        tolerance = min(tolerance, _tolerance(chosen["friction"]))
        friction = loaded.scene.contact.friction
    settings = solver.ContactSettings(tolerance, friction)
    tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    contact: Any = solver.ContactSolver(SurfaceCompliance(sensor.bundle, folder), tool, settings)
    if "nonlinearity" in chosen:
        nonlinear = import_module(chosen["nonlinearity"].implementation)
        contact = nonlinear.NonlinearContact(
            contact, **dict(chosen["nonlinearity"].rung_parameters)
        )
    if "relaxation" in chosen:
        given = loaded.scene.effects.parameters()["relaxation"].model_dump(exclude={"use"})
        module = import_module(chosen["relaxation"].implementation)
        return Relaxing(contact, module, given["terms"])
    return contact


def _tolerance(choice: Choice) -> float:
    return float(dict(choice.rung_parameters)["tolerance"])


@dataclass(frozen=True)
class Untouched:
    """A gel that nothing touches."""

    nodes: int

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """The gel at rest for every pose."""
        return (GelState.at_rest(self.nodes) for _ in poses)


@dataclass(frozen=True)
class Relaxing:
    """Elastic mechanics whose forces relax."""

    elastic: Mechanics
    relaxation: Any
    """The module."""
    terms: Sequence[Mapping[str, float]]

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """The elastic states with relaxed forces."""
        series = self.relaxation.PronySeries(
            tuple(t["fraction"] for t in self.terms), tuple(t["time_s"] for t in self.terms)
        )
        memory, last = None, poses[0].time_s if poses else 0.0
        for pose, state in zip(poses, self.elastic.states(poses), strict=True):
            if memory is None:
                memory = self.relaxation.at_rest(series, len(state.force_n))
            force, memory = self.relaxation.relax(
                series, memory, state.force_n, max(pose.time_s - last, 0.0)
            )
            last = pose.time_s
            yield replace(state, force_n=np.asarray(force))
