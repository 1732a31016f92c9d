"""Light of a finger's LEDs traced forwards by Mitsuba 3, to draw pressed gels with little noise.

A path from the coat finds an LED once in some thirty tries; of the light of an LED a third finds
the coat. Light is traced once from the LEDs through the guide to a plane in the gel below every
dent. From there it goes on in the scene of each dent: to the coat, which scatters its share, and
with what comes back to it. Rest and presses share the light up to the plane and, by their seed, the
random numbers of each ray from there, so that noise is common to them where nothing moves, as the
mottle of a coat is. Intersections, refraction, reflection and emission are those of
Mitsuba; the loops below follow the light and count it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.models.mitsuba_finger import Meshes, finger_shapes, sheet
from gelslim_optics.light.scene import LightScene, Medium

Array = NDArray[np.float64]
Rays = NDArray[np.float32]
GATE_MM = -1.0
"""Height of the plane where the light is kept: half of the gel's thickness."""
BATCH, MOST_FACES = 1 << 22, 200
AGAIN = 8
"""One in so many of the rays that the coat scatters first is followed, with as many times the
light; of those that it scatters again its reflectance."""


def of_one_source(scene: LightScene, number: int) -> LightScene:
    """The finger as light of one of its sources sees it: with the refractive indices of its colour.

    Light is not absorbed.
    """
    source = scene.sources[number]
    media = {
        name: Medium(getattr(medium, f"{source.colour}_index", None) or medium.index)
        for name, medium in scene.media.items()
    }
    return replace(scene, media=media, sources=(source,))


def stage(mi: Any, scene: LightScene, surface_mm: Array | None) -> Any:
    """The finger in Mitsuba, its meshes merged by material.

    Args:
        mi: The module `mitsuba` in a variant of LLVM.
        scene: What `of_one_source` returns.
        surface_mm: (ny, nx, 3) places of a lattice over the coat, whose texture coordinates run
            from 0 to 1 along x and y; None leaves out the coat.
    """
    with TemporaryDirectory() as folder:
        meshes = Meshes(Path(folder))
        if surface_mm is None:
            shapes = dict(finger_shapes(scene, sheet(np.zeros((2, 2, 3))), meshes))
            del shapes["coat"]
            return mi.load_dict({"type": "scene", **_merged(mi, shapes)})
        shapes = dict(finger_shapes(scene, sheet(surface_mm), meshes))
        bare = shapes.pop("coat")["bsdf"]
        rows, columns = np.indices(surface_mm.shape[:2])
        texture = np.stack([columns / columns.max(), rows / rows.max()], axis=2)
        coat = meshes.of("coat", sheet(surface_mm), bare, texture.reshape(-1, 2))
        return mi.load_dict({"type": "scene", "coat": coat, **_merged(mi, shapes)})


def _merged(mi: Any, shapes: Mapping[str, Any]) -> dict[str, Any]:
    """The same shapes with those of one material as one mesh; LEDs stay as they are."""
    found: dict[str, Any] = {}
    kinds: dict[str, Any] = {}
    plain: dict[str, Any] = {}
    for name, shape in shapes.items():
        if "light" in shape:
            found[name] = shape
            continue
        key = json.dumps(shape["bsdf"], sort_keys=True)
        if key not in kinds:
            kinds[key] = mi.load_dict(shape["bsdf"])
        plain[name] = shape | {"bsdf": kinds[key]}
    return {**found, "finger": {"type": "merge", **plain}}


def coat_of(full: Any) -> Any:
    """The coat among the shapes of a stage."""
    (found,) = [shape for shape in full.shapes() if shape.id() == "coat"]
    return found


@dataclass(frozen=True, eq=False)
class Photons:
    """Light of one source that rises through the plane, in rays that carry equal parts.

    Attributes:
        rays: (4, n) places along x and y where it crosses the plane, and its direction there.
        emitted: Number of rays that left the LEDs for these.
    """

    rays: Rays
    emitted: int


def kept_light(mi: Any, scene: LightScene, wanted: int, seed: int) -> Photons:
    """Trace light of a scene with one source until `wanted` rays have crossed the plane.

    Args:
        mi: The module `mitsuba` in a variant of LLVM.
        scene: What `of_one_source` returns.
        wanted: Least number of rays.
        seed: Of the random numbers; that of each batch is the next one.
    """
    empty = stage(mi, scene, None)
    half = [max(abs(v) for v in scene.gel_x_mm), _half_width_mm(scene)]
    found: list[Rays] = []
    while sum(part.shape[1] for part in found) < wanted:
        part = _risen(mi, empty, BATCH, seed + len(found))
        inside = (np.abs(part[0]) < half[0]) & (np.abs(part[1]) < half[1])
        found.append(part[:, inside])
    return Photons(np.concatenate(found, axis=1), BATCH * len(found))


def _half_width_mm(scene: LightScene) -> float:
    face = scene.profile.edge(scene.face).curve
    return max(abs(face.end[0]), abs(face.start[0]))


