"""Light on the coat as a guide gives it: from a range of low directions, with shadows.

The irradiance of a place is the sum over directions of Lambert's law, over a share of ambient
light. A direction does not reach a place that is turned away from it (attached shadow) or that
stands behind a bulge of the surface (cast shadow). The directions are such that the change with the
slope is that of the rays traced for gelslim2 within 0.08: a part of the light of each side comes
back from the other one, so that shadows keep a third of the light.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pressed_samples import lit_bundle
from scipy.ndimage import map_coordinates

from gelslim_optics.light.light_map import LightMap, light_arrays
from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
AMBIENT_SHARE = 0.12
TRAVEL = np.array([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0]])
"""Mean direction of red, green and blue light along x and y."""
FORWARD = tuple(
    (elevation, azimuth, share * part)
    for elevation, share in ((7.5, 0.12), (12.0, 0.2), (22.0, 0.33), (33.0, 0.2))
    for azimuth, part in ((-25.0, 0.3), (0.0, 0.4), (25.0, 0.3))
)
FANS = (*FORWARD, (30.0, 180.0, 0.15))
"""Elevation, azimuth from the mean direction, and share of the light on a level surface."""
_MARCH_MM = 0.1


def sensitivity() -> float:
    """Relative change of the irradiance of a level surface per unit slope."""
    parts = [w * np.cos(np.radians(a)) / np.tan(np.radians(e)) for e, a, w in FANS]
    return (1 - AMBIENT_SHARE) * float(np.sum(parts))


def irradiance(height_mm: Array, slope: tuple[Array, Array], cell_mm: float) -> Array:
    """Irradiance (nx, ny, 3) over that of a level surface.

    Args:
        height_mm: (nx, ny) of the surface on a grid of square cells.
        slope: Its slopes (nx, ny) along x and y.
        cell_mm: Side of a cell.
    """
    area = np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    channels = []
    for travel in TRAVEL:
        direct = np.zeros(height_mm.shape)
        for elevation, azimuth, share in FANS:
            c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
            way = np.array([c * travel[0] - s * travel[1], s * travel[0] + c * travel[1]])
            steepness = float(np.tan(np.radians(elevation)))
            rise = (way[0] * slope[0] + way[1] * slope[1]) / steepness
            open_to = reached(height_mm, way, steepness, cell_mm)
            direct += share * np.maximum(1 - rise, 0) * open_to
        channels.append(AMBIENT_SHARE + (1 - AMBIENT_SHARE) * direct / area)
    return np.stack(channels, axis=2)


def reached(height_mm: Array, way: Array, steepness: float, cell_mm: float) -> Array:
    """Whether (nx, ny) light that travels along `way` and rises by `steepness` reaches a place."""
    row, column = np.indices(height_mm.shape).astype(float)
    found = np.ones(height_mm.shape)
    farthest = float(np.ptp(height_mm)) / steepness
    for back in np.arange(_MARCH_MM, farthest, _MARCH_MM):
        at = [row - way[0] * back / cell_mm, column - way[1] * back / cell_mm]
        before = map_coordinates(height_mm, at, order=1, mode="nearest")
        found[before < height_mm - back * steepness] = 0.0
    return found


def guided_bundle(poissons_ratio: float) -> Bundle:
    """The sensor with this light, as a tracer tallies it, and another Poisson's ratio."""
    plain = lit_bundle()
    material = replace(plain.material, poissons_ratio=poissons_ratio)
    light = LightMap.from_arrays(plain.light)
    steep = replace(light, elevation_deg=np.full(2, np.degrees(np.arctan(1 / sensitivity()))))
    with_fans = replace(steep, fans=tallied())
    return replace(plain.with_gel(material), light=light_arrays(with_fans))


def tallied() -> Array:
    """(2, 1, 1, b, 3) sums of red and green light as a tracer tallies them, in bins of direction.

    A bin has a twelfth of the sine of the elevation, and a twelfth of the turn.
    """
    fans = np.zeros((2, 12, 12, 3))
    for source, (x, y) in enumerate(TRAVEL[:2]):
        for elevation, azimuth, share in FANS:
            turn = np.degrees(np.arctan2(y, x)) + azimuth
            tangent = 1 / np.tan(np.radians(elevation))
            way = tangent * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
            at = int(12 * np.sin(np.radians(elevation))), int(turn % 360 / 30)
            fans[source][at] += share * np.array([1.0, *way])
    flat = fans.reshape(2, 1, 1, -1, 3)
    return flat[..., flat[..., 0].any(axis=(0, 1, 2)), :]
