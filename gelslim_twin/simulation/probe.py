"""The probe: a few poses of a scene solved before it is planned.

They are solved on a linear gel, which gives the force that relative errors refer to. Where large
strain is to be sized, the hardest of them are corrected once by the law at large strain; where
friction is, all of them are solved without it too. Safety factors cover the other poses and what
one correction leaves out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.corrected_contact import (
    Correction,
    LinearStep,
    corrected,
    linear_steps,
    unfit,
)
from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.prony import PronySeries
from gelslim_twin.contact.relaxation import at_rest, relax
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.effects.circumstances import CorrectedPose, MotionFigures, Probed
from gelslim_twin.effects.contact import RelaxationParameters
from gelslim_twin.effects.effect import OBSERVABLES, Bound, geometry, rounded_up
from gelslim_twin.effects.grey_values import motion_blur_bound
from gelslim_twin.effects.large_strain import RIM_NODES, RIM_PLACES
from gelslim_twin.planning.planner import Question
from gelslim_twin.planning.probed_path import pressed_poses, probed_poses, straight_poses
from gelslim_twin.planning.probing import MOTION_BLUR
from gelslim_twin.render.surface_state import NodeLattice
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.simulation.probed_dots import moving_dots
from gelslim_twin.simulation.sensor import nodes_to_markers
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.operators.single_thread import single_threaded

Pictured = Callable[[Question, Sequence[GelState]], Question]
"""The question with what pictures of states show, of which the first has the largest force."""
TOLERANCE = 1e-2
"""Of the contact: its error is a small part of the safety factors."""
FORCE_SAFETY, FRICTION_SAFETY, PLACES_SAFETY = 1.25, 2.0, 2.0
"""Factors on what is found of forces, for large strain and for friction, and of displacements.
They cover the poses between: in 66 random scenes the size over the whole path was up to 1.18 times
(forces, large strain), 1.8 times (forces, friction) and 1.8 times (displacements) what is found."""
STRAIGHT_FRICTION_SAFETY, STRAIGHT_PLACES_SAFETY = 1.3, 1.5
"""The same in a straight press, whose hardest pose is the deepest: friction needed 1.17 there in 98
of 102 random scenes, and places under large strain 1.38."""
LEAST_FRICTION = 5e-3
"""What friction changes at least in a straight press, over the largest resultant and displacement:
where it changes little at the deepest pose, it may change more on the way."""
LEAST_OVERLAP = 0.7
"""Overlap of the tool with the nodes at the poses of a probe over that at any pose: below it, the
sizes found say little about the path. In seed 2334 a wall that met two nodes at one pose and none
at most others had 14 times the force that was found."""
RELAXED_SAFETY = 2.5
"""Factor on the force that relaxes: between few poses forces are taken to run straight. In 33
random scenes 1.8 was needed."""


@single_threaded
def probed(
    asked: Question,
    loaded: LoadedScene,
    compliance: SurfaceCompliance,
    effects: Sequence[str] = (),
    milliseconds: float = 0.0,
    pictured: Pictured | None = None,
) -> Question:
    """The question with the force of the scene, and the sizes of `effects`, solved.

    Args:
        asked: The scene as the planner takes it.
        loaded: The scene.
        compliance: Compliance of the pad, which keeps the columns that it computes.
        effects: Which of `probing.PROBED` to size.
        milliseconds: Declared time of the probe.
        pictured: Adds what pictures show of effects on grey values, of the pose with the largest
            force and, where the tool moves aside, of that with the steepest gel.

    Returns:
        The question, unchanged where the contact of a pose is not solved, and where the tool
        reaches deeper among the nodes at other poses. An effect whose size is not found keeps its
        bound. A tool that meets no node at any pose counts as not in contact.
    """
    tool = Tool.of(loaded.scene.indenters, loaded.folder, loaded.scene.seed)
    probe = _Probe(asked, compliance, tool)
    if not probe.touches(loaded.poses):
        # Nodes, not areas, meet the tool: it passes between them or beside the pad.
        here = asked.circumstances
        none = Probed(0.0, 0.0, 0.0, {}, milliseconds)
        apart = replace(here, motion=MotionFigures(here.motion.poses), probed=none)
        known = replace(asked, circumstances=apart)
        return (
            known if pictured is None else pictured(known, [GelState.at_rest(len(probe.points_mm))])
        )
    poses = probe.poses(loaded, MOTION_BLUR in effects)
    if not probe.are_hardest(poses, loaded.poses):
        return asked
    try:
        steps = probe.steps(poses)
    except ContactError:
        return asked
    sizes = dict[str, Bound]()
    if "friction" in effects and (free := probe.frictionless(steps)):
        held = [step.state for step in steps]
        sizes["friction"] = probe.friction(held, free)
    hard = probe.corrections(steps) if "nonlinearity" in effects else []
    if hard:
        linear, strained = zip(*hard, strict=True)
        sizes["nonlinearity"] = probe.large_strain(linear, strained)
        if asked.circumstances.has_sliding_walls:
            rim = probe.rim(linear)
            sizes["nonlinearity"] = sizes["nonlinearity"].plus(rim)
    if "relaxation" in effects:
        sizes["relaxation"] = Bound(force_n=probe.lost_n(steps, loaded.poses[0].time_s))
    dots_px = dot_mm_s = math.inf
    if MOTION_BLUR in effects and {"markers", "image"} & {*asked.observe}:
        dots_px, dot_mm_s = moving_dots(asked.circumstances, compliance.bundle, steps)
    forces = [step.state.force_n.sum(axis=0) for step in steps]
    found = Probed(
        rounded_up(max(-float(force[2]) for force in forces)),
        rounded_up(max(float(np.linalg.norm(force)) for force in forces)),
        rounded_up(max(float(np.abs(step.state.displacement_mm).max()) for step in steps)),
        sizes,
        milliseconds,
        dot_mm_s=dot_mm_s,
        corrected=tuple(probe.corrected_pose(*pair) for pair in hard),
        dots_px=dots_px,
    )
    if found.normal_n <= 0:
        return asked
    here = replace(asked.circumstances, probed=found)
    if MOTION_BLUR in effects:
        found = replace(found, sizes={**sizes, MOTION_BLUR: motion_blur_bound(here)})
        here = replace(here, probed=found)
    known = replace(asked, circumstances=here)
    return known if pictured is None else pictured(known, probe.drawn(steps))


@dataclass(frozen=True, eq=False)
class _Probe:
    """Solves the poses of a probe."""

    asked: Question
    compliance: SurfaceCompliance
    tool: Tool

    def _solver(self, friction: float) -> ContactSolver:
        return ContactSolver(self.compliance, self.tool, ContactSettings(TOLERANCE, friction))

    def poses(self, loaded: LoadedScene, with_fastest: bool = False) -> tuple[Pose, ...]:
        """The poses of the probe.

        The two poses between which the tool is fastest are among them where that is asked for.
        """
        c = self.asked.circumstances
        if c.motion.is_straight:
            return pressed_poses(loaded.poses, straight_poses(c), with_fastest)
        reach_mm = c.footprint.reach_mm(c.contact.depth_mm) if with_fastest else None
        return probed_poses(loaded.poses, reach_mm)

    def drawn(self, steps: Sequence[LinearStep]) -> list[GelState]:
        """The state with the largest force, and where the tool moves aside the steepest one."""
        pressed = _most_pressed(steps).state
        if self.asked.circumstances.motion.is_straight:
            return [pressed]
        lattice = NodeLattice.of(self.points_mm)

        def steepest_mm(state: GelState) -> float:
            heights_mm = lattice.state(state.displacement_mm).displacement_mm[..., 2]
            return max(float(np.abs(np.diff(heights_mm, axis=k)).max()) for k in (0, 1))

        steepest = max((step.state for step in steps), key=steepest_mm)
        return [pressed] if steepest is pressed else [pressed, steepest]

    def are_hardest(self, poses: Sequence[Pose], path: Sequence[Pose]) -> bool:
        """Whether the tool overlaps the nodes at some of these poses about as much as anywhere.

        A narrow tool that slides meets a node at some poses and none at others.
        """
        if self.asked.circumstances.motion.is_straight or len(poses) == len(path):
            return True
        most = [max(self._overlap_mm(pose) for pose in some) for some in (poses, path)]
        return most[0] >= LEAST_OVERLAP * most[1]

    def _overlap_mm(self, pose: Pose) -> float:
        """Sum of the depths of nodes of the undeformed surface below the tool."""
        below_mm = np.clip(-self.tool.clearance_mm(pose, self.points_mm), 0.0, None)
        return float(below_mm.sum())

    def steps(self, poses: tuple[Pose, ...]) -> list[LinearStep]:
        """The linear contact, with the friction of the scene, at these poses."""
        return list(linear_steps(self._solver(self.asked.circumstances.friction), poses))

    def touches(self, poses: Sequence[Pose]) -> bool:
        """Whether any node of the undeformed surface is below the tool at one of these poses."""
        return any((self.tool.clearance_mm(pose, self.points_mm) < 0).any() for pose in poses)

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Nodes of the undeformed surface."""
        return np.asarray(self.compliance.bundle.mesh.surface_mm)

    def frictionless(self, steps: Sequence[LinearStep]) -> list[GelState]:
        """The contact at the same poses without friction; empty where it is not found."""
        poses = tuple(step.pose for step in steps)
        try:
            return [step.state for step in linear_steps(self._solver(0.0), poses)]
        except ContactError:
            return []

    def corrections(self, steps: Sequence[LinearStep]) -> list[tuple[GelState, GelState]]:
        """The hardest poses on a linear gel, and corrected once; empty where not found."""
        if unfit(self.compliance.bundle) is not None:
            return []
        solver, found = self._solver(self.asked.circumstances.friction), []
        correction = Correction(self.compliance.bundle)
        for step in _hardest(steps):
            try:
                found.append((step.state, corrected(solver, correction, step)))
            except ContactError:
                return []
        return found

    def lost_n(self, steps: Sequence[LinearStep], start_s: float) -> float:
        """Force that relaxes at most at these poses, of a gel at rest at the start of the path."""
        c = self.asked.circumstances
        terms = c.given("relaxation", RelaxationParameters).terms
        series = PronySeries(tuple(t.fraction for t in terms), tuple(t.time_s for t in terms))
        history, before_s, worst = at_rest(series, len(self.points_mm)), start_s, 0.0
        for step in steps:
            elastic = step.state.force_n
            relaxed, history = relax(series, history, elastic, step.pose.time_s - before_s)
            before_s = step.pose.time_s
            worst = max(worst, float(np.linalg.norm((elastic - relaxed).sum(axis=0))))
        return rounded_up(RELAXED_SAFETY * (1 + c.contact.nonlinear_excess) * worst)

    def rim(self, states: Iterable[GelState]) -> Bound:
        """What nodes at the walls of the tool may differ by besides."""
        shares = [
            float(np.linalg.norm(s.force_n.sum(axis=0))) * min(1.0, RIM_NODES / touched)
            for s in states
            if (touched := int((s.touch > 0).sum()))
        ]
        c = self.asked.circumstances
        px = RIM_PLACES * c.motion.depth_mm * c.sensor.px_per_mm
        return geometry(rounded_up(px), rounded_up(max(shares, default=0.0)))

    @cached_property
    def _to_markers(self) -> Any:
        """(m, c) from the surface nodes to the markers; None where no marker is observed."""
        bundle = self.compliance.bundle
        if bundle.markers is None or not {"markers", "image"} & {*self.asked.observe}:
            return None
        return nodes_to_markers(bundle)

    def friction(self, held: Sequence[GelState], free: Sequence[GelState]) -> Bound:
        """Size of friction, from states with and without it."""
        if not self.asked.circumstances.motion.is_straight:
            return self.largest(held, free, (FRICTION_SAFETY, PLACES_SAFETY))
        safety = STRAIGHT_FRICTION_SAFETY
        scale = self.asked.circumstances.sensor.px_per_mm
        whole_n = max(float(np.linalg.norm(state.force_n.sum(axis=0))) for state in held)
        whole_px = scale * max(float(np.abs(state.displacement_mm).max()) for state in held)
        least = geometry(LEAST_FRICTION * whole_px, LEAST_FRICTION * whole_n)
        return self.largest(held, free, (safety, safety), least)

    def large_strain(self, linear: Sequence[GelState], strained: Sequence[GelState]) -> Bound:
        """Size of large strain, from states on a linear gel and corrected ones."""
        straight = self.asked.circumstances.motion.is_straight
        places = STRAIGHT_PLACES_SAFETY if straight else PLACES_SAFETY
        return self.largest(linear, strained, (FORCE_SAFETY, places))

    def largest(
        self,
        ones: Iterable[GelState],
        others: Iterable[GelState],
        safety: tuple[float, float],
        least: Bound | None = None,
    ) -> Bound:
        """Largest differences of states in pairs, with safety factors of forces and of places.

        `least` is added.
        """
        found = Bound()
        for one, other in zip(ones, others, strict=True):
            found = found.at_least(self.difference(one, other))
        force_safety, places_safety = safety
        px = (found.displacement_px, found.markers_px, found.image_px)
        sized = Bound(found.force_n * force_safety, *(p * places_safety for p in px))
        sized = sized if least is None else sized.plus(least)
        return Bound.by_observable({o: rounded_up(sized.of(o)) for o in OBSERVABLES})

    def difference(self, one: GelState, other: GelState) -> Bound:
        """What two states differ by."""
        scale = self.asked.circumstances.sensor.px_per_mm
        moved = one.displacement_mm - other.displacement_mm
        force_n = float(np.linalg.norm((one.force_n - other.force_n).sum(axis=0)))
        places_px = scale * float(np.linalg.norm(moved, axis=1).max())
        dots_px = 0.0
        if self._to_markers is not None:
            dots_px = scale * float(np.linalg.norm(self._to_markers @ moved, axis=1).max())
        return Bound(force_n, places_px, dots_px, dots_px)

    def corrected_pose(self, linear: GelState, strained: GelState) -> CorrectedPose:
        """What the correction of a pose tells about the rungs of large strain."""
        change = self.difference(linear, strained)
        scale = self.asked.circumstances.sensor.px_per_mm
        return CorrectedPose(
            Bound.by_observable({o: rounded_up(change.of(o)) for o in OBSERVABLES}),
            rounded_up(scale * float(np.abs(strained.displacement_mm).max())),
            rounded_up(float(np.linalg.norm(strained.force_n.sum(axis=0)))),
        )


def _most_pressed(steps: Sequence[LinearStep]) -> LinearStep:
    """The step with the largest force."""
    return max(steps, key=lambda step: float(np.linalg.norm(step.state.force_n.sum(axis=0))))


def _hardest(steps: Sequence[LinearStep]) -> list[LinearStep]:
    """The steps with the largest force, and with the largest force along the surface."""
    forces = [step.state.force_n.sum(axis=0) for step in steps]
    order = range(len(steps))
    whole = max(order, key=lambda k: float(np.linalg.norm(forces[k])))
    aside = max(order, key=lambda k: math.hypot(forces[k][0], forces[k][1]))
    return [steps[k] for k in sorted({whole, aside})]
