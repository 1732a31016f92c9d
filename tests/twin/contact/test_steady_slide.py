"""A flat punch that slides: its planes do not turn, so that the forces are solved once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_pads import small_pad

from gelslim_twin.contact.contact_forces import ContactForces
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.plane_iteration import PlaneIteration
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import FlatPunch
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

DEPTH_MM, WAY_MM, TURN_DEG, DOWN, STEPS = 0.25, 1.2, 8.0, 5, 30


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Number of sweeps of each solution for the forces, in their order."""
    found: list[int] = []
    original = PlaneIteration._balance

    def counted(self: PlaneIteration, *given: Any) -> ContactForces:
        balance = original(self, *given)
        found.append(balance.sweeps)
        return balance

    monkeypatch.setattr(PlaneIteration, "_balance", counted)
    return found


def walked() -> list[GelState]:
    """States of a square punch that was pressed, and slides and turns by 0.04 mm a step."""
    punch = FlatPunch(shape="flat_punch", length_mm=5.8, width_mm=5.8)
    solver = ContactSolver(
        SurfaceCompliance(small_pad(0.45, 24, 2, 12.0)), Tool.of([punch], Path()),
        ContactSettings(1e-4, 0.6),
    )  # fmt: skip
    ways = np.maximum(0.0, np.arange(1 - DOWN, STEPS + 1) / STEPS)
    depths = DEPTH_MM * np.minimum(1.0, np.arange(1, STEPS + DOWN + 1) / DOWN)
    poses = [
        Pose(0.01 * k, way * WAY_MM, 0.5 * way * WAY_MM, depth, twist_deg=TURN_DEG * way)
        for k, (way, depth) in enumerate(zip(ways, depths, strict=True))
    ]
    return list(solver.states(tuple(poses)))[DOWN:]


def test_forces_are_solved_once_where_planes_do_not_turn(
    solved: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half as many solutions as from loose to fine ones, and the same forces."""
    quick, few = walked(), len(solved)
    monkeypatch.setattr(PlaneIteration, "_is_flat", lambda self, surface: False)
    thorough = walked()
    assert len(solved) - few > 2 * few
    for one, other in zip(quick, thorough, strict=True):
        size = np.linalg.norm(other.force_n)
        assert np.linalg.norm(one.force_n - other.force_n) < 1e-3 * size
        assert ((one.touch > 0) == (other.touch > 0)).all()
