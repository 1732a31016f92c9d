"""Chance in the tracer: its random numbers, branches taken at random, diffuse coats, paths."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_cases import COATS, finger, media, slab
from sampled import quick
from slow_tracer import Ray, SlowTracer

from gelslim_optics.light import trace_geometry as column
from gelslim_optics.light.scene import LightScene, Medium
from gelslim_optics.light.source import EdgeLaunch, LedRow
from gelslim_optics.light.trace import TraceOptions, _job, _run, trace_light, trace_paths
from gelslim_optics.light.trace_face import scramble, turn_back, uniform

MASK = (1 << 64) - 1


def splitmix(z: int) -> int:
    """The finaliser of splitmix64 in whole numbers."""
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def test_random_numbers_are_those_of_splitmix64() -> None:
    # The first numbers of the generator with the seed 1234567, from its published program.
    for count, number in ((1, 6457827717110365317), (2, 3203168211198807973)):
        assert splitmix((1234567 + count * 0x9E3779B97F4A7C15) & MASK) == number
    rng = np.random.default_rng(1)
    for path in rng.integers(0, 1 << 63, 20, dtype=np.uint64):
        assert int(scramble(path)) == splitmix(int(path))
        for bounce, slot in ((0, 0), (1, 2), (17, 1), (9999, 3)):
            state = (int(path) + 0x9E3779B97F4A7C15 * (4 * bounce + slot + 1)) & MASK
            assert uniform(path, bounce, slot) == (splitmix(state) >> 11) / 2**53


def tallied(weight: float, cosine: float, split: float, count: int) -> np.ndarray:
    """Weights of equal rays in a slab that leave through its top or return through its foot."""
    scene = LightScene(
        slab(1e4, 1.0), (-1e4, 1e4), (-1.0, 1.0), (EdgeLaunch("foot_right"),), media(), COATS
    )
    job = _job(scene, scene.sources[0], TraceOptions(split=split, cut=0.0))
    sine = math.sqrt(1 - cosine**2)
    row = np.array([0.0, 0.0, -job.middle[1], 0.0, sine, cosine, weight, 0.0])
    leaked, returned = (column.PER_EDGE + k * 4 + e for k, e in ((0, 2), (2, 0)))
    found = []
    for block in range(16):
        rows = np.repeat(row[None], count // 16, axis=0)
        sums, *_ = _run(job, rows, np.uint64(99), block * count)
        assert sums[[leaked, returned]].sum() == pytest.approx(weight * len(rows), rel=1e-9)
        found.append(sums[leaked] / len(rows))
    return np.array(found)


@pytest.mark.parametrize(("weight", "split"), [(1.0, 0.5), (0.3, 0.5), (1.0, 1.0), (1.0, 1e-3)])
@pytest.mark.parametrize("share", quick([0.045, 0.5, 0.93], lambda s: s == 0.045))
def test_branches_at_random_keep_the_mean_of_a_division(
    weight: float, split: float, share: float
) -> None:
    """Two equal faces: the top passes w / (1 + R) of a weight w in the long run."""
    cosine = _cosine_that_reflects(share)
    found = tallied(weight, cosine, split, 32_000)
    expected = weight / (1 + share)
    error = found.std(ddof=1) / math.sqrt(len(found))
    assert abs(found.mean() - expected) < 4.5 * error + 1e-9
    assert error < 0.02 * weight


def _cosine_that_reflects(share: float) -> float:
    from scipy.optimize import brentq

    n = 1.4906

    def excess(angle: float) -> float:
        t = math.asin(min(n * math.sin(angle), 1.0))
        rs = math.sin(angle - t) / math.sin(angle + t)
        rp = math.tan(angle - t) / math.tan(angle + t)
        return (rs * rs + rp * rp) / 2 - share

    return math.cos(brentq(excess, 1e-3, math.asin(1 / n) - 1e-12, xtol=1e-14))


@pytest.mark.parametrize(
    "normal", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.0, 1.0, 0.0)]
)
def test_a_diffuse_coat_reflects_by_lamberts_law(normal: tuple[float, float, float]) -> None:
    coats = np.array([[0.0, 0.0, 0.0], [1.0, 0.7, 1.0]])
    n = np.array(normal)
    t = np.array([0.0, 0.0, 1.0]) if abs(n[0]) > 0.5 else np.array([1.0, 0.0, 0.0])
    s = np.cross(n, t)
    away = []
    for path in range(6000):
        ray = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 1.0, 1.0])
        assert turn_back(coats, 1, ray, np.uint64(path), 3, normal, 0.5) == 0.7
        assert ray[[0, 1, 2, 6]].tolist() == [0.1, 0.2, 0.3, 1.0]
        away.append(ray[3:6])
        assert -ray[3:6] @ n == pytest.approx(math.sqrt(uniform(np.uint64(path), 3, 1)))
    d = np.array(away)
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, rtol=1e-12)
    # Lambert: squares of the components along the face are 1/4, products and means are 0.
    np.testing.assert_allclose([(d @ t).mean(), (d @ s).mean()], 0, atol=0.03)
    np.testing.assert_allclose([((d @ t) ** 2).mean(), ((d @ s) ** 2).mean()], 0.25, atol=0.012)
    assert abs(((d @ t) * (d @ s)).mean()) < 0.015
    assert abs(((d @ t) ** 2 * (d @ s) ** 2).mean() - 1 / 24) < 0.004


def test_a_mirror_turns_the_ray_and_a_black_coat_leaves_it() -> None:
    coats = np.array([[1.0, 0.0, 0.0], [1.0, 0.7, 0.0]])
    ray = np.array([0.0, 0.0, 0.0, 0.48, 0.6, 0.64, 1.0])
    assert turn_back(coats, 0, ray, np.uint64(1), 0, (0.0, 0.6, 0.8), 0.872) == 0.0
    assert ray[3:6].tolist() == [0.48, 0.6, 0.64]
    assert turn_back(coats, 1, ray, np.uint64(1), 0, (0.0, 0.6, 0.8), 0.872) == 0.7
    np.testing.assert_allclose(ray[3:6], [0.48, 0.6 - 1.0464, 0.64 - 1.3952], atol=1e-15)


@pytest.mark.parametrize("mirror", ["", "gap"])
def test_paths_take_a_branch_of_the_slow_tracer_at_each_face(mirror: str) -> None:
    scene = replace(finger(1.2, mirror=mirror), sources=(LedRow("foot_right", (1.0, 4.0)),))
    slow = SlowTracer(scene, scene.sources[0], 0.0, (4, 4))
    medium = "leg" if mirror else "acrylic"
    paths = trace_paths(scene, 32, seed=2, max_points=60)
    assert len(paths) >= 24
    for colour, points in paths:
        assert colour == "white"
        way = np.diff(points, axis=0)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        ray = Ray(points[0], way[0], medium, 1.0, "foot_right")
        for here, onward in zip(points[1:-1], way[1:], strict=True):
            branches = [b for b in slow.step(ray) if np.abs(b.direction - onward).max() < 1e-6]
            assert len(branches) == 1
            np.testing.assert_allclose(branches[0].point, here, atol=1e-7)
            ray = replace(branches[0], point=here, direction=onward, weight=1.0)


def test_paths_are_cut_at_their_room() -> None:
    scene = finger(3.0)
    whole = trace_paths(scene, 8, seed=3, max_points=400)
    assert max(len(points) for _, points in whole) > 6
    short = trace_paths(scene, 8, seed=3, max_points=3)
    assert sum(len(points) for _, points in short) <= 8 * 3
    assert max(len(points) for _, points in short) <= 1 + 3
    for (_, one), (_, other) in zip(short[:2], whole[:2], strict=True):
        np.testing.assert_array_equal(one, other[: len(one)])


def test_sources_share_the_flux_by_their_powers() -> None:
    scene = finger(3.0)
    scene = replace(
        scene,
        sources=tuple(replace(s, power=p) for s, p in zip(scene.sources, (0.5, 2.0), strict=True)),
    )
    result = trace_light(scene, 3000, replicates=3, sampling="random", options=_bins(4, 10))
    assert result.shares == pytest.approx((0.2, 0.8))
    assert result.colours == ("red", "green")
    assert result.rays == 3000
    # 20 x 20 mm of gel in 40 bins.
    assert result.bin_area_mm2 == pytest.approx(10.0)
    assert result.maps.shape == (2, 3, 4, 10)
    assert result.ledger_gap() < 1e-12
    # 3000 rays over two sources and three replicates are 500, and 512 is the next power of 2.
    assert trace_light(scene, 3000, replicates=3).rays == 2 * 3 * 512
    assert trace_light(scene, 3072, replicates=3).rays == 2 * 3 * 512
    assert trace_light(scene, 1, replicates=1).rays == 2
    for counts in ({"replicates": 0}, {"threads": 0}):
        with pytest.raises(ValueError, match="at least 1"):
            trace_light(scene, 16, **counts)


def _bins(nx: int, ny: int) -> TraceOptions:
    return TraceOptions(bins=(nx, ny))


def test_a_face_that_is_not_there_has_no_area() -> None:
    scene = replace(finger(3.0), face="ceiling")
    result = trace_light(scene, 64, replicates=1)
    assert math.isnan(result.bin_area_mm2)
    assert result.arrived().value == 0
    assert "delivered" not in result.ledger()


@pytest.mark.parametrize(
    "wrong",
    [
        {"split": 0.9e-4},
        {"split": 1.1},
        {"cut": -1e-9},
        {"cut": 1.0},
        {"max_faces": 0},
        {"bins": (0, 4)},
        {"bins": (4, 0)},
    ],
)
def test_options_out_of_range_are_refused(wrong: dict) -> None:
    with pytest.raises(ValueError, match=r"must be (between|at least)"):
        TraceOptions(**wrong)
    assert TraceOptions(split=1.0, cut=0.0, max_faces=1, bins=(1, 1)).split == 1.0
    assert TraceOptions(split=1e-4).split == 1e-4


def test_rays_end_below_the_cut_and_after_the_last_face() -> None:
    """A clear pipe between perfect mirrors, whose only loss is the one that is asked for."""
    scene = LightScene(
        slab(3.0, 2.0, top="mirror", side="mirror"),
        (-1.0, 1.0),
        (-1.0, 1.0),
        (EdgeLaunch("foot_right", na=0.0),),
        {"air": Medium(1.0), "acrylic": Medium(1.5)},
        {"mirror": replace(COATS["mirror"], reflectance=0.5)},
        ends="mirror",
    )
    back = 0.2**2
    for options, truncated, faces in (
        # Up to the mirror, halved, down to the foot, where 4 % turn back, up again, ...
        (TraceOptions(split=1e-4, cut=0.4, max_faces=99), 0.5 * back, 2),
        (TraceOptions(split=1e-4, cut=0.6, max_faces=99), 0.5, 1),
        (TraceOptions(split=1e-4, cut=0.0, max_faces=1), 0.5, 1),
        (TraceOptions(split=1e-4, cut=0.0, max_faces=2), 0.5 * back, 2),
        (TraceOptions(split=1e-4, cut=0.0, max_faces=3), 0.25 * back, 3),
    ):
        result = trace_light(scene, 32, replicates=1, options=options)
        assert result.value("truncated") == pytest.approx(truncated, rel=1e-12)
        assert result.crossings == faces


def test_a_black_coat_ends_the_ray_even_without_a_cut() -> None:
    scene = LightScene(
        slab(3.0, 2.0, top="paint"),
        (-1.0, 1.0),
        (-1.0, 1.0),
        (EdgeLaunch("foot_right", na=0.0),),
        media(),
        COATS,
    )
    result = trace_light(scene, 32, replicates=1, options=TraceOptions(cut=0.0))
    assert result.crossings == 1
    assert result.value("stopped.top") == 1
