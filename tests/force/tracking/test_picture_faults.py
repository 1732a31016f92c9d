"""Torn and frozen pictures against contacts that look a little like them."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.picture_faults import PictureFaults

PITCH_PX = 20.0
COLUMNS, ROWS = 16, 12


@pytest.fixture(scope="module")
def faults() -> PictureFaults:
    row, column = (v.ravel() for v in np.mgrid[:ROWS, :COLUMNS])
    places = PITCH_PX * np.column_stack([column + 1, row + 1]).astype(float)
    sites = np.column_stack([row, column])
    return PictureFaults(ReferenceLattice(sites, places, np.arange(len(sites))))


def rows(faults: PictureFaults) -> np.ndarray:
    return faults.reference.sites[:, 0]


def moved(faults: PictureFaults, by_row: np.ndarray) -> np.ndarray:
    """Motion (n, 2) along y that is the same in each row, with noise."""
    motion = np.random.default_rng(1).normal(0, 0.05, (len(faults.reference), 2))
    motion[:, 1] += by_row[rows(faults)]
    return motion


def dotted(faults: PictureFaults) -> np.ndarray:
    """Dots of 8 px on a bright picture with noise."""
    y, x = np.mgrid[: 20 * (ROWS + 1), : 20 * (COLUMNS + 1)]
    away = np.hypot((x + 10) % 20 - 10, (y + 10) % 20 - 10)
    level = 160 - 120 / (1 + np.exp(2 * (away - 4)))
    noise = np.random.default_rng(2).normal(0, 2, (*level.shape, 3))
    return np.clip(level[..., None] + noise, 0, 255).astype(np.uint8)


def test_a_jump_between_two_lines_is_a_tear_wherever_it_is(faults: PictureFaults) -> None:
    level = np.zeros(len(faults.reference))
    for line in range(2, ROWS - 1):
        for jump in (-5.0, 1.5, 9.0):
            found = faults.torn(moved(faults, jump * (np.arange(ROWS) >= line)), level)
            assert "two parts" in found, (line, jump)
            assert f"{abs(jump):.1f} px" in found


def test_the_motion_of_a_gel_is_no_tear(faults: PictureFaults) -> None:
    """A rod across the gel, half of it sheared, and a drift: each falls off over two pitches."""
    level, line = np.zeros(len(faults.reference)), np.arange(ROWS) - 5.4
    rod = np.sign(line) * 4 * np.exp(-np.abs(line) / 2)
    sheared = 5 / (1 + np.exp(-line / 0.7))
    for motion in (rod, sheared, np.full(ROWS, 3.0), 0.02 * PITCH_PX * line):
        assert faults.torn(moved(faults, motion), level) == ""


def test_lines_of_dots_of_another_size_belong_elsewhere(faults: PictureFaults) -> None:
    motion, level = moved(faults, np.zeros(ROWS)), np.zeros(len(faults.reference))
    assert "other sizes" in faults.torn(motion, level + 0.15 * (rows(faults) > 8))
    contact = np.hypot(*(faults.reference.sites - [6, 8]).T) < 3
    assert faults.torn(motion, level + 0.3 * contact) == ""
    assert faults.torn(motion, level + 0.2) == ""


def test_lines_of_dots_that_a_strain_makes_larger_are_those_of_a_gel(faults: PictureFaults) -> None:
    """A rod across the gel, sheared along it: dots grow on one side and shrink on the other."""
    line = np.arange(ROWS) - 5.4
    motion = 7.0 / (1 + line**4 / 16)
    strain = np.gradient(motion) / PITCH_PX
    assert np.count_nonzero(np.abs(strain) > 0.08) > 2
    assert faults.torn(moved(faults, motion), 1.3 * strain[rows(faults)]) == ""
    assert "other sizes" in faults.torn(moved(faults, motion), -1.3 * strain[rows(faults)])
    still = moved(faults, np.zeros(ROWS))
    assert "other sizes" in faults.torn(still, 1.3 * strain[rows(faults)])
    # A part of the picture that lies some rows lower: its rows are farther apart to the last one.
    lower = 3.2 * np.maximum(np.arange(ROWS) - 7.0, 0.0)
    assert "other sizes" in faults.torn(moved(faults, lower), 0.25 * (rows(faults) > 7))


def test_neighbours_that_part_are_none_of_a_gel(faults: PictureFaults) -> None:
    level, motion = np.zeros(len(faults.reference)), moved(faults, np.zeros(ROWS))
    motion[40:46, 0] += 0.7 * PITCH_PX
    assert "gel cannot do" in faults.torn(motion, level)
    motion[40:46] = np.nan
    assert faults.torn(motion, level) == ""


@pytest.mark.parametrize("turned", [False, True])
def test_frozen_and_torn_rows_and_columns(turned: bool) -> None:
    row, column = (v.ravel() for v in np.mgrid[:ROWS, :COLUMNS])
    sites = np.column_stack([column, row] if turned else [row, column])
    places = PITCH_PX * np.column_stack([column + 1, row + 1]).astype(float)
    if turned:
        places = places[:, ::-1]
    looks = PictureFaults(ReferenceLattice(sites, places, np.arange(len(sites))))
    image, words = dotted(looks), "columns" if turned else "rows"

    def seen(picture: np.ndarray) -> str:
        return looks.broken(picture.swapaxes(0, 1) if turned else picture)

    assert seen(image) == ""
    assert seen(image[..., 0]) == ""
    frozen = image.copy()
    frozen[100:150] = frozen[100]
    assert f"{words} of the picture are the same" in seen(frozen)
    short = image.copy()
    short[100:110] = short[100]
    assert "are the same" not in seen(short)
    torn = image.copy()
    torn[103:] = np.roll(image, 11, axis=1)[103:]
    assert f"along one of its {words}" in seen(torn)
    covered = image.copy()
    covered[90:130, 60:160] = 255
    assert seen(covered) == ""
