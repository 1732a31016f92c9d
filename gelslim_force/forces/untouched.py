"""Forces of a frame in which nothing presses on the gel: they are errors, and say how large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.wrench import Wrench

_STILL = 0.01
"""Normal motion, over the thickness of the gel, up to which nothing presses."""
_NOTICED = 2.5
"""Standard deviations beyond which a component is no noise."""


def with_untouched(wrench: Wrench, reading: NormalReading | None, thickness_mm: float) -> Wrench:
    """The wrench of a frame, with its own size in the covariance where nothing touches the gel.

    The motion of the markers that it comes from has another cause than a load there: a shadow
    across dots, or a picture that is spoiled in some other way. What is within the noise adds
    nothing.

    Args:
        wrench: Of the frame.
        reading: Its normal motion.
        thickness_mm: Of the gel.
    """
    if not _untouched(reading, thickness_mm):
        return wrench
    sigma = np.maximum(wrench.standard_deviation, 1e-12)
    scores = np.abs(np.nan_to_num(wrench.vector) / sigma)
    share = np.maximum(0.0, 1 - (_NOTICED / np.maximum(scores, _NOTICED)) ** 2)
    error = np.nan_to_num(wrench.vector) * np.sqrt(share)
    return replace(wrench, covariance=wrench.covariance + np.outer(error, error))


def _untouched(reading: NormalReading | None, thickness_mm: float) -> bool:
    """Whether the normal motion is known and nothing presses on the gel or pulls at it."""
    if reading is None or not reading.known:
        return False
    return float(np.abs(reading.w_mm).max(initial=0.0)) <= _STILL * thickness_mm
