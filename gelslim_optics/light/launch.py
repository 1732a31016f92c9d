"""The rays that a source launches: positions, directions and weights from random points.

A launched ray is a row (x, y, z, dx, dy, dz, weight, reflected): the weight that enters its medium
and the weight that the foot reflects, of a flux of 1 per ray. Both are 0 for a ray that misses the
foot. The points are a scrambled Sobol sequence or pseudo-random.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.guide.profile import Edge, Segment
from gelslim_optics.light.scene import AIR, GEL, LightScene
from gelslim_optics.light.source import EdgeLaunch, LedRow, Source

Array = NDArray[np.float64]
Sampling = Literal["sobol", "random"]
DIMENSIONS = 4


def point_batches(
    count: int, batch: int, *, seed: int, replicate: int, source: int, sampling: Sampling
) -> Iterator[NDArray[np.float64]]:
    """`count` points of the unit cube (n, 4) in batches; the batch size never changes a point.

    A Sobol sequence is scrambled independently for every replicate and source, so that replicates
    are independent and each is unbiased. For Sobol `count` should be a power of 2.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, replicate, source]))
    if sampling == "sobol":
        from scipy.stats import qmc

        engine = qmc.Sobol(DIMENSIONS, scramble=True, seed=rng)
        draw = engine.random
    else:

        def draw(n: int) -> NDArray[np.float64]:
            return rng.random((n, DIMENSIONS))

    for start in range(0, count, batch):
        with warnings.catch_warnings():
            # Only the whole set needs a power of 2 of points, not each batch.
            warnings.simplefilter("ignore", UserWarning)
            points = draw(min(batch, count - start))
        yield points


def launch_medium(scene: LightScene, source: Source) -> str:
    """The medium in which the rays of a source start.

    Raises ValueError where the source's edge is missing, curved, or does not meet that medium.
    """
    edge = _source_edge(scene, source)
    sides = (edge.left, edge.right)
    if isinstance(source, EdgeLaunch):
        if source.into not in sides or source.into not in scene.media:
            raise ValueError(f"edge {edge.name} does not meet the clear medium {source.into!r}")
        return source.into
    inside = [medium for medium in sides if medium != AIR]
    if len(inside) != 1 or inside[0] not in scene.media:
        raise ValueError(f"LEDs at {edge.name}: the edge must have air on one side")
    return inside[0]


def launch(scene: LightScene, source: Source, points: Array) -> Array:
    """Rays (n, 8) for `points` (n, 4) in [0, 1): two for the position, two for the direction.

    Refraction and reflection at the foot follow Fresnel's equations for unpolarised light.
    """
    edge = _source_edge(scene, source)
    medium = launch_medium(scene, source)
    segment = edge.curve
    assert isinstance(segment, Segment)
    (ay, az), (by, bz) = segment.start, segment.end
    length = segment.length_mm
    along = ((by - ay) / length, (bz - az) / length)
    side = 1.0 if edge.left == medium else -1.0
    inward = (-side * along[1], side * along[0])
    if isinstance(source, LedRow):
        x, s, ray = _led_rays(scene, source, medium, points, length)
    else:
        x, s, ray = _edge_rays(scene, source, medium, points, length)
    deep, across, lengthwise, weight, reflected = ray
    y, z = (ay + by) / 2, (az + bz) / 2
    return np.stack(
        (
            x,
            y + s * along[0],
            z + s * along[1],
            lengthwise,
            deep * inward[0] + across * along[0],
            deep * inward[1] + across * along[1],
            weight,
            reflected,
        ),
        axis=1,
    )


Ray = tuple[Array, Array, Array, Array, Array]


def _led_rays(
    scene: LightScene, led: LedRow, medium: str, points: Array, length: float
) -> tuple[Array, Array, Ray]:
    place = points[:, 0] * len(led.x_mm)
    which = np.minimum(place.astype(np.int64), len(led.x_mm) - 1)
    x = np.asarray(led.x_mm, dtype=float)[which] + (place - which - 0.5) * led.size_mm
    s = led.offset_mm + (points[:, 1] - 0.5) * led.size_mm
    cosine = np.maximum(led.law.cosine(points[:, 2]), 1e-300)
    sine = np.sqrt(np.maximum(0.0, 1 - cosine * cosine))
    turn = 2 * math.pi * points[:, 3]
    across, lengthwise = sine * np.cos(turn), sine * np.sin(turn)
    if led.gap_mm > 0:
        with np.errstate(over="ignore"):
            path = led.gap_mm / cosine
            x, s = x + path * lengthwise, s + path * across
    x0, x1 = scene.x_mm
    met = (np.abs(s) <= length / 2) & (x >= x0) & (x <= x1)
    n1 = scene.media[AIR].index_for(led.colour, led.wavelength_um)
    n2 = scene.media[medium].index_for(led.colour, led.wavelength_um)
    ratio = n1 / n2
    inside = np.sqrt(np.maximum(0.0, 1 - ratio**2 * (1 - cosine * cosine)))
    rs = (n1 * cosine - n2 * inside) / (n1 * cosine + n2 * inside)
    rp = (n1 * inside - n2 * cosine) / (n1 * inside + n2 * cosine)
    reflected = np.where(met, (rs * rs + rp * rp) / 2, 0.0)
    weight = np.where(met, 1 - reflected, 0.0)
    return x, s, (inside, ratio * across, ratio * lengthwise, weight, reflected)


def _edge_rays(
    scene: LightScene, source: EdgeLaunch, medium: str, points: Array, length: float
) -> tuple[Array, Array, Ray]:
    x0, x1 = scene.gel_x_mm if medium == GEL else scene.x_mm
    x = x0 + (x1 - x0) * points[:, 0]
    s = (points[:, 1] - 0.5) * length
    index = scene.media[medium].index_for(source.colour, source.wavelength_um)
    widest = 1.0 if source.na is None else min(1.0, source.na / index)
    if source.planar:
        across = widest * (2 * points[:, 2] - 1)
        lengthwise = np.zeros_like(across)
    else:
        sine = widest * np.sqrt(points[:, 2])
        turn = 2 * math.pi * points[:, 3]
        across, lengthwise = sine * np.cos(turn), sine * np.sin(turn)
    deep = np.sqrt(np.maximum(0.0, 1 - across * across - lengthwise * lengthwise))
    return x, s, (deep, across, lengthwise, np.ones_like(x), np.zeros_like(x))


def _source_edge(scene: LightScene, source: Source) -> Edge:
    try:
        edge = scene.profile.edge(source.edge)
    except KeyError as missing:
        raise ValueError(f"light source at {source.edge!r}: no such edge") from missing
    if not isinstance(edge.curve, Segment):
        raise ValueError(f"light source at {source.edge!r}: the edge must be straight")
    return edge
