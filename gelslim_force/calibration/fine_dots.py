"""Centres of dots for the camera's fit, with less bias than those for tracking.

Tracking leaves out pixels that are darker than the gel by less than a quarter of a dot's darkness,
so that noise around a dot does not move it. This shifts a centre by up to a few hundredths of a
pixel that depend on its place within a pixel and on the slope of a blurred edge. From frame to
frame they hardly change. A camera that is fitted to them does: the share that is left out is
therefore as small as the noise of the reference picture allows.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detection import Detector, as_planes, noise_of
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings

NOISES_LEFT_OUT = 4.0
"""Darkness of pixels that are left out, over the picture's noise. In drawn pictures with noise of
1 to 6 grey levels the median error of a centre is smallest between 3 and 6."""
MOST_MOVED_PX = 0.1
"""A dot that moves farther has dirt or glare beside it."""


def fine_centres_px(
    image: NDArray[np.uint8], dots: Detections, settings: DetectorSettings
) -> NDArray[np.float64]:
    """Return the centres (n, 2) of dots that were found with `settings`, measured again.

    A dot that is lost or moves too far by it keeps its centre.
    """
    sums = as_planes(image).sum(axis=2, dtype=np.uint16)
    darkness = float(np.median(dots.contrast) * np.median(sums))
    share = min(settings.weight_from, NOISES_LEFT_OUT * noise_of(sums) / max(darkness, 1.0))
    detector = Detector(dataclasses.replace(settings, weight_from=share))
    again = detector.detect_near(image, dots.centres_px, dots.moments_px2, compare=False)
    moved = np.hypot(*(again.centres_px - dots.centres_px).T)
    finer = again.found & (moved < MOST_MOVED_PX)
    return np.asarray(np.where(finer[:, None], again.centres_px, dots.centres_px))