def _risen(mi: Any, empty: Any, count: int, seed: int) -> Rays:
    """(4, m) place and direction of the light of `count` rays that crosses the plane."""
    import drjit as dr

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count)
    ray, _, _ = empty.sample_emitter_ray(
        0.0, sampler.next_1d(), sampler.next_2d(), sampler.next_2d(), True
    )
    context = mi.BSDFContext(mi.TransportMode.Importance)
    found = dr.zeros(mi.Vector4f, count)
    risen = dr.full(mi.Bool, False, count)

    def step(
        active: Any, ray: Any, found: Any, risen: Any, faces: Any, index: Any, sampler: Any
    ) -> Any:
        hit = empty.ray_intersect(ray, active)
        way = (GATE_MM - ray.o.z) / ray.d.z
        crosses = active & (ray.d.z > 0) & (way > 0) & (~hit.is_valid() | (way < hit.t))
        at = ray.o + way * ray.d
        found = dr.select(crosses, mi.Vector4f(at.x, at.y, ray.d.x, ray.d.y), found)
        risen |= crosses
        active &= ~crosses & hit.is_valid() & (faces < MOST_FACES)
        sample, value = hit.bsdf(ray).sample(
            context, hit, sampler.next_1d(active), sampler.next_2d(active), active
        )
        active &= dr.max(value) > 0
        ray = dr.select(active, hit.spawn_ray(hit.to_world(sample.wo)), ray)
        return active, ray, found, risen, faces + 1, index, sampler

    start = (
        dr.full(mi.Bool, True, count), ray, found, risen,
        dr.zeros(mi.UInt32, count), dr.arange(mi.UInt32, count), sampler,
    )  # fmt: skip
    _, _, found, risen, *_ = dr.while_loop(
        start, lambda active, *_: active, step, mode="evaluated", compress=True
    )
    return np.array(found, dtype=np.float32)[:, np.array(risen)]


def irradiance(
    mi: Any, full: Any, photons: Photons, surface_mm: Array, cells: int, seed: int
) -> Array:
    """Light (cells, cells) that falls on the coat by material place, rows along y.

    Args:
        mi: The module `mitsuba`.
        full: The stage with the coat.
        photons: Light that rises through the plane.
        surface_mm: The lattice of the coat in `full`.
        cells: Points of the result along each axis, from edge to edge.
        seed: Of the random numbers.

    Returns:
        Light per area of the moved coat over the mean that the LEDs would give it without loss.
    """
    counted = np.zeros(cells * cells)
    for number, first in enumerate(range(0, photons.rays.shape[1], BATCH)):
        part = photons.rays[:, first : first + BATCH]
        counted += _landed(mi, full, part, cells, seed + number)
    share = counted.reshape(cells, cells) / photons.emitted * cells**2
    edge = np.ones(cells)
    edge[[0, -1]] = 0.5
    share /= edge[:, None] * edge * (cells / (cells - 1)) ** 2
    return share / _area(surface_mm, cells)


def _area(surface_mm: Array, cells: int) -> Array:
    """Area of the moved coat over that of the level one, at the points of the result."""
    from scipy.interpolate import RegularGridInterpolator

    ny, nx = surface_mm.shape[:2]
    along_y, along_x = np.gradient(surface_mm, axis=(0, 1))
    area = np.linalg.norm(np.cross(along_x, along_y), axis=2)
    level = np.prod(np.ptp(surface_mm[..., :2], axis=(0, 1)) / (nx - 1, ny - 1))
    axes = [np.linspace(0, 1, n) for n in (ny, nx)]
    wanted = np.linspace(0, 1, cells)
    grid = np.stack(np.meshgrid(wanted, wanted, indexing="ij"), axis=2)
    return np.asarray(RegularGridInterpolator(axes, area / level)(grid))


def _landed(mi: Any, full: Any, rays: Rays, cells: int, seed: int) -> Array:
    """(cells²,) light of rays from the plane on the coat, spread over the four nearest points."""
    import drjit as dr

    count = rays.shape[1]
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count)
    x, y, dx, dy = (mi.Float(v) for v in rays)
    dz = dr.safe_sqrt(1 - dx * dx - dy * dy)
    ray = mi.Ray3f(mi.Point3f(x, y, GATE_MM), mi.Vector3f(dx, dy, dz))
    coat = mi.ShapePtr(coat_of(full))
    context = mi.BSDFContext(mi.TransportMode.Importance)
    target = dr.zeros(mi.Float, cells * cells)

    def step(active: Any, ray: Any, light: Any, scattered: Any, faces: Any, sampler: Any) -> Any:
        hit = full.ray_intersect(ray, active)
        active &= hit.is_valid() & (faces < MOST_FACES)
        landed = active & (hit.shape == coat)
        at = mi.Point2f(hit.uv) * (cells - 1)
        low = dr.clip(mi.Point2u(at), 0, cells - 2)
        off = at - mi.Point2f(low)
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
            share = (off.x if i else 1 - off.x) * (off.y if j else 1 - off.y)
            place = (low.y + j) * cells + low.x + i
            dr.scatter_add(target, light * share, place, landed)
        sample, value = hit.bsdf(ray).sample(
            context, hit, sampler.next_1d(active), sampler.next_2d(active), active
        )
        active &= dr.max(value) > 0
        first = landed & ~scattered
        stays = sampler.next_1d(active) < dr.select(first, 1 / AGAIN, dr.max(value))
        active &= ~landed | stays
        light = dr.select(first, light * dr.max(value) * AGAIN, light)
        ray = dr.select(active, hit.spawn_ray(hit.to_world(sample.wo)), ray)
        return active, ray, light, scattered | landed, faces + 1, sampler

    start = (
        dr.full(mi.Bool, True, count), ray, dr.full(mi.Float, 1.0, count),
        dr.full(mi.Bool, False, count), dr.zeros(mi.UInt32, count), sampler,
    )  # fmt: skip
    dr.while_loop(start, lambda active, *_: active, step, mode="evaluated", compress=True)
    return np.array(target, dtype=float)
