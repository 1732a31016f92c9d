"""How far errors of the light reach, on fields whose correlation is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from gelslim_force.contact.noise_grain import noise_grain

Array = NDArray[np.float64]
SHAPE = 2, 120, 160
BIN_PX = 4
NOISE = 0.01


def white(rng: np.random.Generator) -> Array:
    return rng.normal(0, NOISE, SHAPE)


def blocks(rng: np.random.Generator, size: int = 4) -> Array:
    """Each value is that of a block of `size` x `size` bins."""
    coarse = rng.normal(0, NOISE, (SHAPE[0], SHAPE[1] // size, SHAPE[2] // size))
    return coarse.repeat(size, axis=1).repeat(size, axis=2)


def grain(change: Array, noise: float | Array = NOISE, valid: Array | None = None) -> Array:
    seen = np.ones(SHAPE[1:], dtype=bool) if valid is None else valid
    return noise_grain(change, np.broadcast_to(noise, SHAPE), seen, BIN_PX)


@pytest.mark.parametrize("seed", range(8))
def test_independent_errors_have_none_also_around_a_contact_and_dots(seed: int) -> None:
    rng = np.random.default_rng(seed)
    change = white(rng)
    y, x = np.mgrid[: SHAPE[1], : SHAPE[2]]
    inside = 1 - ((x - 70) ** 2 + (y - 50) ** 2) / 35.0**2
    change += 0.3 * np.maximum(inside, 0) * np.sin(x / 10)
    dots = (x % 8 < 3) & (y % 8 < 3)
    assert (grain(change, valid=~dots) == 1).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_contact_on_most_of_the_gel_is_no_compression(seed: int) -> None:
    """Waves on two thirds of the bins were taken for errors, ten times those of single bins."""
    rng = np.random.default_rng(seed)
    change = white(rng)
    y, x = np.mgrid[: SHAPE[1], : SHAPE[2]]
    inside = (x < 128) & (y < 96)
    assert inside.mean() > 0.6
    change += 0.3 * inside * np.sin(x / 5) * np.cos(y / 6)
    assert (grain(change) < 2.5).all()


def test_errors_that_sixteen_bins_share_count_as_one() -> None:
    """Means over many bins have √16 times the error that independent bins would give."""
    found = np.mean([grain(blocks(np.random.default_rng(k))) for k in range(8)], axis=0)
    assert found == pytest.approx([4, 4], rel=0.1)


@pytest.mark.parametrize("size", [2, 3])
def test_the_noise_of_wide_means_is_that_of_correlated_errors(size: int) -> None:
    """Moving means over `size` bins: the error of a wide mean is that of the white field."""
    rng = np.random.default_rng(size)
    field = uniform_filter(white(rng), (1, size, size), mode="wrap")
    own = NOISE / size
    wide = uniform_filter(field, (1, 24, 24), mode="wrap").std() * 24
    found = own * grain(field, own)
    assert found == pytest.approx([wide, wide], rel=0.3)


def test_steps_of_few_blocks_among_exact_ones_are_the_error() -> None:
    """Rounded as in the reference, most blocks seem exact; the others show the step."""
    rng = np.random.default_rng(5)
    rare = blocks(rng)
    step = 0.05 * np.sign(rare) * (np.abs(rare) > 1.7 * NOISE)
    assert 0.05 < (step != 0).mean() < 0.15
    noise = 1e-4
    each = noise * grain(step, noise) / 4
    assert (each > 0.02).all()
    assert (each < 0.05).all()


@pytest.mark.parametrize("make", [white, blocks])
def test_the_scale_of_the_noise_does_not_matter(make: Callable[[np.random.Generator], Array]):
    change = make(np.random.default_rng(6))
    assert grain(3 * change, 3 * NOISE) == pytest.approx(grain(change))


def test_bins_of_two_pixels_make_blocks_of_eight() -> None:
    """A block of a picture 320 px wide has 16 px as well."""
    change = blocks(np.random.default_rng(7), size=8)
    found = noise_grain(change, np.full(SHAPE, NOISE), np.ones(SHAPE[1:], dtype=bool), 2)
    assert found == pytest.approx([8, 8], rel=0.25)


def test_a_picture_that_is_hardly_seen_tells_nothing() -> None:
    valid = np.zeros(SHAPE[1:], dtype=bool)
    assert (grain(blocks(np.random.default_rng(8)), valid=valid) == 1).all()
    valid[:32, :32] = True
    assert (grain(blocks(np.random.default_rng(8)), valid=valid) == 1).all()
