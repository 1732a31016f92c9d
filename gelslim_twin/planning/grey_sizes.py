"""How large effects on the grey values usually are, and by which factors pictures of them count."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from gelslim_twin.effects.grey_values import PIXEL_STEPS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question

NOISE = "sensor_noise"
SHADING = "shading"
PICTURED = (SHADING, "defocus", NOISE, "exposure", "specular", "dirt")
"""Effects of the picture that a probe draws: they change grey values, and a picture is evaluated by
its dots. Of shading it finds the change of the light too, because that is read from a picture."""
MUCH = 0.05
"""Share of the tolerance that is much for an effect that is left out."""
USUAL_SHARE = {
    SHADING: 0.2,
    "defocus": 0.15,
    NOISE: 0.2,
    "exposure": 0.08,
    "specular": 0.08,
    "dirt": 0.2,
}
"""Usual size of an effect on the grey values over its bound, in random scenes: more where the light
is even, less where it is not. It decides whether pictures are drawn and of what, but not what is
left out."""
SAFETY = 1.6
"""Factor on the largest shift of a dot at the pose that is drawn, for the other poses and for the
noise of other frames, beside the addition of `dot_contrast.FLOOR_PX`. In 50 random scenes 1.22 was
needed: the largest of many normal deviations hardly grows with their number."""
BLEMISHED_SAFETY = {"specular": 2.0, "dirt": 4.0}
"""The same where these stay in the picture: the detector may find a dot beside them at two places,
at some poses only. In these scenes 1.49 was needed beside spots, and 3.55 beside dirt."""


def effects_to_draw(question: Question, plan: Plan) -> tuple[str, ...]:
    """The effects on grey values that a plan includes and may leave out."""
    return tuple(
        c.effect
        for c in plan.included
        if c.effect in PICTURED and question.circumstances.parameters[c.effect].use == "auto"
    )


def left_by_bounds(question: Question, plan: Plan) -> tuple[str, ...]:
    """Effects on grey values that a plan leaves out though their bounds take much of the tolerance.

    A picture of them tells how much less they take.
    """
    return tuple(
        c.effect
        for c in plan.choices
        if not c.included
        and c.effect in PICTURED
        and question.circumstances.parameters[c.effect].use == "auto"
        and c.shares
        and c.error.image_px > MUCH * question.image_px
    )


def likely_small(question: Question, plan: Plan) -> tuple[str, ...]:
    """Effects on grey values that pictures are likely to show to be small."""

    def small(names: Sequence[str], safety: float) -> tuple[str, ...]:
        return tuple(n for n in names if safety * usual_px(plan, n) <= question.image_px)

    names = small(effects_to_draw(question, plan), SAFETY)
    return small(names, picture_safety(plan, names))


def picture_safety(plan: Plan, left_out: Collection[str]) -> float:
    """The safety factor on what pictures show of leaving effects out of a plan."""
    stay = {*plan.order} - {*left_out}
    return max((f for name, f in BLEMISHED_SAFETY.items() if name in stay), default=SAFETY)


def usual_px(plan: Plan, effect: str) -> float:
    """What an effect on the grey values usually shifts dots by, from its bound.

    Once the change of the light is known, that is the size of shading.
    """
    choice = plan.choice(effect)
    is_known = effect == SHADING and choice.probed
    return choice.size.image_px * (1 / SAFETY if is_known else USUAL_SHARE[effect])


def is_finely_shaded(plan: Plan) -> bool:
    """Whether a plan has shading by a finer rung than the coarsest."""
    return dict(plan.choice(SHADING).rung_parameters).get("pixel_step") != PIXEL_STEPS[0]
