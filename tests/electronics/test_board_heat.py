"""Heat of a board against a finite-difference solution of the finger's cross-section."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

from gelslim_cad.electronics.heat import (
    OUTSIDE_W_PER_M2K,
    PLASTIC_W_PER_MK,
    board_k_per_w,
    fin_reach_mm,
)

STEP_MM = 0.1
AIR, ACRYLIC, COPPER_BOARD, LED = 0.026, 0.19, 20.0, 0.2


def section_km_per_w(
    *,
    wall: float = 1.5,
    gap: float = 0.1,
    width: float = 2.7,
    pedestal: float = 4.0,
    cover: float = 1.2,
    board: float = 0.8,
    above: float = 12.0,
) -> float:
    """Mean excess temperature of the board in K per W and m, by five-point differences.

    y runs from the outer face inwards, z from the back of the cover. Outside, convection; the
    chamber inside is air that lets no heat out.
    """
    led, foot, baffle, chamber, bezel = 0.7, 0.2, 0.8, 12.0, 4.0
    inner = wall + gap
    sides = (inner + width + gap + baffle + chamber, cover + pedestal + board + led + foot + above)
    shape = tuple(round(s / STEP_MM) for s in sides)
    y, z = np.meshgrid(*((np.arange(n) + 0.5) * STEP_MM for n in shape), indexing="ij")
    k = np.full(shape, AIR)
    k[(y < wall) | (z < cover) | (z > sides[1] - bezel)] = PLASTIC_W_PER_MK
    beside = (y > inner + 0.1) & (y < inner + width - 0.1)
    k[beside & (z < cover + pedestal)] = PLASTIC_W_PER_MK
    low = cover + pedestal
    plate = (y > inner) & (y < inner + width) & (z > low) & (z < low + board)
    k[plate] = COPPER_BOARD
    k[(abs(y - inner - width / 2) < 1.0) & (z > low + board) & (z < low + board + led)] = LED
    k[beside & (z > low + board + led + foot)] = ACRYLIC
    wall_y = (y > inner + width + gap) & (y < inner + width + gap + baffle)
    k[wall_y & (z < low + board + led + 5)] = PLASTIC_W_PER_MK
    size, index = k.size, np.arange(k.size).reshape(shape)
    rows, columns, values = [], [], []
    diagonal = np.zeros(shape)
    pairs = [(slice(None, -1), slice(None)), (slice(1, None), slice(None))]
    for one, other in (pairs, [tuple(reversed(p)) for p in pairs]):
        g = 2 * k[one] * k[other] / (k[one] + k[other])
        rows += [index[one].ravel(), index[other].ravel()]
        columns += [index[other].ravel(), index[one].ravel()]
        values += [-g.ravel()] * 2
        diagonal[one] += g
        diagonal[other] += g
    step = STEP_MM / 1000
    for face in ((0, slice(None)), (slice(None), 0), (slice(None), -1)):
        diagonal[face] += 1 / (1 / (OUTSIDE_W_PER_M2K * step) + 0.5 / k[face])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = sparse.coo_matrix(entries, shape=(size, size)).tocsc() + sparse.diags(diagonal.ravel())
    heat = plate / plate.sum()
    return float(spsolve(matrix.tocsc(), heat.ravel()).reshape(shape)[plate].mean())


def closed_form(wall: float = 1.5, width: float = 2.7) -> float:
    """The resistance of the cross-section that the program takes."""
    length = 1000.0
    return board_k_per_w(length, width, wall) * (length + 2 * fin_reach_mm(wall)) / 1000


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"wall": 3.0},
        {"gap": 0.3},
        {"width": 1.7},
        {"pedestal": 8.5},
    ],
)
def test_the_fit_of_the_cross_section(changes: dict[str, float]) -> None:
    known = {n: v for n, v in changes.items() if n in ("wall", "width")}
    assert closed_form(**known) == pytest.approx(section_km_per_w(**changes), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{"wall": 0.8}, {"gap": 0.05}, {"width": 4.2}, {"pedestal": 1.0}, {"board": 0.2},
     {"cover": 2.4}, {"above": 6.0}, {"pedestal": 14.0, "above": 16.0}],
)  # fmt: skip
def test_the_fit_in_further_fingers(changes: dict[str, float]) -> None:
    known = {n: v for n, v in changes.items() if n in ("wall", "width")}
    assert closed_form(**known) == pytest.approx(section_km_per_w(**changes), rel=0.1)


def test_a_fin_by_finite_differences() -> None:
    """A long wall, warm at one end: its heat is that of the reach, √(h k t)."""
    wall_mm, n, length_mm = 1.5, 4000, 80.0
    step = length_mm / 1000 / n
    conduct, convect = PLASTIC_W_PER_MK * wall_mm / 1000 / step, OUTSIDE_W_PER_M2K * step
    diagonal = np.full(n, 2 * conduct + convect)
    diagonal[-1] -= conduct
    matrix = sparse.diags([diagonal, -conduct, -conduct], [0, 1, -1], shape=(n, n)).tocsc()
    source = np.zeros(n)
    source[0] = conduct
    excess = spsolve(matrix, source)
    lost = OUTSIDE_W_PER_M2K * step * excess.sum()
    assert lost == pytest.approx(OUTSIDE_W_PER_M2K * fin_reach_mm(wall_mm) / 1000, rel=1e-2)
