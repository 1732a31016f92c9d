"""Whether a probe pays: solving a few hard poses before a scene is planned for good.

The bounds of friction, of large strain and of effects on grey values are estimates from physics and
often several times too large. A probe finds their true size. It is made where a bound says that an
effect is needed and the run is so long that the probe is a small part of it.
"""

from __future__ import annotations

from collections.abc import Sequence

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.contact import convergence_ms, correction_ms
from gelslim_twin.effects.effect import Rung
from gelslim_twin.effects.grey_values import shading_ladder
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question
from gelslim_twin.scene.pose import Pose

PROBED = ("friction", "nonlinearity")
"""Effects whose size a probe finds."""
NOISE = "sensor_noise"
SHADING = "shading"
PICTURED = (SHADING, "defocus", NOISE, "exposure", "specular", "dirt")
"""Effects of the picture that a probe draws: they change grey values, and a picture is evaluated by
its dots. Of shading it finds the error of its coarsest rung and not the size, because the light is
read from the picture too."""
FIND_MS = 1.5
"""Time of finding 575 dots near where they are expected."""
MOST_SHARE = 0.05
"""Largest time of a probe over that of the run with large strain solved to convergence, both as
declared."""
MOST_POSES, STRAIGHT_POSES = 12, 4
"""Poses of the path that a probe solves on a linear gel, and those of a straight press, of which
the deepest is the hardest."""


def effects_to_probe(question: Question, plan: Plan) -> tuple[str, ...]:
    """The effects that a probe of a planned scene should size; none where it does not pay.

    Args:
        question: The scene as the planner takes it, without a probe.
        plan: Its plan by bounds.
    """
    wanted = tuple(
        c.effect
        for c in plan.included
        if c.effect in PROBED and question.circumstances.parameters[c.effect].use == "auto"
    )
    ms = {c.effect: c.predicted_ms for c in plan.included}
    converged_ms = dict(ms)
    if "nonlinearity" in ms:
        converged_ms["nonlinearity"] = convergence_ms(question.circumstances)
    most_ms = MOST_SHARE * sum(converged_ms.values()) * plan.poses
    # Friction takes a second path; large strain alone saves most of the time.
    for effects in (wanted, tuple(name for name in wanted if name == "nonlinearity"), ()):
        pictured = _pictured(question, plan, effects, most_ms)
        if (effects or pictured) and probe_ms(question, plan, effects) <= most_ms:
            return effects + pictured
    return ()


def _pictured(
    question: Question, plan: Plan, effects: tuple[str, ...], most_ms: float
) -> tuple[str, ...]:
    """The effects of the picture that a probe of `effects` may size besides, the slowest first."""
    wanted = [
        c
        for c in plan.included
        if c.effect in PICTURED and question.circumstances.parameters[c.effect].use == "auto"
        if c.effect != SHADING or c.rung != coarsest_shading(question.circumstances).name
    ]
    found: tuple[str, ...] = ()
    for choice in sorted(wanted, key=lambda c: -c.predicted_ms):
        if probe_ms(question, plan, (*effects, *found, choice.effect)) <= most_ms:
            found = (*found, choice.effect)
    return found


def probe_ms(question: Question, plan: Plan, effects: Sequence[str]) -> float:
    """Declared time of a probe that sizes `effects`."""
    chosen = {c.effect: c.predicted_ms for c in plan.included}
    linear_ms = chosen["normal_contact"] + chosen.get("friction", 0.0)
    paths = 2 if "friction" in effects else 1
    straight = question.circumstances.motion.is_straight
    poses = min(STRAIGHT_POSES if straight else MOST_POSES, plan.poses)
    # A correction of the hardest pose, or of two; setting up the law takes as long as one.
    laws = 0 if "nonlinearity" not in effects else 2 if straight else 3
    solving_ms = poses * paths * linear_ms + laws * correction_ms(question.circumstances)
    return solving_ms + _pictures_ms(question, plan, effects)


def _pictures_ms(question: Question, plan: Plan, effects: Sequence[str]) -> float:
    """Declared time of the pictures of a probe, one more than effects, and of their dots."""
    drawn = [name for name in effects if name in PICTURED]
    if not drawn:
        return 0.0
    seen = {e.name for e in EFFECTS if "image" in (*e.provides, *e.refines)} - {SHADING}
    each_ms = sum(c.predicted_ms for c in plan.included if c.effect in seen)
    each_ms += FIND_MS * question.circumstances.sensor.markers / 575
    if SHADING not in plan.order:
        return (len(drawn) + 1) * each_ms
    coarse_ms = coarsest_shading(question.circumstances).milliseconds
    finer_ms = plan.choice(SHADING).predicted_ms - coarse_ms if SHADING in drawn else 0.0
    return (len(drawn) + 1) * (each_ms + coarse_ms) + finer_ms


def coarsest_shading(circumstances: Circumstances) -> Rung:
    """The first rung of shading, with which a probe draws."""
    return shading_ladder(circumstances)[0]


def probed_poses(poses: Sequence[Pose], is_straight: bool = False) -> tuple[Pose, ...]:
    """A few poses of a path, in order: its extremes, its end, and others evenly between.

    Extremes are the deepest pose, the one farthest aside from where the deepest is, and those of
    the largest twist and tilt.
    """
    most = STRAIGHT_POSES if is_straight else MOST_POSES
    if len(poses) <= most:
        return tuple(poses)
    every = range(len(poses))
    deepest = max(every, key=lambda k: poses[k].depth_mm)
    still = poses[deepest]

    def aside(k: int) -> float:
        return (poses[k].x_mm - still.x_mm) ** 2 + (poses[k].y_mm - still.y_mm) ** 2

    kept = {
        deepest,
        len(poses) - 1,
        max(every, key=aside),
        max(every, key=lambda k: abs(poses[k].twist_deg - still.twist_deg)),
        max(every, key=lambda k: abs(poses[k].tilt_x_deg) + abs(poses[k].tilt_y_deg)),
    }
    # The pose that lies farthest from those kept comes next.
    while len(kept) < most:
        kept.add(max(every, key=lambda k: min(abs(k - other) for other in kept)))
    return tuple(poses[k] for k in sorted(kept))
