"""Whether a probe pays: solving a few hard poses before a scene is planned for good.

The bounds of friction, of large strain and of effects on grey values are estimates from physics and
often several times too large. A probe finds their true size. It is made where a bound says that an
effect is needed and the run is so long that the probe is a small part of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.dot_contrast import FLOOR_PX
from gelslim_twin.effects.effect import Rung
from gelslim_twin.effects.grey_values import shading_ladder
from gelslim_twin.effects.large_strain import convergence_ms, correction_ms
from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.grey_sizes import (
    PICTURED,
    SHADING,
    effects_to_draw,
    likely_small,
)
from gelslim_twin.planning.plan import Choice, Plan
from gelslim_twin.planning.planner import Question
from gelslim_twin.planning.probed_path import MOST_POSES, straight_poses

MOTION_BLUR = "motion_blur"
PROBED = ("friction", "nonlinearity", "relaxation", MOTION_BLUR)
"""Effects whose size a probe finds by solving poses."""
LEFT_OUT = ((), ("friction",), ("friction", MOTION_BLUR), ("friction", "nonlinearity"))
"""Effects that a probe leaves out until it pays, one set after the other: friction takes a second
path, and large strain saves most of the time but takes corrections."""
FIND_MS = 5.5
"""Time of finding the dots of a picture of 640 x 480 pixels."""
LEAST_PICTURES = 2
"""Pictures that show what effects do together: one with all of them and one without any."""
MOST_SHARE = 0.05
"""Largest time of a probe over that of the run with large strain solved to convergence, both as
declared."""
PAYING_SHARE = 0.6
"""Time of the pictures of a probe over what they are likely to save, up to which any run has them
drawn."""
USUAL_STRAIN = 0.5
"""Share of the declared time of large strain that counts for the pictures of a probe: small
contacts converge faster, unless walls slide."""
LIGHT_STEP = 4
"""Pixels between those at which a probe computes the light."""
FASTEST_POSES = 2
"""Further poses for the speed of the dots."""


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
    most_ms = MOST_SHARE * _run_ms(question, plan, 1.0)
    solved = next(
        (
            effects
            for left in LEFT_OUT
            if (effects := tuple(name for name in wanted if name not in left))
            and probe_ms(question, plan, effects) <= most_ms
        ),
        (),
    )
    return solved + _pictured(question, plan, solved)


def _pictured(question: Question, plan: Plan, solved: tuple[str, ...]) -> tuple[str, ...]:
    """The effects that a probe draws; shading alone where its pictures do not pay."""
    if most_pictures(question, plan, solved) >= LEAST_PICTURES:
        return effects_to_draw(question, plan)
    if not is_lit(question, plan):
        return ()
    # Where nothing else is probed, poses are solved for the light alone.
    spent_ms = light_ms(question) + (0.0 if solved else probe_ms(question, plan, ()))
    saved_ms = plan.choice(SHADING).predicted_ms * plan.poses
    return (SHADING,) if spent_ms <= PAYING_SHARE * saved_ms else ()


def is_lit(question: Question, plan: Plan) -> bool:
    """Whether a probe may tell by how much slopes change the light that a plan computes."""
    return SHADING in plan.order and question.circumstances.parameters[SHADING].use == "auto"


def light_ms(question: Question) -> float:
    """Declared time of the change of the light at a pose, or at two where the tool moves aside."""
    ladder = shading_ladder(question.circumstances)
    once_ms = next(r.milliseconds for r in ladder if r.parameters["pixel_step"] == LIGHT_STEP)
    return once_ms if question.circumstances.motion.is_straight else 2 * once_ms


def most_pictures(question: Question, plan: Plan, solved: Sequence[str]) -> int:
    """Number of pictures that a probe may draw, after it has solved the size of effects.

    They take no more than their share of the run and what they may save, or a part of what they are
    likely to save.
    """
    if question.image_px <= 2 * FLOOR_PX:
        return 0
    names, likely = effects_to_draw(question, plan), likely_small(question, plan)
    ms = {c.effect: c.predicted_ms * plan.poses for c in plan.included}
    spent_ms = probe_ms(question, plan, solved)
    strained = 1.0 if question.circumstances.has_sliding_walls else USUAL_STRAIN
    left_ms = MOST_SHARE * _run_ms(question, plan, strained) - spent_ms
    # Where nothing else is probed, poses are solved for the pictures alone.
    paying_ms = PAYING_SHARE * sum(ms[e] for e in likely) - (0.0 if solved else spent_ms)
    most_ms = max(min(left_ms, sum(ms[e] for e in names)), paying_ms)
    return max(0, math.floor(most_ms / picture_ms(question, plan)))


def _run_ms(question: Question, plan: Plan, strained: float) -> float:
    """Declared time of the run with large strain solved to convergence, which counts by a share."""
    ms = {c.effect: c.predicted_ms for c in plan.included}
    if "nonlinearity" in ms:
        ms["nonlinearity"] = strained * convergence_ms(question.circumstances)
    return sum(ms.values()) * plan.poses


def _is_seen(choice: Choice) -> bool:
    """Whether an effect makes a picture or changes it."""
    return choice.effect in {e.name for e in EFFECTS if "image" in (*e.provides, *e.refines)}


def probe_ms(question: Question, plan: Plan, effects: Sequence[str]) -> float:
    """Declared time of a probe that sizes `effects`."""
    chosen = {c.effect: c.predicted_ms for c in plan.included}
    linear_ms = chosen["normal_contact"] + chosen.get("friction", 0.0)
    paths = 2 if "friction" in effects else 1
    straight = question.circumstances.motion.is_straight
    poses = straight_poses(question.circumstances) if straight else MOST_POSES
    poses = min(poses + (FASTEST_POSES if MOTION_BLUR in effects else 0), plan.poses)
    # A correction of the hardest pose, or of two; setting up the law takes as long as one.
    laws = 0 if "nonlinearity" not in effects else 2 if straight else 3
    solving_ms = poses * paths * linear_ms + laws * correction_ms(question.circumstances)
    drawn = any(name in PICTURED for name in effects)
    return solving_ms + (LEAST_PICTURES * picture_ms(question, plan) if drawn else 0.0)


def picture_ms(question: Question, plan: Plan) -> float:
    """Declared time of a picture of a probe and of finding its dots."""
    seen_ms = sum(c.predicted_ms for c in plan.included if _is_seen(c) and c.effect != SHADING)
    if SHADING in plan.order:
        seen_ms += coarsest_shading(question.circumstances).milliseconds
    return seen_ms + FIND_MS * question.circumstances.sensor.frame_px / 307200


def coarsest_shading(circumstances: Circumstances) -> Rung:
    """The first rung of shading, with which a probe draws."""
    return shading_ladder(circumstances)[0]
