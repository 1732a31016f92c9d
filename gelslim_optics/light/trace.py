"""Trace light through a guide, from the sources to a flux ledger and irradiance maps."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.kernel_cache import drop_stale
from gelslim_optics.light.launch import Sampling, launch, launch_medium, point_batches
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene
from gelslim_optics.light.source import EndRow, Source
from gelslim_optics.light.trace_geometry import (
    END,
    OWNER,
    TraceGeometry,
    columns,
    face_names,
    pack,
)

Array = NDArray[np.float64]
# Sums are made per block and added in order, so that batches and threads change no bit.
BLOCK_RAYS = 4096
SMALLEST_SPLIT = 1e-4
KERNELS = ("trace_kernel", "trace_face", "trace_crossing")
HELPERS = ("trace_kernel", "trace_face", "trace_crossing", "trace_geometry")


@dataclass(frozen=True)
class TraceOptions:
    """How rays branch and end; weights are relative to the weight at launch.

    Attributes:
        split: At a face both branches are followed where the weaker one has at least this weight.
            Below it one branch is chosen at random (Russian roulette, unbiased). 1 follows one
            branch only.
        cut: Weight below which a ray ends; its weight is counted as truncated.
        max_faces: Number of faces after which a ray ends in the same way.
        bins: Numbers of bins (nx, ny) of the irradiance map.
        fans: Numbers of places (nx, ny) at which the directions of the light are told apart, and of
            bins of azimuth and of the sine of the elevation.
    """

    split: float = 5e-2
    cut: float = 1e-6
    max_faces: int = 10_000
    bins: tuple[int, int] = (40, 40)
    fans: tuple[int, int, int, int] = (4, 8, 12, 12)

    def __post_init__(self) -> None:
        if not SMALLEST_SPLIT <= self.split <= 1:
            raise ValueError(f"split = {self.split!r}: must be between {SMALLEST_SPLIT} and 1")
        if not 0 <= self.cut < 1:
            raise ValueError(f"cut = {self.cut!r}: must be at least 0 and less than 1")
        if self.max_faces < 1 or min(*self.bins, *self.fans) < 1:
            raise ValueError("max_faces and all numbers of bins must be at least 1")


@dataclass(frozen=True)
class _Job:
    """The arrays of a scene for one source."""

    geometry: TraceGeometry
    index: Array
    absorption: Array
    medium: int
    first_edge: int
    middle: tuple[float, float]
    limits: Array
    bins: tuple[int, int]
    fans: tuple[int, int, int, int]
    edges: int


def trace_light(
    scene: LightScene,
    rays: int,
    *,
    seed: int = 0,
    replicates: int = 8,
    sampling: Sampling = "sobol",
    options: TraceOptions | None = None,
    threads: int = 1,
    batch_rays: int = 1 << 16,
) -> LightResult:
    """Trace light through a scene.

    The first call compiles the kernel, which takes some seconds and is cached on disk.

    Args:
        scene: The scene.
        rays: Smallest number of rays, divided equally among sources and replicates. Each share is
            rounded up to a power of 2 for Sobol points.
        seed: Seed of the random numbers. Equal seed, rays and replicates give equal points in
            another scene, for a paired comparison.
        replicates: Number of independent replicates, from which errors are estimated.
        sampling: `sobol` or `random`.
        options: How rays branch and end.
        threads: Number of threads; it does not change the result.
        batch_rays: Number of rays launched at one time; it does not change the result.

    Returns:
        The tallies.

    Raises:
        ValueError: A count is below 1, or a source does not fit the profile.
    """
    for name, count in (("rays", rays), ("replicates", replicates), ("threads", threads)):
        if count < 1:
            raise ValueError(f"{name} = {count}: must be at least 1")
    options = options or TraceOptions()
    each = math.ceil(rays / (replicates * len(scene.sources)))
    if sampling == "sobol":
        each = 1 << (each - 1).bit_length()
    batch = max(1, batch_rays // BLOCK_RAYS) * BLOCK_RAYS
    faces = face_names(scene)
    width = columns(len(faces))
    tallies = np.zeros((len(scene.sources), replicates, width))
    maps = np.zeros((len(scene.sources), replicates, *options.bins))
    fans = np.zeros((len(scene.sources), *options.fans, 3))
    with nullcontext() if threads == 1 else ThreadPoolExecutor(threads) as pool:
        for s, source in enumerate(scene.sources):
            job = _job(scene, source, options)
            for r in range(replicates):
                pieces = point_batches(
                    each, batch, seed=seed, replicate=r, source=s, sampling=sampling
                )
                starts = (_centred(launch(scene, source, p), job.middle) for p in pieces)
                key = np.random.SeedSequence([seed, r, s, 1]).generate_state(1, np.uint64)[0]
                for sums, heat, fan in _blocks(pool, job, starts, key):
                    tallies[s, r] += sums
                    maps[s, r] += heat
                    fans[s] += fan
    power = sum(source.power for source in scene.sources)
    return LightResult(
        colours=tuple(source.colour for source in scene.sources),
        shares=tuple(source.power / power for source in scene.sources),
        edges=faces,
        face=scene.face,
        rays=each * replicates * len(scene.sources),
        tallies=tallies / each,
        maps=maps / each,
        bin_area_mm2=_bin_area(scene, options.bins),
        fans=fans / (each * replicates),
    )


def trace_paths(
    scene: LightScene, count: int = 200, *, seed: int = 0, max_points: int = 400
) -> tuple[tuple[str, Array], ...]:
    """Paths of `count` rays for a picture: pairs of colour and points (k, 3) in mm.

    At each face one branch is followed at random. Rays that miss the guide are left out, and rays
    that leave end at the last face. On average a ray has at most `max_points` points.
    """
    options = TraceOptions(split=1.0, max_faces=max_points)
    each = math.ceil(count / len(scene.sources))
    paths: list[tuple[str, Array]] = []
    for s, source in enumerate(scene.sources):
        job = _job(scene, source, options)
        points = next(point_batches(each, each, seed=seed, replicate=0, source=s, sampling="sobol"))
        starts = _centred(launch(scene, source, points), job.middle)
        key = np.random.SeedSequence([seed, 0, s, 1]).generate_state(1, np.uint64)[0]
        trail = np.zeros((each * max_points, 5))
        *_, written = _run(job, starts, key, 0, trail)
        trail = trail[:written]
        for number in np.unique(trail[:, 0]):
            line = trail[trail[:, 0] == number, 2:] + np.array([0.0, *job.middle])
            paths.append((source.colour, line))
    return tuple(paths)


def _job(scene: LightScene, source: Source, options: TraceOptions) -> _Job:
    geometry, number, middle = pack(scene)
    index, absorption = np.ones(len(number)), np.zeros(len(number))
    for name, medium in scene.media.items():
        index[number[name]] = medium.index_for(source.colour, source.wavelength_um)
        absorption[number[name]] = medium.absorption_per_mm
    names = face_names(scene)
    start = launch_medium(scene, source)
    first = END
    if not isinstance(source, EndRow):
        first = int(np.flatnonzero(geometry.facts[:, OWNER] == names.index(source.edge))[0])
    return _Job(
        geometry=geometry,
        index=index,
        absorption=absorption,
        medium=number[start],
        first_edge=first,
        middle=middle,
        limits=np.array([options.split, options.cut, options.max_faces]),
        bins=options.bins,
        fans=options.fans,
        edges=len(names),
    )


def _centred(starts: Array, middle: tuple[float, float]) -> Array:
    starts[:, 1] -= middle[0]
    starts[:, 2] -= middle[1]
    return starts


def _blocks(
    pool: ThreadPoolExecutor | None, job: _Job, batches: Iterator[Array], key: Any
) -> Iterator[tuple[Array, Array, Array]]:
    """Sums, maps and fans of the blocks of rays, in order; without a pool in this thread."""
    first = 0
    for starts in batches:

        def trace(i: int, s: Array = starts, f: int = first) -> tuple[Array, Array, Array, int]:
            return _run(job, s[i : i + BLOCK_RAYS], key, f + i)

        offsets = range(0, len(starts), BLOCK_RAYS)
        done = map(trace, offsets) if pool is None else pool.map(trace, offsets)
        for sums, heat, fan, _ in done:
            yield sums, heat, fan
        first += len(starts)


@cache
def _kernel() -> Any:
    """The compiled kernel; loads numba."""
    drop_stale(KERNELS, HELPERS, Path(__file__).parent)
    from gelslim_optics.light.trace_kernel import trace_block

    return trace_block


def _run(
    job: _Job, starts: Array, key: Any, first_ray: int, trail: Array | None = None
) -> tuple[Array, Array, Array, int]:
    trace_block = _kernel()

    sums, heat = np.zeros(columns(job.edges)), np.zeros(job.bins)
    fans = np.zeros((*job.fans, 3))
    trail = np.zeros((0, 5)) if trail is None else trail
    # Each branch that waits has at least the split weight, of a total of 1.
    depth = math.ceil(1 / job.limits[0]) + 4
    written = trace_block(
        *job.geometry,
        job.index,
        job.absorption,
        np.ascontiguousarray(starts),
        job.medium,
        job.first_edge,
        key,
        first_ray,
        job.limits,
        np.empty(7),
        np.empty((depth, 7)),
        np.empty((depth, 4), dtype=np.int64),
        np.empty(depth, dtype=np.uint64),
        sums,
        heat,
        fans,
        trail,
    )
    return sums, heat, fans, int(written)


def _bin_area(scene: LightScene, bins: tuple[int, int]) -> float:
    width = [e.curve.length_mm for e in scene.profile.edges if e.name == scene.face]
    g0, g1 = scene.gel_x_mm
    return sum(width) * (g1 - g0) / (bins[0] * bins[1]) if width else math.nan
