"""Light on the coat by single directions that were traced, whose bins no estimator knows.

The guide of gelslim2 is traced with LEDs that are off their places by more than they are located
to, with other random numbers, and with directions that are told apart ten times as finely as in a
bundle. They are drawn as a few dozen that carry equal parts of the light. The bundle of the sensor
has the light as its generator traces it: LEDs in place, bins as wide as a twelfth.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from guided_light import AMBIENT_SHARE, reached
from numpy.typing import NDArray
from pressed_samples import lit_bundle

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.light.light_map import LightMap, light_arrays
from gelslim_optics.light.trace import TraceOptions, trace_light
from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
COUNT, AROUND, RAYS = 40, 4, 1 << 17
"""Directions that are drawn of each source, those of about one elevation, and rays traced."""
OFFSET_MM, GAP_MM = 0.15, 0.1
"""By which the LEDs of the drawn light are shifted along their foot, and farther from it."""
DESIGN = Path(__file__).parents[2] / "designs" / "gelslim2.yaml"
_FINE = (1, 1, 120, 120)
_COARSE = (1, 1, 12, 12)


@cache
def traced(*, fine: bool) -> Array:
    """(2, b, 3) light by direction, mean over the gel, and its products with the tangent.

    It is the light that is drawn, or that of a bundle, whose bins are not `fine`.
    """
    spec = read_spec(DESIGN).spec
    d = derive(spec)
    scene = light_scene(d, guide_profile(d), sides_only=True)
    if fine:
        rows = [
            replace(source, offset_mm=sign * OFFSET_MM, gap_mm=source.gap_mm + GAP_MM)
            for source, sign in zip(scene.sources, (1, -1), strict=True)
        ]
        scene = replace(scene, sources=tuple(rows))
    bins = _FINE if fine else _COARSE
    found = trace_light(scene, RAYS, seed=int(fine), options=TraceOptions(fans=bins)).fans
    sums = found.reshape(len(found), -1, 3)
    sums = sums / sums[..., :1].sum(axis=1, keepdims=True)
    return np.asarray(sums[:, sums[..., 0].any(axis=0)])


def sensitivity(sums: Array) -> Array:
    """(k, 2) relative change of the light of each source per unit slope along x and y."""
    return (1 - AMBIENT_SHARE) * -sums[..., 1:].sum(axis=1)


@cache
def directions() -> tuple[Array, Array]:
    """(d, 3) share and tangent of the directions of each of the two sources."""
    red, green = (_drawn(sums) for sums in traced(fine=True))
    return red, green


def _drawn(sums: Array) -> Array:
    """Means of parts of equal light: of what comes from the source, and of what comes back."""
    lit = sums[sums[:, 0] > 0]
    ahead = lit[:, 2] * lit[:, 2].sum() > 0
    found = []
    for side in (lit[ahead], lit[~ahead]):
        share = side[:, 0].sum() / lit[:, 0].sum()
        rings = max(2, round(COUNT * share / AROUND))
        for ring in _parts(side[np.argsort(np.hypot(*side[:, 1:].T) / side[:, 0])], rings):
            turning = ring[np.argsort(ring[:, 1] / ring[:, 0])]
            found += [part.sum(axis=0) for part in _parts(turning, AROUND)]
    means = np.array(found) / lit[:, 0].sum()
    return np.column_stack([means[:, 0], means[:, 1:] / means[:, :1]])


def _parts(sums: Array, count: int) -> list[Array]:
    """Directions (b, 3) in their order, in parts of equal light."""
    share = sums[:, 0] / sums[:, 0].sum()
    ends = np.cumsum(share) - share / 2
    return [sums[np.minimum((ends * count).astype(int), count - 1) == k] for k in range(count)]


def traced_irradiance(height_mm: Array, slope: tuple[Array, Array], cell_mm: float) -> Array:
    """Irradiance (nx, ny, 3) over that of a level surface; arguments as of `irradiance`.

    Blue is the mean of red and green, as light of both sides in the third colour of the camera.
    """
    area = np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    channels = []
    for source in directions():
        direct = np.zeros(height_mm.shape)
        for share, *tangent in source:
            steepness = 1 / float(np.hypot(*tangent))
            shade = np.maximum(1 - tangent[0] * slope[0] - tangent[1] * slope[1], 0)
            way = np.array(tangent) * steepness
            direct += share * shade * reached(height_mm, way, steepness, cell_mm)
        channels.append(AMBIENT_SHARE + (1 - AMBIENT_SHARE) * direct / area)
    return np.stack([*channels, (channels[0] + channels[1]) / 2], axis=2)


def traced_bundle(poissons_ratio: float, *, fans: bool) -> Bundle:
    """The sensor with the light as a generator traces it, with its directions or without."""
    plain = lit_bundle()
    light, sums = LightMap.from_arrays(plain.light), traced(fine=False)
    steep = np.hypot(*sensitivity(sums).T)
    known = replace(
        light,
        elevation_deg=np.degrees(np.arctan(1 / steep)),
        fans=sums[:, None, None] if fans else None,
    )
    material = replace(plain.material, poissons_ratio=poissons_ratio)
    return replace(plain.with_gel(material), light=light_arrays(known))
