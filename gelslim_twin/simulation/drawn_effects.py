"""Which effects of the picture are drawn before a run, once its contact is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.circumstances import PictureSizes
from gelslim_twin.effects.dot_contrast import shift_px
from gelslim_twin.planning.grey_sizes import effects_to_draw, left_by_bounds
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.planner import Question, are_left_out, make_plan, with_effects
from gelslim_twin.planning.probing import LEAST_PICTURES, most_pictures, picture_ms
from gelslim_twin.simulation.picture_probe import PictureProbe

if TYPE_CHECKING:
    from gelslim_twin.simulation.picture import Viewer


def drawn_effects(
    asked: Question,
    state: GelState,
    *,
    viewer: Callable[[Plan], Viewer],
    by_bounds: Plan,
    solved: tuple[str, ...],
) -> Question:
    """The question with what the picture of a hard pose shows of the effects still included.

    Args:
        asked: The question with what a probe has solved.
        state: The hardest pose.
        viewer: How the sensor is seen by a plan.
        by_bounds: The plan without a probe, whose run the pictures are a small part of.
        solved: Effects whose sizes were solved before.

    Returns:
        The question, in which the declared time of the pictures counts.
    """
    plan = make_plan(asked)
    plan = with_effects(asked, plan, left_by_bounds(asked, plan))
    names = effects_to_draw(asked, plan)
    touches = asked.circumstances.motion.depth_mm > 0
    most = most_pictures(asked, by_bounds if touches else plan, solved if touches else ())
    if not names or most < LEAST_PICTURES:
        return asked
    shown = partial(shift_px, asked.circumstances)
    probe = PictureProbe(plan, viewer, shown)
    found = probe.together(state, names, most, partial(_fits, asked), asked.image_px)
    return with_pictures(asked, found, found.pictures * picture_ms(asked, plan))


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
