"""Contacts with a closed form: Hertz, thin bonded layers; and the gel at large strain."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, small_pad
from numpy.typing import NDArray
from tool_height import tool_height_mm

from gelslim_twin.contact.contact_forces import solve_contact_forces
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]


def contact(pad: Bundle, radius: float, friction: float = 0.0) -> ContactSolver:
    tool = Tool.of([Sphere(shape="sphere", radius_mm=radius)], Path())
    return ContactSolver(SurfaceCompliance(pad), tool, ContactSettings(1e-5, friction))


def pushed(pad: Bundle, radius: float, depth: float, friction: float = 0.0) -> float:
    poses = (Pose(), Pose(depth_mm=depth))
    return -float(list(contact(pad, radius, friction).states(poses))[-1].force_n[:, 2].sum())


def half_space(points: Array, pitch: float, youngs: float, poisson: float) -> Array:
    """Normal compliance of a half-space between square patches (Love 1929)."""

    def corner(x: Array, y: Array) -> Array:
        r = np.hypot(x, y)
        return x * np.log(y + r) + y * np.log(x + r)

    dx, dy = points[:, None, 0] - points[:, 0], points[:, None, 1] - points[:, 1]
    h = pitch / 2
    total = (corner(dx + h, dy + h) - corner(dx + h, dy - h)
             - corner(dx - h, dy + h) + corner(dx - h, dy - h))  # fmt: skip
    return np.asarray((1 - poisson**2) / (math.pi * youngs * pitch**2) * total)


def test_hertz_on_a_half_space() -> None:
    """Force, contact radius and the middle's pressure, better with a finer mesh."""
    radius, depth, poisson = 8.0, 0.3, 0.3
    a = math.sqrt(radius * depth)
    stiff = YOUNGS_MPA / (1 - poisson**2)
    force, peak = 4 / 3 * stiff * math.sqrt(radius) * depth**1.5, 2 * stiff * a / (math.pi * radius)
    errors = []
    for count in (13, 25):
        axis = np.linspace(-1.2 * a, 1.2 * a, count)
        pitch = axis[1] - axis[0]
        points = np.stack([p.ravel() for p in np.meshgrid(axis, axis)], axis=1)
        c = np.zeros((3 * len(points), 3 * len(points)))
        c[2::3, 2::3] = half_space(points, pitch, YOUNGS_MPA, poisson)
        height = (points**2).sum(axis=1) / (2 * radius) - depth
        found = solve_contact_forces(c, height, np.zeros((len(points), 2)), 0.0)
        push = -found.force_n[:, 2]
        errors.append(abs(push.sum() / force - 1))
        assert (push > 0).sum() * pitch**2 == pytest.approx(math.pi * a * a, rel=2 / count)
        middle = np.argmin((points**2).sum(axis=1))
        assert push[middle] / pitch**2 == pytest.approx(peak, rel=0.02)
    assert errors[-1] < 0.005


@pytest.mark.slow
def test_hertz_on_a_thick_pad() -> None:
    """A small ball on a pad five contact radii thick and wide; the rest is its finite size."""
    depth, radius, poisson = 0.25, 4.0, 0.3
    hertz = 4 / 3 * YOUNGS_MPA / (1 - poisson**2) * math.sqrt(radius) * depth**1.5
    coarse, fine = (
        pushed(small_pad(poisson, cells, layers, 8.0, 5.0), radius, depth)
        for cells, layers in ((10, 6), (20, 12))
    )
    # The bond below a depth of 5 contact radii stiffens by about a tenth (Dimitriadis 2002).
    chi = math.sqrt(radius * depth) / 5.0
    bonded = 1 + 0.884 * chi * 1.15
    assert abs(fine / (hertz * bonded) - 1) < 0.1
    assert abs(fine / (hertz * bonded) - 1) <= abs(coarse / (hertz * bonded) - 1) + 0.02


def test_thin_compressible_layer() -> None:
    """p = M w / h under a ball much larger than the layer is thick (Johnson 1985, 5.8)."""
    poisson, radius, depth, thick = 0.2, 120.0, 0.06, 0.5
    pad = small_pad(poisson, 26, 3, 13.0, thick)
    modulus = pad.material.lame_lambda_mpa + 2 * pad.material.shear_modulus_mpa
    winkler = math.pi * modulus * radius * depth**2 / thick
    assert pushed(pad, radius, depth) == pytest.approx(winkler, rel=0.08)


