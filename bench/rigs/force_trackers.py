"""Ways to follow the dots of a stream, beside each other: time and error in pixels.

Ours searches windows round predicted places, or the whole of every frame. OpenCV's blob detector
searches the whole frame, and each dot is the nearest to a dot of the frame before. The follower of
Lucas and Kanade moves a patch of the frame before; it never sees a dot, so that its errors add up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.rigs.force_ladder_markers import blob_detector, nearest_dots
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.detection.settings import DetectorSettings
from gelslim_twin.render.frame_renderer import RenderedFrame

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Follow = Callable[[Image], Array]
"""Takes the next picture and returns the places (n, 2) of the reference's markers, NaN if lost."""
OURS, WHOLE = "windows", "whole frame"
BLOBS, FLOW = "OpenCV blobs, nearest neighbour", "Lucas-Kanade, pixels only"
_PATCH_PX = 21
_LEVELS = 2


def trackers(calibration: Calibration, first: Image) -> Iterator[tuple[str, Follow]]:
    """The trackers compared, by name, each at rest."""
    start = calibration.reference.positions_px
    ours = calibration.tracker()
    yield OURS, lambda image: ours.update(image).tracks.positions_px
    whole = calibration.tracker()

    def from_rest(image: Image) -> Array:
        whole.reset()
        return whole.update(image).tracks.positions_px

    yield WHOLE, from_rest
    yield BLOBS, blobs(start, calibration.detector)
    yield FLOW, flow(start, first)


def blobs(start: Array, sizes: DetectorSettings) -> Follow:
    """OpenCV's blob detector, and for each marker the dot nearest to its last place."""
    import cv2

    cv2.setNumThreads(1)
    detector, _ = blob_detector(sizes)
    last = start.copy()

    def follow(image: Image) -> Array:
        nonlocal last
        found = detector.detect(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
        dots = np.array([point.pt for point in found], dtype=float).reshape(-1, 2)
        last = dots[nearest_dots(last, dots)] if len(dots) else last
        return last

    return follow


def flow(start: Array, first: Image) -> Follow:
    """The pyramidal follower of Lucas and Kanade, from each frame to the next."""
    import cv2

    cv2.setNumThreads(1)
    before = cv2.cvtColor(first, cv2.COLOR_RGB2GRAY)
    places = start.astype(np.float32)[:, None]

    def follow(image: Image) -> Array:
        nonlocal before, places
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        places, _, _ = cv2.calcOpticalFlowPyrLK(
            before, grey, places, None, winSize=(_PATCH_PX, _PATCH_PX), maxLevel=_LEVELS
        )
        before = grey
        return places[:, 0].astype(float)

    return follow


def tracker_chain(
    follow: Follow,
    frames: list[RenderedFrame],
    markers: NDArray[np.int64],
    clock: Callable[[], float],
) -> Callable[[int], dict[str, Any]]:
    """Follows frame k of a cycle; gives its time in ms, its error in px, and the share misplaced.

    The error is the root mean square of the markers that are less than 2 px off.
    """

    def run(k: int) -> dict[str, Any]:
        begun = clock()
        places = follow(frames[k].image)
        spent_ms = (clock() - begun) * 1000
        off = np.hypot(*(places - frames[k].centres_px[markers]).T)
        near = off < 2.0
        return {
            "total": spent_ms,
            "error_px": float(np.sqrt((off[near] ** 2).mean())),
            "misplaced": float(1 - near.mean()),
        }

    return run
