"""The area within an outline of straight and circular pieces, in closed form."""

import numpy as np

from gelslim_cad.markers.outline import Outline


def area_mm2(outline: Outline) -> float:
    """An arc of angle t and radius r adds r²(t - sin t)/2 to the area of its chord."""
    points, after = outline.points_mm, np.roll(outline.points_mm, -1, axis=0)
    chords = np.linalg.norm(after - points, axis=1)
    curved = outline.bulges != 0
    bulge = outline.bulges[curved]
    angle = 4 * np.arctan(bulge)
    radius = chords[curved] * (1 + bulge**2) / (4 * np.abs(bulge))
    within = np.sum(points[:, 0] * after[:, 1] - after[:, 0] * points[:, 1]) / 2
    return float(within + np.sum(radius**2 * (angle - np.sin(angle)) / 2))
