"""What rays cost and bring for one finger: half-width of the 95 % interval against time.

An error is that of any colour, of other seeds and of the very rays that the study will trace, so
that an answer keeps the error it was chosen for by its own interval. Errors are the same in every
run; times come from the clock and decide nothing but what a budget of time asks. Above the
counts traced, errors go on with the square root of the rays, times with their number.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.light.study import RATIOS, study_light
from gelslim_core.budget.ladder import Ladder, Rung, Wording
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.trace import trace_light

TRACED = tuple(1 << k for k in range(11, 18))
"""Rays whose errors and times are measured."""
BEYOND = tuple(1 << k for k in range(18, 29))
SEEDS = (1000, 1001, 1002, 1003)
"""Not those that users start with: an interval that is small by chance is not taken at its word."""
GUIDES, SHARE_OF_CURVE = 3, 1 / 8
NOMINAL_MS_PER_RAY = 1.5e-3
"""A trace's time per ray on one core where none was measured."""
WORDING = Wording("number of rays", "error of the light on the coat", "for the study")
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class RayErrors:
    """Relative half-width of the 95 % interval of a colour's light on the coat, by rays traced."""

    halves: Mapping[int, float]

    def ladder(self, times_ms: Mapping[str, float]) -> Ladder:
        """Rungs from the fewest rays to the most; `times_ms` by name, else nominal."""
        last = max(self.halves)
        rungs = [
            _rung(rays, self.halves[rays], times_ms.get(rung_name(rays)), True)
            for rays in sorted(self.halves)
        ]
        slowest = times_ms.get(rung_name(last))
        for rays in BEYOND:
            more = rays / last
            half = self.halves[last] / math.sqrt(more)
            rungs.append(_rung(rays, half, None if slowest is None else slowest * more, False))
        return Ladder(tuple(rungs), WORDING)


def measure_errors(d: Lookup, seed: int = 0, progress: Progress | None = None) -> RayErrors:
    """Errors of a finger's light traced with `seed`: a second or two, always the same.

    At each count the larger of what other seeds err, root mean square, and what `seed` does. More
    rays never count as worse: where chance says so, the worse one counts for fewer rays too.
    """
    tell = progress or (lambda text, done, total: None)
    scene = light_scene(d, guide_profile(d))
    found = {}
    for done, rays in enumerate(TRACED):
        tell(f"rays: {rays}", done, len(TRACED))
        usual = [half_widths(trace_light(scene, rays, seed=other)) for other in SEEDS]
        own = half_widths(trace_light(scene, rays, seed=seed))
        found[rays] = max(float(np.sqrt(np.mean(np.square(usual)))), *own)
    halves: dict[int, float] = {}
    worst = 0.0
    for rays in reversed(TRACED):
        worst = max(worst, found[rays])
        halves[rays] = worst
    return RayErrors(dict(sorted(halves.items())))


def half_widths(light: LightResult) -> tuple[float, ...]:
    """Relative half-width of the 95 % interval of the light on the coat, of each colour."""
    estimates = [light.arrived(colour) for colour in light.colours]
    return tuple((e.high - e.low) / 2 / e.value if e.value else math.inf for e in estimates)


def measure_times(d: Lookup, progress: Progress | None = None) -> dict[str, float]:
    """Time in ms of a whole study at each number of rays traced, by the name of its rung."""
    tell = progress or (lambda text, done, total: None)
    study_light(d, rays=TRACED[0])
    times: dict[str, float] = {}
    for done, rays in enumerate(TRACED):
        tell(f"light with {rays} rays", done, len(TRACED))
        started = time.perf_counter()
        study_light(d, rays=rays)
        times[rung_name(rays)] = 1000 * (time.perf_counter() - started)
    return _rising(times)


def _rising(times: Mapping[str, float]) -> dict[str, float]:
    """Times made monotonic: a time with fewer rays is at most the time with more rays."""
    least = np.minimum.accumulate(list(times.values())[::-1])[::-1]
    return dict(zip(times, map(float, least), strict=True))


def rung_name(rays: int) -> str:
    """Name of the rung of so many rays per guide."""
    return f"{rays} rays"


def rays_of(rung: Rung) -> int:
    """Rays per guide of a rung."""
    return int(rung.work)


def times_key(spec_hash: str) -> str:
    """Names a finger's light among the times of a machine."""
    return f"light-{spec_hash[:32]}"


def _rung(rays: int, half: float, time_ms: float | None, measured: bool) -> Rung:
    if time_ms is None:
        time_ms = rays * (GUIDES + (len(RATIOS) + 1) * SHARE_OF_CURVE) * NOMINAL_MS_PER_RAY
    return Rung(rung_name(rays), half, time_ms, rays, measured)
