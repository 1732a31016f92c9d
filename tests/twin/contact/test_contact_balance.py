"""Contact forces against the laws of contact, brute force and another library's solver."""

from __future__ import annotations

import itertools
import pickle
from pathlib import Path

import numpy as np
import pytest
from contact_pads import dense_compliance, small_pad, violations
from numpy.typing import NDArray
from scipy.optimize import nnls
from tool_height import tool_height_mm

from gelslim_twin.contact.contact_forces import FREE, SLIP, STICK, solve_contact_forces
from gelslim_twin.contact.coulomb_kernel import node_force
from gelslim_twin.contact.gel_state import ContactError
from gelslim_twin.scene.indenter import Cone, Cylinder, FlatPunch, Indenter, Ring, Sphere, Wedge
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool

Array = NDArray[np.float64]
SHAPES: dict[str, Indenter] = {
    "sphere": Sphere(shape="sphere", radius_mm=6),
    "cylinder": Cylinder(shape="cylinder", radius_mm=4, length_mm=50),
    "ring": Ring(shape="ring", outer_radius_mm=4, inner_radius_mm=2),
    "punch": FlatPunch(shape="flat_punch", radius_mm=3),
    "wedge": Wedge(shape="wedge", included_angle_deg=90, length_mm=50, tip_radius_mm=0),
    "cone": Cone(shape="cone", included_angle_deg=140, tip_radius_mm=0),
}
REACH_MM = 0.3


class Walk:
    """A tool on a pad with its dense compliance, pose by pose, small displacements."""

    def __init__(self, shape: Indenter, poisson: float, friction: float, cells: int = 12) -> None:
        self.bundle = small_pad(poisson, cells)
        self.compliance = dense_compliance(self.bundle)
        self.points = np.asarray(self.bundle.mesh.surface_mm)
        self.tool = Tool.of([shape], Path())
        self.friction = friction
        self.force = np.zeros_like(self.points)
        self.motion = np.zeros_like(self.points)
        self.touch = np.zeros(len(self.points), dtype=np.int8)
        self.before: Pose | None = None
        self.broken: dict[str, float] = {}

    def to(self, pose: Pose, tolerance: float = 1e-6) -> None:
        height = tool_height_mm(self.tool, pose, self.points[:, 0], self.points[:, 1])
        places = self.points + self.motion
        carried = places if self.before is None else self.tool.carried(self.before, pose, places)
        target = self.motion[:, :2] + (carried - places)[:, :2]
        near = np.flatnonzero(height < REACH_MM)
        dof = (3 * near[:, None] + np.arange(3)).ravel()
        block = self.compliance[np.ix_(dof, dof)]
        found = solve_contact_forces(
            block, height[near], target[near], self.friction, self.force[near], tolerance
        )
        assert found.residual <= max(tolerance, 1e-12)
        self.force = np.zeros_like(self.points)
        self.touch = np.zeros(len(self.points), dtype=np.int8)
        self.force[near], self.touch[near] = found.force_n, found.touch
        self.motion = (self.compliance @ self.force.reshape(-1)).reshape(-1, 3)
        new = violations(block, found.force_n, height[near], target[near], self.friction)
        self.broken = {k: max(v, self.broken.get(k, 0.0)) for k, v in new.items()}
        self.before = pose


def path(x: float) -> list[Pose]:
    """Press, slide, turn, then tilt on the way back."""
    press = [Pose(0, x, x, 0.1 * k) for k in range(5)]
    slide = [Pose(0, x + 0.1 * k, x, 0.4) for k in range(1, 7)]
    turn = [Pose(0, x + 0.6, x, 0.4, twist_deg=5 * k) for k in (1, 2)]
    tilt = [Pose(0, x + 0.6 - 0.3 * k, x + 0.1 * k, 0.4, 10, tilt_x_deg=3 * k) for k in (1, 2)]
    return press + slide + turn + tilt


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("poisson", [0.32, 0.49, 0.4999])
@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0, 3.0])
def test_laws_of_contact_hold(name: str, poisson: float, friction: float) -> None:
    """In the middle and on a corner of the pad."""
    for x in (0.0, 5.5):
        walk = Walk(SHAPES[name], poisson, friction)
        for pose in path(x):
            walk.to(pose)
        assert walk.force.any()
        assert walk.broken["angle_deg"] < 0.5
        assert all(v < 1e-4 for k, v in walk.broken.items() if k != "angle_deg"), walk.broken