def test_thin_incompressible_layer() -> None:
    """The gel is squeezed out sideways: F = 2 π G R² d³ / h³ without friction on top.

    Lubrication with a free upper face: the flux is h³/3G dp/dr, and both p and dp/dr vanish at
    the edge, a² = 4 R d. Where the ball holds the upper face, the flux is a quarter.
    """
    poisson, radius, depth, thick = 0.4999, 100.0, 0.04, 0.5
    pad = small_pad(poisson, 30, 4, 12.0, thick)
    shear = pad.material.shear_modulus_mpa
    free = 2 * math.pi * shear * radius**2 * depth**3 / thick**3
    slips, sticks = (pushed(pad, radius, depth, friction) for friction in (0.0, 10.0))
    assert slips == pytest.approx(free, rel=0.3)
    assert 2.5 < sticks / slips < 4.2


def history(pad: Bundle, depths: list[float], friction: float, radius: float = 6.0) -> tuple[
    list[GelState], list[GelState], NonlinearContact
]:  # fmt: skip
    poses = tuple(Pose(time_s=k, depth_mm=d) for k, d in enumerate(depths))
    linear = list(contact(pad, radius, friction).states(poses))
    model = NonlinearContact(contact(pad, radius, friction), tolerance=3e-3)
    return linear, list(model.states(poses)), model


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_small_presses_are_linear(friction: float) -> None:
    linear, large, _ = history(small_pad(0.32), [0.0, 0.005, 0.01], friction, 40.0)
    for one, other in zip(linear[1:], large[1:], strict=True):
        assert np.linalg.norm(one.force_n - other.force_n) < 0.02 * np.linalg.norm(one.force_n)


@pytest.mark.parametrize("friction", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_deep_press(friction: float) -> None:
    """Sixty per cent of the thickness, down and up: nodal forces are those of the gel's law."""
    pad = small_pad(0.49)
    depths = [0.0, 0.3, 0.6, 0.9, 1.2, 0.6, -0.1]
    linear, large, model = history(pad, depths, friction)
    excess = [b.force_n[:, 2].sum() / a.force_n[:, 2].sum() - 1
              for a, b in zip(linear[1:5], large[1:5], strict=True)]  # fmt: skip
    assert (np.diff(excess) > 0).all()
    assert 0.03 < excess[0] < 0.2
    assert 0.6 < excess[3] < 2.0
    for state in large[1:6]:
        assert state.solver["residual"] <= 3 * 3e-3
        assert state.solver["penetration_mm"] <= 1.3e-3
    # One step from a nearby state, by another road: inner nodes found from the surface alone.
    held = model.law.force(large[2].displacement_mm)
    assert np.linalg.norm(held - large[2].force_n) < 0.02 * np.linalg.norm(large[2].force_n)
    if friction == 0:
        assert np.linalg.norm(large[5].force_n - large[2].force_n) < 0.03 * np.linalg.norm(
            large[2].force_n
        )
    assert not large[6].force_n.any()
    assert not large[6].displacement_mm.any()
    points = model.solver.points_mm + large[4].displacement_mm
    touched = large[4].touch > 0
    height = tool_height_mm(model.solver.tool, Pose(depth_mm=1.2), points[:, 0], points[:, 1])
    assert np.abs(points[touched, 2] - height[touched]).max() < 3e-3


def test_large_strain_adds_what_it_should() -> None:
    """A few per cent at 5 % of the thickness, a few tens at 30 %, for the usual gel."""
    linear, large, _ = history(small_pad(0.3223, 20, 4, 14.0), [0.0, 0.1, 0.3, 0.6], 0.5)
    excess = [b.force_n[:, 2].sum() / a.force_n[:, 2].sum() - 1
              for a, b in zip(linear[1:], large[1:], strict=True)]  # fmt: skip
    assert 0.0 < excess[0] < 0.04
    assert 0.03 < excess[1] < 0.11
    assert 0.1 < excess[2] < 0.28
