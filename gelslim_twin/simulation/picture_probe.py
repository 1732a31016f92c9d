"""The probe of the picture: one pose drawn with and without each effect on its grey values.

A picture is evaluated by its dots, so that the size of an effect is the largest shift of a dot that
the force pipeline's detector finds, times a safety factor. A dot that it finds in one of the two
pictures only says that the effect decides more than a shift; then the bound stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.effects.dot_positions import RARE
from gelslim_twin.effects.effect import Bound, picture, rounded_up
from gelslim_twin.effects.grey_values import PIXEL_STEPS
from gelslim_twin.planning.plan import Plan
from gelslim_twin.planning.probing import NOISE, SHADING

if TYPE_CHECKING:
    from gelslim_twin.render.frame_renderer import RenderedFrame
    from gelslim_twin.simulation.picture import Viewer

SAFETY = 2.0
"""Factor on the largest shift of a dot at the pose that is drawn, for the other poses."""
NOT_DRAWN = frozenset({"motion_blur", "compression", NOISE})
"""Effects that the pictures of a probe leave out: each frame has its own noise, and one state shows
no motion."""


@dataclass(frozen=True)
class PictureSizes:
    """What a probe finds in pictures, with its safety factor.

    Attributes:
        sizes: By effect, the error of leaving it out.
        coarsest: By effect, the error of its coarsest rung.
    """

    sizes: Mapping[str, Bound]
    coarsest: Mapping[str, Bound]


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
                px = dots.shift_px(self._drawn(state, self.plan, NOT_DRAWN))
                if px is not None:
                    missed = picture(rounded_up(SAFETY * px))
                    coarsest[name] = missed.plus(self.plan.choice(SHADING).error)
                continue
            other = NOT_DRAWN - {name} if name == NOISE else NOT_DRAWN | {name}
            px = dots.shift_px(self._drawn(state, self._coarse, other))
            if px is not None:
                px *= self._rare(dots.count) if name == NOISE else 1.0
                sizes[name] = picture(rounded_up(SAFETY * px))
        return PictureSizes(sizes, coarsest)

    @cached_property
    def _coarse(self) -> Plan:
        """The plan with the coarsest rung of shading, which hardly moves a dot."""
        step = tuple(sorted({"pixel_step": PIXEL_STEPS[0]}.items()))
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


@dataclass(frozen=True, eq=False)
class _Dots:
    """The dots of a picture, which are looked for in others."""

    detector: Detector
    starts_px: NDArray[np.float64]
    moments_px2: NDArray[np.float64]
    detections: Detections

    @classmethod
    def of(cls, frame: RenderedFrame) -> _Dots | None:
        """The dots of a frame that a detector may find; None where none is drawn."""
        sizes, starts = frame.diameter_px[frame.drawn], frame.centres_px[frame.drawn]
        if len(sizes) == 0:
            return None
        round_px2 = sizes**2 / 16
        moments = np.column_stack([round_px2, 0 * sizes, round_px2])
        detector = Detector(DetectorSettings.for_diameters(sizes))
        found = detector.detect_near(frame.image, starts, moments, compare=False)
        return cls(detector, starts, moments, found)

    @property
    def count(self) -> int:
        """Number of dots."""
        return len(self.starts_px)

    def shift_px(self, other: RenderedFrame) -> float | None:
        """Largest shift of a dot in another picture; None where a dot is found in one only."""
        mine, at = self.detections, (self.starts_px, self.moments_px2)
        its = self.detector.detect_near(other.image, *at, compare=False)
        if (mine.found != its.found).any():
            return None
        apart = np.linalg.norm(mine.centres_px - its.centres_px, axis=1)
        return float(apart[mine.found].max(initial=0.0))
