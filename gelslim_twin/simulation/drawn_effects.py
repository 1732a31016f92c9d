"""Which effects of the picture are drawn before a run, once its contact is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.circumstances import PictureSizes
from gelslim_twin.effects.effect import rounded_up
from gelslim_twin.effects.grey_values import shading_bound
from gelslim_twin.planning.grey_sizes import PICTURED, SHADING, effects_to_draw, left_by_bounds
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question, are_left_out, make_plan, with_effects
from gelslim_twin.planning.probing import (
    LEAST_PICTURES,
    LIGHT_STEP,
    is_lit,
    light_ms,
    most_pictures,
    picture_ms,
)
from gelslim_twin.render.light_change import changed_share
from gelslim_twin.simulation.picture_probe import PictureProbe

if TYPE_CHECKING:
    from gelslim_twin.simulation.picture import Viewer

UNLIT = frozenset({*PICTURED, "motion_blur", "compression"} - {SHADING})
"""Effects of the picture that do not change the light on a clean gel in focus."""
LIGHT_SAFETY, LIGHT_ASIDE_SAFETY = 1.6, 3.0
"""Factors on the change of the light that every fourth pixel of hard poses shows, for what lies
between, for other poses and for large strain: of straight presses, and where the tool moves aside.
On linear gels 1.36 and 2.12 was needed in 42 and 28 random scenes, and 1.08 for strain in 27."""


def drawn_effects(
    asked: Question,
    states: Sequence[GelState],
    *,
    viewer: Callable[[Plan], Viewer],
    by_bounds: Plan,
    solved: tuple[str, ...],
) -> Question:
    """The question with what the picture of a hard pose shows of the effects still included.

    Args:
        asked: The question with what a probe has solved.
        states: Hard poses, the first of which is drawn; the others are asked for their light.
        viewer: How the sensor is seen by a plan.
        by_bounds: The plan without a probe, whose run the pictures are a small part of.
        solved: Effects whose sizes were solved before.

    Returns:
        The question, in which the declared time of the pictures counts.
    """
    touches = asked.circumstances.motion.depth_mm > 0
    if touches and is_lit(asked, by_bounds):
        asked = with_light(asked, by_bounds, states, viewer)
    plan = make_plan(asked)
    plan = with_effects(asked, plan, left_by_bounds(asked, plan))
    names = effects_to_draw(asked, plan)
    most = most_pictures(asked, by_bounds if touches else plan, solved if touches else ())
    if not names or most < LEAST_PICTURES:
        return asked
    probe = PictureProbe(plan, viewer)
    found = probe.together(states[0], names, most, partial(_fits, asked), asked.image_px)
    return with_pictures(asked, found, found.pictures * picture_ms(asked, plan))


def with_light(
    asked: Question, plan: Plan, states: Sequence[GelState], viewer: Callable[[Plan], Viewer]
) -> Question:
    """The question with the change of the light by the slopes of hard poses.

    It decides about shading, and whether dots are found alike beside the shade at a wall.
    """
    probed = asked.circumstances.probed
    if probed is None:
        return asked
    seen = viewer(replace(plan, order=tuple(n for n in plan.order if n not in UNLIT)))
    share = max(changed_share(seen.renderer, seen.surface(s), LIGHT_STEP) for s in states)
    safety = LIGHT_SAFETY if asked.circumstances.motion.is_straight else LIGHT_ASIDE_SAFETY
    found = replace(
        probed,
        light_share=rounded_up(safety * share),
        milliseconds=probed.milliseconds + light_ms(asked),
    )
    here = replace(asked.circumstances, probed=found)
    found = replace(found, sizes={**found.sizes, SHADING: shading_bound(here)})
    return replace(asked, circumstances=replace(here, probed=found))


def _fits(asked: Question, seen: PictureSizes) -> bool:
    """Whether a plan that knows these sizes may leave out what was left out together."""
    return are_left_out(with_pictures(asked, seen, 0.0))


def with_pictures(asked: Question, seen: PictureSizes, milliseconds: float) -> Question:
    """The question with what pictures show beside what was solved; it is unchanged without that."""
    probed = asked.circumstances.probed
    if probed is None:
        return asked
    found = replace(
        probed,
        milliseconds=probed.milliseconds + milliseconds,
        coarsest=seen.coarsest,
        together=seen.together,
    )
    return replace(asked, circumstances=replace(asked.circumstances, probed=found))
