"""The rays that a source launches: positions, directions and weights from random points.

A launched ray is a row (x, y, z, dx, dy, dz, weight, reflected): the weight that enters its medium
and the weight that the foot or end face reflects, of a flux of 1 per ray. Both are 0 for a ray
that misses that face. The points are a scrambled Sobol sequence or pseudo-random.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.guide.profile import Edge, Segment
from gelslim_optics.light.scene import AIR, GEL, LightScene
from gelslim_optics.light.source import AngularLaw, EdgeLaunch, EndRow, LedRow, Source

Array = NDArray[np.float64]
Sampling = Literal["sobol", "random"]
DIMENSIONS = 4
MOST_KEPT_POINTS = 1 << 14
"""Sobol sets of up to this many points, half a megabyte, are kept for the next scene."""
KEPT_SETS = 64
"""Sets that are kept: those of two numbers of rays, eight replicates and up to four sources."""


def point_batches(
    count: int, batch: int, *, seed: int, replicate: int, source: int, sampling: Sampling
) -> Iterator[NDArray[np.float64]]:
    """`count` points of the unit cube (n, 4) in batches; the batch size never changes a point.

    A Sobol sequence is scrambled independently for every replicate and source, so that replicates
    are independent and each is unbiased. For Sobol `count` should be a power of 2. The arrays may
    be read-only.
    """
    if sampling == "sobol" and count <= MOST_KEPT_POINTS:
        points = _kept_points(count, seed, replicate, source)
        yield from (points[start : start + batch] for start in range(0, count, batch))
        return
    draw = _drawer(seed, replicate, source, sampling)
    for start in range(0, count, batch):
        yield draw(min(batch, count - start))


@lru_cache(maxsize=KEPT_SETS)
def _kept_points(count: int, seed: int, replicate: int, source: int) -> NDArray[np.float64]:
    """A whole Sobol set: paired comparisons launch the same points in many scenes."""
    points = _drawer(seed, replicate, source, "sobol")(count)
    points.flags.writeable = False
    return points


def _drawer(
    seed: int, replicate: int, source: int, sampling: Sampling
) -> Callable[[int], NDArray[np.float64]]:
    """Function that gives the next n points (n, 4) of a sequence."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, replicate, source]))
    if sampling == "random":
        return lambda n: rng.random((n, DIMENSIONS))
    from scipy.stats import qmc

    engine = qmc.Sobol(DIMENSIONS, scramble=True, seed=rng)

    def draw(n: int) -> NDArray[np.float64]:
        with warnings.catch_warnings():
            # Only the whole set needs a power of 2 of points, not each batch.
            warnings.simplefilter("ignore", UserWarning)
            return np.asarray(engine.random(n))

    return draw


def launch_medium(scene: LightScene, source: Source) -> str:
    """The medium in which the rays of a source start.

    Raises ValueError where the source's edge is missing, curved, or does not meet that medium, and
    where the guide has no clear end face for an end row.
    """
    if isinstance(source, EndRow):
        met = any(source.into in (edge.left, edge.right) for edge in scene.profile.edges)
        if not met or source.into == AIR or source.into not in scene.media:
            raise ValueError(f"the guide has no end face of the clear medium {source.into!r}")
        if scene.ends != AIR:
            raise ValueError(f"LEDs at the {source.end} end: the ends must meet air")
        return source.into
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

    Refraction and reflection at the foot or end face follow Fresnel's equations for unpolarised
    light.
    """
    if isinstance(source, EndRow):
        return _end_rays(scene, source, launch_medium(scene, source), points)
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
    x = _along_row(led.x_mm, led.size_mm, points[:, 0])
    s = led.offset_mm + (points[:, 1] - 0.5) * led.size_mm
    cosine, across, lengthwise = _emitted(led.law, points)
    x, s = _over_gap(led.gap_mm, cosine, (x, lengthwise), (s, across))
    x0, x1 = scene.x_mm
    met = (np.abs(s) <= length / 2) & (x >= x0) & (x <= x1)
    inside, ratio, weight, reflected = _refracted(scene, led, medium, cosine, met)
    return x, s, (inside, ratio * across, ratio * lengthwise, weight, reflected)


def _end_rays(scene: LightScene, led: EndRow, medium: str, points: Array) -> Array:
    """Rays (n, 8) of a row at an end face; the first two numbers are places along y and z."""
    plane, inward = (scene.x_mm[0], 1.0) if led.end == "first" else (scene.x_mm[1], -1.0)
    y = _along_row(led.y_mm, led.size_mm, points[:, 0])
    z = led.z_mm + (points[:, 1] - 0.5) * led.size_mm
    cosine, across, upward = _emitted(led.law, points)
    y, z = _over_gap(led.gap_mm, cosine, (y, across), (z, upward))
    met = scene.profile.contains(medium, y, z)
    inside, ratio, weight, reflected = _refracted(scene, led, medium, cosine, met)
    x = np.full_like(y, plane)
    way = (inward * inside, ratio * across, ratio * upward)
    return np.stack((x, y, z, *way, weight, reflected), axis=1)


def _along_row(centres_mm: tuple[float, ...], size_mm: float, part: Array) -> Array:
    """Places on the LEDs of a row, along it, for numbers in [0, 1)."""
    place = part * len(centres_mm)
    which = np.minimum(place.astype(np.int64), len(centres_mm) - 1)
    found = np.asarray(centres_mm, dtype=float)[which] + (place - which - 0.5) * size_mm
    return np.asarray(found)


def _emitted(law: AngularLaw, points: Array) -> tuple[Array, Array, Array]:
    """Direction cosines of emitted rays: along the axis of the LED, and two across it."""
    cosine = np.maximum(law.cosine(points[:, 2]), 1e-300)
    sine = np.sqrt(np.maximum(0.0, 1 - cosine * cosine))
    turn = 2 * math.pi * points[:, 3]
    return cosine, sine * np.cos(turn), sine * np.sin(turn)


def _over_gap(
    gap_mm: float, cosine: Array, first: tuple[Array, Array], second: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Two coordinates behind the gap, from pairs of a coordinate at the LED and a direction."""
    (a, way_a), (b, way_b) = first, second
    if gap_mm == 0:
        return a, b
    with np.errstate(over="ignore"):
        path = gap_mm / cosine
        return a + path * way_a, b + path * way_b


def _refracted(
    scene: LightScene, led: LedRow | EndRow, medium: str, cosine: Array, met: NDArray[np.bool_]
) -> tuple[Array, float, Array, Array]:
    """Cosine in the medium, factor on the sines, weight that enters and weight reflected."""
    n1 = scene.media[AIR].index_for(led.colour, led.wavelength_um)
    n2 = scene.media[medium].index_for(led.colour, led.wavelength_um)
    ratio = n1 / n2
    inside = np.sqrt(np.maximum(0.0, 1 - ratio**2 * (1 - cosine * cosine)))
    rs = (n1 * cosine - n2 * inside) / (n1 * cosine + n2 * inside)
    rp = (n1 * inside - n2 * cosine) / (n1 * inside + n2 * cosine)
    reflected = np.where(met, (rs * rs + rp * rp) / 2, 0.0)
    weight = np.where(met, 1 - reflected, 0.0)
    return inside, ratio, weight, reflected


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


def _source_edge(scene: LightScene, source: LedRow | EdgeLaunch) -> Edge:
    try:
        edge = scene.profile.edge(source.edge)
    except KeyError as missing:
        raise ValueError(f"light source at {source.edge!r}: no such edge") from missing
    if not isinstance(edge.curve, Segment):
        raise ValueError(f"light source at {source.edge!r}: the edge must be straight")
    return edge
