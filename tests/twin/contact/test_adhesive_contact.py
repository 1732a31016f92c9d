"""Adhesion against Johnson, Kendall and Roberts on a half-space, and against a layer of springs."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, small_pad
from half_space import HalfSpace
from numpy.typing import NDArray

from gelslim_twin.contact.adhesive_contact import AdhesiveContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import FlatPunch, Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
RADIUS_MM, PITCH_MM = 40.0, 0.25
STIFF_MPA = YOUNGS_MPA / (1 - HalfSpace.POISSON**2)
BALL = Tool.of([Sphere(shape="sphere", radius_mm=RADIUS_MM)], Path())
SETTINGS = ContactSettings(1e-4, 0.0, geometry="rest")


def work_n_mm(unloaded_mm: float) -> float:
    """Work of adhesion by which the contact has this radius without load: a³ = 9 π w R²/(2 E*)."""
    return unloaded_mm**3 * 2 * STIFF_MPA / (9 * math.pi * RADIUS_MM**2)


def jkr(work: float) -> tuple[Array, Array, Array]:
    """Depth, force and radius of the stable branch, by depth."""
    a = np.linspace(1e-3, 12.0, 20001)
    depth = a**2 / RADIUS_MM - np.sqrt(2 * math.pi * work * a / STIFF_MPA)
    force = 4 * STIFF_MPA * a**3 / (3 * RADIUS_MM) - np.sqrt(8 * math.pi * work * STIFF_MPA * a**3)
    first = int(depth.argmin())
    return depth[first:], force[first:], a[first:]


@cache
def cycle(nodes: int) -> tuple[Array, Array, Array, Array]:
    """Depths, forces over π w R, radii over that without load, of a ball in and out.

    `nodes` are on the radius without load. The work is that of the ball.
    """
    unloaded = nodes * PITCH_MM
    work = work_n_mm(unloaded)
    depth, _, radius = jkr(work)
    deepest = float(np.interp(1.25 * unloaded, radius, depth))
    space = HalfSpace(int(2.7 * nodes) + 4, PITCH_MM, YOUNGS_MPA)
    contact = AdhesiveContact(ContactSolver(space, BALL, SETTINGS), 1e3 * work)
    inwards = np.linspace(0.5 * depth[0], deepest, 16)
    outwards = np.linspace(deepest, 1.7 * depth[0], 40)[1:]
    depths = np.concatenate([inwards, outwards])
    poses = tuple(Pose(time_s=float(k), depth_mm=float(d)) for k, d in enumerate(depths))
    found = list(contact.states(poses))
    force = -np.array([s.force_n[:, 2].sum() for s in found])
    touched = np.array([(s.touch > 0).sum() for s in found])
    return (
        depths, force / (math.pi * work * RADIUS_MM),
        PITCH_MM * np.sqrt(touched / math.pi) / unloaded, np.arange(len(depths)) < 16,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("nodes", "pull_off", "curve"), [(5, 0.3, 0.5), (8, 0.12, 0.35), (12, 0.06, 0.2)]
)
def test_a_ball_follows_johnson_kendall_and_roberts(
    nodes: int, pull_off: float, curve: float
) -> None:
    """Pull-off -1.5 π w R, and the whole curve; the error falls with the nodes on the radius."""
    depths, force, radius, inwards = cycle(nodes)
    work = work_n_mm(nodes * PITCH_MM)
    depth, expected, expected_radius = jkr(work)
    assert force.min() == pytest.approx(-1.5, rel=pull_off)
    out = ~inwards & (depths > 0.7 * depth[0])
    wanted = np.interp(depths[out], depth, expected) / (math.pi * work * RADIUS_MM)
    assert np.abs(force[out] - wanted).max() < curve
    wanted = np.interp(depths[out], depth, expected_radius) / (nodes * PITCH_MM)
    assert np.abs(radius[out] - wanted).max() < 0.6 / nodes
    # It lets go where no branch is left, but for the bonds of single nodes.
    last = depths[~inwards & (radius > 0)].min()
    assert last == pytest.approx(depth[0], rel=0.3)


@pytest.mark.slow
def test_the_way_in_and_out_encloses_energy() -> None:
    """It jumps in at the surface and out below it; between, both ways are one branch."""
    depths, force, _, inwards = cycle(5)
    assert not force[inwards & (depths < 0)].any()
    assert force[~inwards & (depths > -0.005) & (depths < 0)].max() < -1.0
    both = np.concatenate([[depths[0]], depths, [depths[0]]])
    lost = float(np.trapezoid(np.concatenate([[0.0], force, [0.0]]), both))
    assert lost > 0.5 * abs(depths[~inwards].min())


def pulled_off(work: float, shape: Tool, pad: SurfaceCompliance, depths: Array) -> Array:
    contact = AdhesiveContact(ContactSolver(pad, shape, SETTINGS), 1e3 * work)
    poses = tuple(Pose(time_s=float(k), depth_mm=float(d)) for k, d in enumerate(depths))
    return -np.array([s.force_n[:, 2].sum() for s in contact.states(poses)])


@pytest.mark.slow
def test_a_ball_on_a_thin_layer_is_held_by_two_pi_w_r() -> None:
    """A compressible layer far thinner than the contact is a bed of springs: 2 π w R."""
    pad = SurfaceCompliance(small_pad(0.0, 40, 2, 10.0, 0.5))
    stiffness, unloaded = YOUNGS_MPA / 0.5, 3.0
    work = stiffness * (unloaded**2 / (2 * RADIUS_MM)) ** 2 / 2
    length = math.sqrt(2 * work / stiffness)
    force = pulled_off(work, BALL, pad, np.linspace(0.3 * length, -1.2 * length, 30))
    assert force.min() == pytest.approx(-2 * math.pi * work * RADIUS_MM, rel=0.1)


def test_a_bond_breaks_at_once_or_holds() -> None:
    """All forces within the bonds, none across a gap; pulled far enough, the gel is at rest."""
    punch = Tool.of([FlatPunch(shape="flat_punch", length_mm=4.5, width_mm=4.5)], Path())
    pad = SurfaceCompliance(small_pad(0.3, 10, 2, 10.0, 2.0))
    contact = AdhesiveContact(ContactSolver(pad, punch, SETTINGS), 1.0)
    depths = np.array([0.0, 0.1, 0.0, -0.02, -0.06, -0.5])
    found = list(
        contact.states(tuple(Pose(float(k), depth_mm=float(d)) for k, d in enumerate(depths)))
    )
    push = [-float(s.force_n[:, 2].sum()) for s in found]
    assert push[1] > 0 > push[3]
    for state in found:
        pulled = state.force_n[:, 2]
        assert (pulled <= contact.tension_n * (1 + 1e-6)).all()
        assert not pulled[state.touch == 0].any()
    assert not found[-1].displacement_mm.any()


def test_areas_of_the_nodes_add_up_to_the_pad() -> None:
    pad = SurfaceCompliance(small_pad(0.3, 10, 2, 10.0, 2.0))
    contact = AdhesiveContact(ContactSolver(pad, BALL, SETTINGS), 1.0)
    assert contact._area_mm2.sum() == pytest.approx(100.0)
    assert contact.tension_n.max() == pytest.approx(2 * contact.tension_n.min())


def test_without_work_it_is_the_contact_without_adhesion_bit_for_bit() -> None:
    pad = SurfaceCompliance(small_pad(0.3, 10, 2, 10.0, 2.0))
    ball = Tool.of([Sphere(shape="sphere", radius_mm=6.0)], Path())
    poses = tuple(Pose(float(k), depth_mm=d) for k, d in enumerate((0.0, 0.3, 0.1, -0.1)))
    plain = ContactSolver(pad, ball, SETTINGS).states(poses)
    found = AdhesiveContact(ContactSolver(pad, ball, SETTINGS), 0.0).states(poses)
    for one, other in zip(found, plain, strict=True):
        assert one.force_n.tobytes() == other.force_n.tobytes()
        assert one.displacement_mm.tobytes() == other.displacement_mm.tobytes()