def test_one_node_against_brute_force() -> None:
    """The exact node against a fine search over the friction force's direction."""
    rng = np.random.default_rng(3)
    kinds = {FREE: 0, STICK: 0, SLIP: 0}
    for _ in range(300):
        root = rng.standard_normal((3, 3))
        w, r = root @ root.T + 0.05 * np.eye(3), rng.standard_normal(3)
        mu = 10 ** rng.uniform(-1, 0.7)
        fx, fy, fz, state = node_force(w, *r, mu)
        kinds[state] += 1
        f = np.array([fx, fy, fz])
        off = w @ f - r
        if state == FREE:
            assert r[2] >= 0
            assert not f.any()
            continue
        assert fz < 0
        assert abs(off[2]) < 1e-9 * np.abs(r).max() * 10
        if state == STICK:
            assert np.abs(off).max() < 1e-9
            assert np.hypot(fx, fy) <= -mu * fz * (1 + 1e-9)
            continue
        angles = np.linspace(0, 2 * np.pi, 20001)
        d = np.stack([np.cos(angles), np.sin(angles)])
        pressed = r[2] / (w[2, 2] - mu * (w[2, 0] * d[0] + w[2, 1] * d[1]))
        forces = np.stack([-mu * pressed * d[0], -mu * pressed * d[1], pressed])
        slip = (w @ forces - r[:, None])[:2]
        # Opposed: no part across d, and the part along it negative.
        across = slip[0] * d[1] - slip[1] * d[0]
        turns = np.flatnonzero((across[:-1] * across[1:] <= 0) & ((slip * d).sum(0)[:-1] <= 0)
                               & (pressed[:-1] < 0))  # fmt: skip
        nearest = np.abs(forces[:, turns] - f[:, None]).max(axis=0).min()
        assert nearest < 2e-2 * np.linalg.norm(f)
    assert min(kinds.values()) > 20


@pytest.mark.parametrize("poisson", [0.32, 0.4999])
def test_frictionless_is_the_least_energy(poisson: float) -> None:
    """Against Lawson and Hanson's non-negative least squares, min |L'(f - C⁻¹h)|."""
    walk = Walk(SHAPES["sphere"], poisson, 0.0)
    walk.to(Pose(0, 1.0, 0.5, 0.7), 1e-9)
    height = tool_height_mm(walk.tool, Pose(0, 1.0, 0.5, 0.7), *walk.points[:, :2].T)
    near = np.flatnonzero(height < REACH_MM)
    normal = walk.compliance[2::3, 2::3][np.ix_(near, near)]
    lower = np.linalg.cholesky(normal)
    push, _ = nnls(lower.T, np.linalg.solve(lower, -height[near]))
    assert push.max() > 0
    np.testing.assert_allclose(-walk.force[near, 2], push, atol=1e-9 * push.max())


def test_random_complementarity_problems() -> None:
    """Random positive definite matrices cycle blocks; the answer must hold all the same."""
    rng = np.random.default_rng(11)
    for _ in range(60):
        n = int(rng.integers(1, 30))
        root = rng.standard_normal((3 * n, 3 * n))
        c = root @ root.T + 1e-3 * np.eye(3 * n)
        h = rng.standard_normal(n)
        found = solve_contact_forces(c, h, np.zeros((n, 2)), 0.0)
        gap = h - found.motion_mm[:, 2]
        size = np.abs(h).max()
        assert (found.force_n[:, 2] <= 0).all()
        assert gap.min() > -1e-8 * size
        assert np.abs(gap * found.force_n[:, 2]).max() <= 1e-8 * np.abs(found.force_n).max() * size


