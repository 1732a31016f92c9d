"""The planner's input: figures of a scene's motion and tool, and of its sensor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from gelslim_twin.effects.circumstances import (
    LEAST_LIGHT,
    Circumstances,
    MotionFigures,
    SensorFigures,
)
from gelslim_twin.effects.contact_estimate import Footprint
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import PlanError, Question, make_plan
from gelslim_twin.scene.footprint import tool_footprint
from gelslim_twin.scene.pose import Pose
from gelslim_twin.scene.reader import LoadedScene
from gelslim_twin.scene.scene import Contact

HIGHEST_MM, LEVELS = 20.0, 100
"""Heights over its lowest point at which a tilted tool is searched for its lowest point."""
JUST_TOUCHING_MM = 1e-9
Vector = tuple[float, float, float]


def plan_scene(loaded: LoadedScene, sensor: SensorFigures) -> Plan:
    """Choose the effects that a scene needs by their bounds alone.

    Args:
        loaded: The scene.
        sensor: Figures of its sensor, for example from `bundle_figures`.

    Returns:
        Every effect with its size, whether it is simulated, and how finely.

    Raises:
        InputError: An effect is switched off without which something observed cannot be computed;
            it names the line.
    """
    return plan_asked(loaded, question(loaded, sensor))


def plan_asked(loaded: LoadedScene, asked: Question) -> Plan:
    """The plan of a scene's question, such as one with a probe. Raises as `plan_scene`."""
    try:
        return make_plan(asked)
    except PlanError as error:
        name = f"effects.{error.effect}" if error.effect else "observe"
        used = f"{name}.use" if f"{name}.use" in loaded.source_map else name
        raise loaded.problem(used, "off", error.message, error.remedy) from None


def question(loaded: LoadedScene, sensor: SensorFigures) -> Question:
    """Observables, tolerances and circumstances of a scene, as the planner takes them."""
    scene = loaded.scene
    if loaded.look is not None or (scene.vary is not None and scene.vary.light_gain is not None):
        # Photographed light and lamps of any brightness are not those of the design.
        sensor = replace(sensor, least_light=min(LEAST_LIGHT, sensor.least_light))
    footprint = tool_footprint(
        scene.indenters, loaded.folder, sensor.length_mm * sensor.width_mm, sensor.node_pitch_mm
    )
    return Question(
        scene.name,
        scene.observe,
        scene.tolerance.force_n,
        scene.tolerance.image_px,
        Circumstances(
            sensor,
            motion_figures(loaded.poses, footprint),
            footprint,
            contact_friction(scene.contact, sensor.skin_friction),
            scene.effects.parameters(),
        ),
    )


def contact_friction(contact: Contact, of_skin: float | None) -> float:
    """Coefficient of friction of a scene: its own, else that of the gel's skin, else 0."""
    if of_skin is None or "friction" in contact.model_fields_set:
        return contact.friction
    return of_skin


def motion_figures(poses: Sequence[Pose], footprint: Footprint) -> MotionFigures:
    """Extremes of a motion while the tool is below the undeformed surface.

    A tilted tool reaches deeper on one side, by its reach times the slope.
    """
    profile = _profile(poses, footprint)
    depths = [_reach(pose, footprint, profile) for pose in poses]
    touching = [i for i, depth in enumerate(depths) if depth > 0]
    if not touching:
        return MotionFigures(len(poses))
    reach = footprint.reach_mm(max(depths))
    lateral = turned = speed = step = step_aside = 0.0
    shortest = math.inf
    for (i, a), (j, b) in pairwise(enumerate(poses)):
        if depths[i] <= 0 and depths[j] <= 0:
            continue
        side, turn = math.hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm), abs(b.twist_deg - a.twist_deg)
        lateral, turned = lateral + side, turned + turn
        aside = side + math.radians(turn + _tilt(a, b)) * reach
        # Gel next to the tool is pushed down when the tool moves over it.
        deepest = max(depths[i], depths[j])
        pushed = min(deepest, footprint.steepest(deepest) * aside) if aside > 0 else 0.0
        way = math.hypot(aside, b.depth_mm - a.depth_mm) + pushed
        speed = max(speed, way / (b.time_s - a.time_s))
        step, step_aside = max(step, abs(depths[j] - depths[i])), max(step_aside, aside)
        shortest = min(shortest, b.time_s - a.time_s)
    return MotionFigures(
        poses=len(poses),
        depth_mm=max(depths),
        lateral_mm=lateral,
        twist_deg=turned,
        tilt_deg=max(math.hypot(p.tilt_x_deg, p.tilt_y_deg) for p in poses),
        contact_s=poses[-1].time_s - poses[max(0, touching[0] - 1)].time_s,
        speed_mm_s=speed,
        step_mm=step,
        step_aside_mm=step_aside,
        shortest_s=shortest if math.isfinite(shortest) else 0.0,
        recedes=any(b < a and a > 0 for a, b in pairwise(depths)),
    )


def _tilt(a: Pose, b: Pose) -> float:
    return math.hypot(b.tilt_x_deg - a.tilt_x_deg, b.tilt_y_deg - a.tilt_y_deg)


def _profile(poses: Sequence[Pose], footprint: Footprint) -> tuple[tuple[float, float], ...]:
    """Heights over the lowest point and the reach there; nothing where no pose is tilted."""
    if not any(pose.tilt_x_deg or pose.tilt_y_deg for pose in poses):
        return ()
    heights = (HIGHEST_MM * (k / LEVELS) ** 2 for k in range(1, LEVELS + 1))
    return tuple((height, footprint.reach_mm(height)) for height in heights)


def _reach(pose: Pose, footprint: Footprint, profile: tuple[tuple[float, float], ...]) -> float:
    slope = math.tan(math.radians(math.hypot(pose.tilt_x_deg, pose.tilt_y_deg)))
    reached = pose.depth_mm
    if slope == 0:
        return reached
    # Two passes, because the tilt may lower shapes that are raised.
    for _ in range(2):
        reached = pose.depth_mm + footprint.reach_mm(max(reached, JUST_TOUCHING_MM)) * slope
    # A round tool that has rolled touches beside its origin, which is above the gel then.
    lowered = max((reach * slope - height for height, reach in profile), default=0.0)
    return max(reached, pose.depth_mm + lowered / math.hypot(1.0, slope))
