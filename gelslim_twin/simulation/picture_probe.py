"""The probe of the picture: one pose drawn with and without effects on its grey values.

A picture is evaluated by its dots, so that the size of effects is the largest shift of a dot that
the force pipeline's detector finds, times a safety factor. Effects are left out together, so that
two pictures tell about several of them. The first set to be left out are those that usual shares of
their bounds suggest; it shrinks where its shift is too large, and grows as long as it is not. Where
more than a few dots are found in one of two pictures only, the effects decide more than a shift,
and their bounds stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.circumstances import PictureSizes
from gelslim_twin.effects.dot_contrast import FLOOR_PX
from gelslim_twin.effects.effect import Bound, picture, rounded_up
from gelslim_twin.effects.grey_values import PIXEL_STEPS
from gelslim_twin.planning.grey_sizes import (
    SHADING,
    is_finely_shaded,
    picture_safety,
    usual_px,
)
from gelslim_twin.planning.plan import Plan

if TYPE_CHECKING:
    from gelslim_twin.render.frame_renderer import RenderedFrame
    from gelslim_twin.simulation.picture import Viewer

RUNG_SAFETY = 3.0
"""The same as `picture_safety` for the coarsest rung of shading."""
PICTURE_DIGITS = 2
"""Significant digits of what is found: one pixel that is rounded otherwise moves a dot."""
WORTH_A_TRY = 3.0
"""Usual size over the tolerance up to which leaving an effect out is tried."""
FINE_STEP, FINE_PICTURES = 2, 2
"""Pixels from one value to the next of the fine rung of shading that a probe draws, a quarter of
the coarsest, and the pictures that one with it counts for. Beside the safety factor, what the
finest rung would change is little."""
LOST_SHARE = 5e-3
"""Share of the dots that may be found in one of two pictures only, as behind spots."""
MATCH_PX = 3.0
"""Distance from a dot within which a detection is that of the dot."""
NOT_DRAWN = frozenset({"motion_blur", "compression"})
"""Effects that the pictures of a probe leave out: one state shows no motion."""


@dataclass(frozen=True, eq=False)
class PictureProbe:
    """Draws a pose with the effects of a plan, and without some of them.

    Attributes:
        plan: The plan by bounds.
        viewer: How the sensor is seen by a plan.
    """

    plan: Plan
    viewer: Callable[[Plan], Viewer]
    _kept: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)
    """Pictures by state and effects."""
    _kept_as: dict[Any, int] = field(default_factory=dict, init=False, repr=False)
    """How many pictures each counts for."""

    def together(
        self,
        state: GelState,
        effects: Sequence[str],
        most_pictures: int,
        fits: Callable[[PictureSizes], bool],
        tolerance_px: float = math.inf,
    ) -> PictureSizes:
        """What a state shows of leaving out as many of the effects at once as a plan allows.

        Args:
            state: The pose that is drawn.
            effects: The effects that may be left out.
            most_pictures: How many pictures may be drawn.
            fits: Whether a plan that knows these sizes may leave out what was left out together.
            tolerance_px: Of the picture, by which the first set is guessed.

        Returns:
            The effects to leave out together, and what else was found on the way.
        """
        found, light_px = PictureSizes(), 0.0
        names = [name for name in effects if name != SHADING]
        if SHADING in effects:
            # The rung of shading saves most of the time, so that it comes first.
            if self._may_size_rung and self._may_draw(1 + FINE_PICTURES, most_pictures):
                found = replace(found, coarsest=self._coarsest(state))
            light_px = self.plan.choice(SHADING).size.image_px
            if fits(_jointly(found, light_px, [SHADING])):
                names = [*effects]
        names.sort(key=self._usual_px)
        names = [n for n in names if self._usual_px(n) <= WORTH_A_TRY * tolerance_px]
        best, count, grows = found, self._guessed(names, tolerance_px), True
        while 0 < count <= len(names) and self._may_draw(1 if self._kept else 2, most_pictures):
            some = names[:count]
            px = self.size_px(state, some, light_px)
            joint = found if px is None else _jointly(found, px, some)
            if joint.together and fits(joint):
                best = joint
                if not grows:
                    break
                count += 1
            elif best.together:
                break
            else:
                grows, count = False, count - 1
        return replace(best, pictures=self.pictures)

    def _usual_px(self, effect: str) -> float:
        return usual_px(self.plan, effect)

    def _guessed(self, names: Sequence[str], tolerance_px: float) -> int:
        """How many effects, the smallest first, are guessed to keep the tolerance together."""
        for count in range(len(names), 1, -1):
            some = names[:count]
            usual_px = math.hypot(*map(self._usual_px, some))
            if picture_safety(self.plan, some) * usual_px <= tolerance_px:
                return count
        return 1

    @property
    def _may_size_rung(self) -> bool:
        """Whether the coarsest rung of shading is compared with a fine one.

        Beside dirt the detector may find a dot at two places, half a pixel apart, and any change of
        the light may decide which; a single pose does not tell.
        """
        return self._is_fine and "dirt" not in self.plan.order

    @property
    def _is_fine(self) -> bool:
        return is_finely_shaded(self.plan)

    def size_px(
        self, state: GelState, effects: Sequence[str], least_px: float = 0.0
    ) -> float | None:
        """The error of leaving effects out at once, with its safety factor; None for lost dots.

        It is at least `least_px` where shading is among them.
        """
        dots = _Dots.of(self._drawn(state, NOT_DRAWN))
        px = None if dots is None else dots.shift_px(self._drawn(state, NOT_DRAWN | {*effects}))
        if px is None:
            return None
        size = _with_safety(px, picture_safety(self.plan, effects))
        return max(size.image_px, least_px if SHADING in effects else 0.0)

    @property
    def pictures(self) -> int:
        """Number of pictures that were drawn, or of those that take as long."""
        return sum(self._kept_as.values())

    def _may_draw(self, more: int, most: int) -> bool:
        return self.pictures + more <= most

    def _coarsest(self, state: GelState) -> dict[str, Bound]:
        """The error of the coarsest rung of shading, against a fine one."""
        dots = _Dots.of(self._drawn(state, NOT_DRAWN))
        px = None if dots is None else dots.shift_px(self._drawn(state, NOT_DRAWN, self._fine))
        return {} if px is None else {SHADING: _with_safety(px, RUNG_SAFETY)}

    @cached_property
    def _coarse(self) -> Plan:
        """The plan with the coarsest rung of shading, with which all but that is drawn."""
        return _with_step(self.plan, PIXEL_STEPS[0])

    @cached_property
    def _fine(self) -> Plan:
        """The plan with a fine rung of shading, by which the light and that are judged."""
        return _with_step(self.plan, FINE_STEP)

    def _viewer(self, without: frozenset[str], plan: Plan) -> Viewer:
        kept = tuple(name for name in plan.order if name not in without)
        return self.viewer(replace(plan, order=kept))

    def _drawn(
        self, state: GelState, without: frozenset[str], plan: Plan | None = None
    ) -> RenderedFrame:
        viewer = self._viewer(without, plan or self._coarse)
        key = (id(state), plan is None, viewer.plan.order)
        if key not in self._kept:
            self._kept[key] = viewer.frame(state, None, 0, 0.0)
            self._kept_as[key] = 1 if plan is None else FINE_PICTURES
        found: RenderedFrame = self._kept[key]
        return found


def _with_step(plan: Plan, pixel_step: int) -> Plan:
    step = (("pixel_step", pixel_step),)
    choices = tuple(
        replace(c, rung_parameters=step) if c.effect == SHADING and c.included else c
        for c in plan.choices
    )
    return replace(plan, choices=choices)


def _with_safety(px: float, safety: float) -> Bound:
    return picture(rounded_up(safety * px + FLOOR_PX, PICTURE_DIGITS))


def _jointly(known: PictureSizes, whole_px: float, names: Sequence[str]) -> PictureSizes:
    """What is known with the common size of effects, in equal parts that combine to it."""
    part = picture(whole_px / math.sqrt(len(names)))
    return replace(known, together=dict.fromkeys(names, part))


@dataclass(frozen=True, eq=False)
class _Dots:
    """The dots that a detector finds in a picture, to be compared with those of others."""

    detector: Detector
    found_px: NDArray[np.float64]
    """The detection next to each dot that is drawn."""
    is_found: NDArray[np.bool_]

    @classmethod
    def of(cls, frame: RenderedFrame) -> _Dots | None:
        """The dots of a frame; None where none is drawn."""
        if not frame.drawn.any():
            return None
        sizes = frame.diameter_px[frame.drawn]
        detector = Detector(DetectorSettings.for_diameters(sizes))
        return cls(detector, *_found(detector, frame))

    @property
    def count(self) -> int:
        """Number of dots."""
        return len(self.is_found)

    def shift_px(self, other: RenderedFrame) -> float | None:
        """Largest shift of a dot in another picture; None where many are found in one only."""
        found_px, is_found = _found(self.detector, other)
        if is_found.shape != self.is_found.shape:
            return None
        if (is_found != self.is_found).sum() > LOST_SHARE * self.count:
            return None
        apart = np.linalg.norm(found_px - self.found_px, axis=1)
        return float(apart[is_found & self.is_found].max(initial=0.0))


def _found(
    detector: Detector, frame: RenderedFrame
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The detection next to each drawn dot (m, 2), and whether (m,) it is the dot's for sure."""
    dots, centres_px = detector.detect(frame.image), frame.centres_px[frame.drawn]
    if len(dots.centres_px) == 0:
        return centres_px, np.zeros(len(centres_px), dtype=bool)
    apart, nearest = cKDTree(dots.centres_px).query(centres_px)
    return dots.centres_px[nearest], (apart < MATCH_PX) & dots.trustworthy[nearest]
