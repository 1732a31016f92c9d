"""The probe of the picture: one pose drawn with and without each effect on its grey values.

A picture is evaluated by its dots, so that the size of an effect is the largest shift of a dot that
the force pipeline's detector finds, times a safety factor. Where more than a few dots are found in
one of the two pictures only, the effect decides more than a shift, and the bound stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.circumstances import PictureSizes
from gelslim_twin.effects.dot_positions import RARE
from gelslim_twin.effects.effect import Bound, picture, rounded_up
from gelslim_twin.effects.grey_values import PIXEL_STEPS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.probing import NOISE, SHADING

if TYPE_CHECKING:
    from gelslim_twin.render.frame_renderer import RenderedFrame
    from gelslim_twin.simulation.picture import Viewer

SAFETY, FLOOR_PX = 3.0, 0.01
"""Factor on the largest shift of a dot at the pose that is drawn, for the other poses, and what is
added to it. In 17 random scenes 2.7 was needed, or 2.3 with this addition, which a change of a few
pixels by one grey value may make."""
PICTURE_DIGITS = 2
"""Significant digits of what is found: one pixel that is rounded otherwise moves a dot."""
LOST_SHARE = 5e-3
"""Share of the dots that may be found in one of two pictures only, as behind spots."""
MATCH_PX = 3.0
"""Distance from a dot within which a detection is that of the dot."""
NOT_DRAWN = frozenset({"motion_blur", "compression", NOISE})
"""Effects that the pictures of a probe leave out: each frame has its own noise, and one state shows
no motion."""


@dataclass(frozen=True, eq=False)
class PictureProbe:
    """Draws a pose with the effects of a plan, and without one of them.

    Attributes:
        plan: The plan by bounds.
        viewer: How the sensor is seen by a plan.
        frames: Number of frames of the run.
    """

    plan: Plan
    viewer: Callable[[Plan], Viewer]
    frames: int

    def found(self, state: GelState, effects: Iterable[str]) -> PictureSizes:
        """What a state shows of effects, all but those whose dots are not found in both."""
        dots = _Dots.of(self._drawn(state, self._coarse, NOT_DRAWN))
        if dots is None:
            return PictureSizes({}, {})
        sizes, coarsest = dict[str, Bound](), dict[str, Bound]()
        for name in effects:
            if name == SHADING:
                px = dots.shift_px(self._drawn(state, self._shaded(PIXEL_STEPS[-1]), NOT_DRAWN))
                if px is not None:
                    coarsest[name] = _with_safety(px)
                continue
            other = NOT_DRAWN - {name} if name == NOISE else NOT_DRAWN | {name}
            px = dots.shift_px(self._drawn(state, self._coarse, other))
            if px is not None:
                px *= self._rare(dots.count) if name == NOISE else 1.0
                sizes[name] = _with_safety(px)
        return PictureSizes(sizes, coarsest)

    @property
    def _coarse(self) -> Plan:
        """The plan with the coarsest rung of shading, with which all but that is drawn."""
        return self._shaded(PIXEL_STEPS[0])

    def _shaded(self, pixel_step: int) -> Plan:
        step = (("pixel_step", pixel_step),)
        choices = tuple(
            replace(c, rung_parameters=step) if c.effect == SHADING and c.included else c
            for c in self.plan.choices
        )
        return replace(self.plan, choices=choices)

    def _rare(self, dots: int) -> float:
        """The largest of all dots and frames over the largest of the dots of one frame.

        Of n random shifts (Rayleigh's distribution) the largest is about sigma sqrt(2 ln n), and
        none is above sigma sqrt(2 ln(n/p)) but for a share p of the runs.
        """
        most = math.log(max(dots, 2) * max(self.frames, 1) / RARE)
        return math.sqrt(most / math.log(max(dots, 2)))

    def _drawn(self, state: GelState, plan: Plan, without: frozenset[str]) -> RenderedFrame:
        kept = tuple(name for name in plan.order if name not in without)
        return self.viewer(replace(plan, order=kept)).frame(state, None, 0, 0.0)


def _with_safety(px: float) -> Bound:
    return picture(rounded_up(SAFETY * px + FLOOR_PX, PICTURE_DIGITS))


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