def test_first_forces_do_not_matter() -> None:
    """Cold, warm and wild starts end at the same forces (friction low enough to be unique)."""
    walk = Walk(SHAPES["sphere"], 0.49, 0.3)
    for pose in path(0.0)[:7]:
        walk.to(pose)
    height = tool_height_mm(walk.tool, walk.before, *walk.points[:, :2].T)
    near = np.flatnonzero(height < REACH_MM)
    dof = (3 * near[:, None] + np.arange(3)).ravel()
    block, h = walk.compliance[np.ix_(dof, dof)], height[near]
    target = np.full((len(near), 2), 0.05)
    rng = np.random.default_rng(0)
    starts = [None, walk.force[near], -np.abs(rng.standard_normal((len(near), 3)))]
    forces = [solve_contact_forces(block, h, target, 0.3, s, 1e-9).force_n for s in starts]
    for one, other in itertools.combinations(forces, 2):
        np.testing.assert_allclose(one, other, atol=1e-7 * np.abs(one).max())


def test_a_force_left_on_a_node_that_never_touches_is_dropped() -> None:
    """Node 1 has no contact, so node 0 is pressed alone: f = h / C_00, whatever the start."""
    c = np.kron(np.array([[2.0, 0.5], [0.5, 2.0]]), np.eye(3))
    height, target = np.array([-0.1, np.inf]), np.zeros((2, 2))
    start = np.full((2, 3), -0.3)
    found = solve_contact_forces(
        c, height, target, 0.5, start, 1e-10, start_mm=(c @ start.reshape(-1)).reshape(2, 3)
    )
    np.testing.assert_allclose(found.force_n, [[0.0, 0.0, -0.05], [0.0, 0.0, 0.0]], atol=1e-10)
    np.testing.assert_allclose(found.motion_mm[:, 2], [-0.1, -0.025], atol=1e-10)


def test_mirror_image() -> None:
    """A press on the mirror line gives mirrored forces, whatever the order of the nodes."""
    walk = Walk(SHAPES["ring"], 0.49, 0.5)
    for pose in path(0.0)[:5]:
        walk.to(pose, 1e-10)
    order = np.lexsort((walk.points[:, 1], np.round(-walk.points[:, 0], 9)))
    back = np.lexsort((walk.points[:, 1], np.round(walk.points[:, 0], 9)))
    mirrored = walk.force[order] * [-1, 1, 1]
    np.testing.assert_allclose(walk.force[back], mirrored, atol=1e-7 * np.abs(walk.force).max())


def test_refusals() -> None:
    """Impossible input, and a problem without an answer, are told."""
    c = np.eye(3)
    for friction, height in ((-1.0, 0.0), (np.inf, 0.0), (0.5, np.nan)):
        with pytest.raises(ContactError):
            solve_contact_forces(c, np.array([height]), np.zeros((1, 2)), friction)
    nothing = solve_contact_forces(c, np.array([0.1]), np.ones((1, 2)), 0.5)
    assert not nothing.force_n.any()
    assert nothing.touch[0] == FREE
    assert nothing.sweeps == 0
    kept = pickle.loads(pickle.dumps(ContactError("why", 0.1)))
    assert str(kept) == "why"
    assert kept.residual == 0.1


@pytest.mark.parametrize(("friction", "refused"), [(0.3, 0), (1.0, 0), (3.0, 4), (30.0, 8)])
def test_random_compliances_with_friction(friction: float, refused: int) -> None:
    """Laws hold for what is found, however wild; what is not is refused with how far it got."""
    rng, misses = np.random.default_rng(2), []
    for _ in range(60):
        n = int(rng.integers(1, 9))
        root = rng.standard_normal((3 * n, 3 * n))
        c = root @ root.T + 0.05 * np.eye(3 * n)
        height, target = rng.standard_normal(n), rng.standard_normal((n, 2))
        try:
            found = solve_contact_forces(c, height, target, friction, tolerance=1e-6)
        except ContactError as error:
            misses.append(error)
            continue
        broken = violations(c, found.force_n, height, target, friction)
        assert broken.pop("angle_deg") < 0.1
        assert all(v < 1e-3 for v in broken.values()), broken
    assert len(misses) <= refused
    assert all(e.residual > 1e-6 and "lower friction" in str(e) for e in misses)
