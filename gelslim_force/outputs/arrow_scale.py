"""How long arrows are drawn: one scale per run, so that its pictures can be compared."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.frame_result import FrameResult

_STEPS = (1.0, 2.0, 5.0, 10.0)
_ARROW_PX, _ARROW_MM, _MOST_GAIN = 24.0, 1.6, 10.0


@dataclass(frozen=True)
class ArrowScale:
    """Scales of one picture. Raises ValueError unless all are positive numbers."""

    motion_gain: float
    """Length of a displacement arrow divided by the displacement in the picture."""
    traction_mm_per_mpa: float
    """Length of a traction arrow, measured on the gel."""
    pressure_mpa: float
    """Pressure that is drawn with the full shade."""
    force_bar_n: float
    torque_bar_nmm: float
    """Force and torque at which the bars of the legend are full."""

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: must be a positive number")


@dataclass(frozen=True)
class Extent:
    """The largest values that arrows of some frames show; 0 where there are none."""

    motion_px: float = 0.0
    shear_mpa: float = 0.0
    pressure_mpa: float = 0.0
    force_n: float = 0.0
    torque_nmm: float = 0.0

    def joined(self, other: Extent) -> Extent:
        """Return the larger value of each quantity."""
        return Extent(*(max(pair) for pair in zip(astuple(self), astuple(other), strict=True)))

    def outgrown_by(self, other: Extent) -> bool:
        """Return whether any value in `other` is more than twice as large."""
        return any(b > 2 * a for a, b in zip(astuple(self), astuple(other), strict=True))


def extent(result: FrameResult) -> Extent:
    """Return 98th percentiles of motion, shear and pressure, and the largest force and torque."""
    motion = shear = pressure = force = torque = 0.0
    if result.tracks is not None:
        motion = _high(np.hypot(*result.tracks.displacement_px[result.tracks.tracked].T))
    if result.field is not None:
        tangential = np.hypot(*result.field.traction_mpa[:, :2].T)
        shear = _high(tangential[tangential > 0])
        pressure = _high(-result.field.traction_mpa[result.field.contact, 2])
    if result.wrench is not None:
        force = float(np.nan_to_num(np.abs(result.wrench.force_n)).max())
        torque = float(np.nan_to_num(np.abs(result.wrench.torque_nmm)).max())
    return Extent(motion, shear, max(pressure, 0.0), force, torque)


def scale_for(largest: Extent) -> ArrowScale:
    """Return round scales (1, 2 or 5 times a power of ten) for the largest values of a run.

    The largest arrows become about 24 px and 1.6 mm long. The limit of the gain prevents that the
    noise of a run without contact looks like motion; the forces have the lower limits 0.1 kPa,
    10 mN and 0.1 N mm for the same reason.
    """
    gain = _MOST_GAIN
    if largest.motion_px > 0:
        gain = min(_MOST_GAIN, round_step(_ARROW_PX / largest.motion_px))
    return ArrowScale(
        motion_gain=gain,
        traction_mm_per_mpa=round_step(_ARROW_MM / max(largest.shear_mpa, 1e-4)),
        pressure_mpa=_rounded_up(max(largest.pressure_mpa, 1e-4)),
        force_bar_n=_rounded_up(max(largest.force_n, 0.01)),
        torque_bar_nmm=_rounded_up(max(largest.torque_nmm, 0.1)),
    )


def scale_of_run(results: Iterable[FrameResult]) -> ArrowScale:
    """Return the scale for all frames of a run, such as those of `RecordedRun.results()`."""
    largest = Extent()
    for result in results:
        largest = largest.joined(extent(result))
    return scale_for(largest)


class LiveScale:
    """A scale for a run whose end is not known: it starts from expected values and only shrinks.

    It shrinks in steps of 1, 2, 5 when an arrow would become twice too long, so that arrows do
    not flicker; the legend shows the present scale.
    """

    def __init__(self, expected: Extent) -> None:
        self._largest, self._scale = expected, scale_for(expected)

    def scale(self, result: FrameResult) -> ArrowScale:
        """Return the scale for the next frame."""
        seen = extent(result)
        if self._largest.outgrown_by(seen):
            self._largest = self._largest.joined(seen)
            self._scale = scale_for(self._largest)
        return self._scale


def round_step(value: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(step for step in _STEPS if step <= value / power * (1 + 1e-9))


def _rounded_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return power * min(step for step in _STEPS if step >= value / power * (1 - 1e-9))


def _high(values: NDArray[np.float64]) -> float:
    finite = values[np.isfinite(values)]
    return float(np.percentile(finite, 98)) if len(finite) else 0.0
