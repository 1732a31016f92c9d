"""The travel of the boundary between stick and slip, as the labels of the nodes tell it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from contact_pads import small_pad
from half_space import HalfSpace
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import STICK
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
RADIUS_MM, DEPTH_MM, MU, YOUNGS_MPA = 12.0, 0.2, 0.5, 0.147
A_MM = math.sqrt(RADIUS_MM * DEPTH_MM)
BALL = Tool.of([Sphere(shape="sphere", radius_mm=RADIUS_MM)], Path())
# Mindlin (1949): all slips from this shear on.
SHEAR_MM = 3 * MU * (4 / 3 * YOUNGS_MPA / 0.75 * math.sqrt(RADIUS_MM) * DEPTH_MM**1.5) * 1.5 / (
    16 * (YOUNGS_MPA / 3) * A_MM
)  # fmt: skip


def sheared(shares: Array) -> tuple[Pose, ...]:
    """A press, then shares of the shear at which all slips."""
    ways = (Pose(float(k + 2), SHEAR_MM * s, 0.0, DEPTH_MM) for k, s in enumerate(shares))
    return (Pose(), Pose(1.0, depth_mm=DEPTH_MM), *ways)


def on_half_space(nodes_across: int, shares: Array) -> list[GelState]:
    space = HalfSpace(nodes_across + 5, 2 * A_MM / nodes_across, YOUNGS_MPA)
    settings = ContactSettings(1e-5, MU, geometry="rest")
    return list(ContactSolver(space, BALL, settings).states(sheared(shares)))[1:]


def sticking(states: list[GelState]) -> Array:
    return np.array([(s.touch == STICK).sum() for s in states])


def mindlin_errors(nodes_across: int) -> tuple[float, float]:
    """Largest errors of c/a and of Q/(mu P) against Cattaneo and Mindlin."""
    shares = np.array([0.2, 0.4, 0.6, 0.8, 0.9])
    found = on_half_space(nodes_across, shares)
    force = np.array([s.force_n.sum(axis=0) for s in found])
    pulled = np.hypot(force[:, 0], force[:, 1]) / (-MU * force[:, 2])
    inner = np.sqrt(sticking(found) / (found[0].touch > 0).sum())
    # Shear over that of full slip is 1 - (c/a)².
    law = 1 - (1 - np.concatenate([[0.0], shares])) ** 1.5
    off = np.abs(inner[1:] - (1 - pulled[1:]) ** (1 / 3)).max()
    return float(off), float(np.abs(pulled - law).max())


@pytest.mark.slow
def test_the_sticking_circle_shrinks_as_cattaneo_and_mindlin_say() -> None:
    """c/a = (1 - Q/(mu P))^(1/3), counted in nodes; 16 nodes across."""
    circle, force = mindlin_errors(16)
    assert circle < 0.025
    assert force < 0.003


@pytest.mark.slow
def test_a_finer_mesh_is_nearer_to_mindlin() -> None:
    coarse, fine = mindlin_errors(8), mindlin_errors(16)
    assert fine[0] < 0.6 * coarse[0]
    assert fine[1] < 0.6 * coarse[1]


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.32, 0.49])
def test_the_boundary_travels_one_way_under_growing_shear(poisson: float) -> None:
    """On a bonded pad: from the rim inwards, until all of the contact slips."""
    pad = small_pad(poisson, 24, 2, 8.0, 2.0)
    solver = ContactSolver(SurfaceCompliance(pad), BALL, ContactSettings(1e-5, MU, geometry="rest"))
    shares = np.linspace(0.1, 3.0, 12)
    found = list(solver.states(sheared(shares)))[2:]
    count = sticking(found)
    # Of a contact that slides as a whole, nodes that enter at the front stick for a moment.
    assert 0 in count
    assert (np.diff(count[: np.argmin(count) + 1]) <= 0).all()
    assert count[0] > 0.5 * (found[0].touch > 0).sum()
    away = np.hypot(*solver.points_mm[:, :2].T)
    for state in found[: np.argmin(count)]:
        inside, outside = (state.touch == kind for kind in (STICK, 2))
        if inside.any() and outside.any():
            assert np.median(away[outside]) > np.median(away[inside])
