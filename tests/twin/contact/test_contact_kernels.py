"""Compiled loops of the contact against the same sums written with matrices."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_twin.contact.coulomb_kernel import (
    FREE,
    SLIP,
    STICK,
    answers,
    motion,
    node_force,
    own_compliance,
    sweep,
    sweeps,
)
from ifem_export.compliance.columns_kernel import add_motion, gather_block

Array = NDArray[np.float64]
NODES, FRICTION = 9, 0.7


def random_node(rng: np.random.Generator) -> tuple[Array, Array, float]:
    root = rng.standard_normal((3, 3))
    return root @ root.T + 0.05 * np.eye(3), rng.standard_normal(3), 10 ** rng.uniform(-1, 0.7)


def test_a_nodes_force_obeys_coulombs_law_to_rounding() -> None:
    rng = np.random.default_rng(17)
    kinds = {FREE: 0, STICK: 0, SLIP: 0}
    for _ in range(2000):
        w, r, mu = random_node(rng)
        fx, fy, fz, state = node_force(w, *r, mu)
        kinds[state] += 1
        force, off = np.array([fx, fy, fz]), w @ (fx, fy, fz) - r
        size = np.abs(w).max() * np.linalg.norm(force) + np.abs(r).max()
        if state == FREE:
            assert r[2] >= 0
            assert not force.any()
            continue
        side = float(np.hypot(fx, fy))
        assert fz < 0
        assert abs(off[2]) < 1e-12 * size
        if state == STICK:
            np.testing.assert_allclose(off, 0.0, atol=1e-12 * size)
            assert side <= -mu * fz
            # Without friction's limit the node sticks the same.
            np.testing.assert_allclose(np.linalg.solve(w, r), force, atol=1e-9 * side)
            continue
        # On the cone to rounding, and slip opposed to the friction force.
        assert abs(side + mu * fz) <= 1e-15 * side
        assert abs(off[0] * fy - off[1] * fx) < 1e-10 * size * side
        assert off[0] * fx + off[1] * fy <= 0
    assert min(kinds.values()) > 100


def test_the_compliance_of_a_node_in_its_frame() -> None:
    rng = np.random.default_rng(4)
    root = rng.standard_normal((3 * NODES, 3 * NODES))
    c = (root @ root.T).astype(np.float32)
    frames = Rotation.random(NODES, random_state=4).as_matrix()
    own = np.empty((NODES, 3, 3))
    own_compliance(c, frames, own)
    for k in range(NODES):
        node = slice(3 * k, 3 * k + 3)
        known = frames[k].T @ c[node, node].astype(float) @ frames[k]
        np.testing.assert_allclose(own[k], known, atol=1e-12)


def test_a_node_without_friction_is_pressed_along_its_normal_only() -> None:
    w, _, _ = random_node(np.random.default_rng(1))
    assert node_force(w, 0.3, -0.2, -0.6, 0.0) == (0.0, 0.0, -0.6 / w[2, 2], SLIP)
    assert node_force(w, 0.3, -0.2, 0.0, 0.0) == (0.0, 0.0, 0.0, FREE)
    assert node_force(w, 0.3, -0.2, 0.1, 0.5) == (0.0, 0.0, 0.0, FREE)
    assert node_force(w, 0.3, -0.2, np.inf, 0.5) == (0.0, 0.0, 0.0, FREE)


class Problem:
    """Random nodes with frames of their own; some sticking, some slipping, some free."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        root = rng.standard_normal((3 * NODES, 3 * NODES))
        self.compliance = root @ root.T / NODES + np.eye(3 * NODES)
        self.frames = Rotation.random(NODES, random_state=seed).as_matrix()
        self.height = rng.uniform(-1.0, 0.5, NODES)
        self.target = 0.5 * rng.standard_normal((NODES, 2))
        self.force = rng.standard_normal((NODES, 3))
        self.friction = FRICTION * (1 + 0.3 * np.sin(np.arange(NODES)))
        blocks = self.compliance.reshape(NODES, 3, NODES, 3)
        self.own = np.array([q.T @ blocks[k, :, k] @ q for k, q in enumerate(self.frames)])

    def wanted(self, k: int, force: Array) -> tuple[Array, int]:
        """Force of a node that keeps the others, from its rows of the compliance."""
        q, rows = self.frames[k], slice(3 * k, 3 * k + 3)
        others = force.copy()
        others[k] = 0.0
        beside = q.T @ (self.compliance[rows] @ others.reshape(-1))
        goal = np.array([*self.target[k], self.height[k]])
        *found, state = node_force(self.own[k], *(goal - beside), self.friction[k])
        return q @ found, state


@pytest.mark.parametrize("seed", range(4))
def test_answers_are_the_forces_of_single_nodes(seed: int) -> None:
    p = Problem(seed)
    found, touch = np.empty(3 * NODES), np.zeros(NODES, dtype=np.int8)
    moved = p.compliance @ p.force.reshape(-1)
    answers(
        p.own, p.frames, p.height, p.target, p.friction, p.force.reshape(-1), moved, found, touch
    )
    expected = [p.wanted(k, p.force) for k in range(NODES)]
    np.testing.assert_allclose(found.reshape(-1, 3), [f for f, _ in expected], atol=1e-12)
    assert list(touch) == [state for _, state in expected]
    assert len(set(touch)) == 3


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("relaxation", [1.0, 0.6])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_sweep_goes_from_node_to_node(seed: int, relaxation: float, backwards: bool) -> None:
    p = Problem(seed)
    force, touch = p.force.copy(), []
    for k in range(NODES)[:: -1 if backwards else 1]:
        wanted, state = p.wanted(k, force)
        force[k] += relaxation * (wanted - force[k])
        touch.append(state)
    f, kinds = p.force.reshape(-1).copy(), np.zeros(NODES, dtype=np.int8)
    u = p.compliance @ f
    change = sweep(
        p.compliance, p.own, p.frames, p.height, p.target, p.friction, relaxation, backwards, f, u,
        kinds,
    )  # fmt: skip
    np.testing.assert_allclose(f.reshape(-1, 3), force, atol=1e-11)
    np.testing.assert_allclose(u, p.compliance @ f, atol=1e-11)
    assert change == pytest.approx(np.linalg.norm(force - p.force))
    assert list(kinds) == touch[:: -1 if backwards else 1]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("relaxation", "turn", "most"), [(1.0, 0, 40), (0.6, 3, 40), (1.0, 1, 3)])
def test_sweeps_end_where_the_rest_of_a_geometric_series_is_small(
    seed: int, relaxation: float, turn: int, most: int
) -> None:
    p, tolerance, least = Problem(seed), 1e-4, 0.5
    given = p.compliance, p.own, p.frames, p.height, p.target, p.friction, relaxation
    f, kinds = p.force.reshape(-1).copy(), np.zeros(NODES, dtype=np.int8)
    u = p.compliance @ f
    steps: list[float] = [np.inf, np.inf]
    done, near = 0, False
    while not near and done < most:
        steps.append(sweep(*given, (turn + done) % 2 == 1, f, u, kinds))
        done += 1
        rate = least
        if np.isfinite(steps[-3]):
            rate = max(least, (steps[-1] / steps[-3]) ** 0.5)
        rest = steps[-1] * rate / (1 - rate) / relaxation if rate < 1 else np.inf
        near = rest <= tolerance * np.linalg.norm(f)
    g, found, changes = p.force.reshape(-1).copy(), kinds.copy(), np.full(3, np.inf)
    v = p.compliance @ g
    told = sweeps(*given, turn, most, tolerance, least, changes, g, v, found)
    assert told == (done, near)
    assert near == (most > 3)
    np.testing.assert_allclose(changes, steps[-3:], rtol=1e-12)
    np.testing.assert_allclose(g, f, atol=1e-13)
    np.testing.assert_allclose(v, u, atol=1e-12)
    assert list(found) == list(kinds)


def test_a_sweep_leaves_slipping_nodes_on_the_cone_to_rounding() -> None:
    """Large forces before the sweep leave no trace; free nodes do not touch the others."""
    p = Problem(6)
    f, u = 1e9 * p.force.reshape(-1), np.zeros(3 * NODES)
    f[:3] = 0.0
    p.height[0] = np.inf
    p.compliance[:3] = np.nan
    touch = np.zeros(NODES, dtype=np.int8)
    level = np.tile(np.eye(3), (NODES, 1, 1))
    own = 0.3 * p.own
    sweep(p.compliance, own, level, p.height, p.target, p.friction, 1.0, False, f, u, touch)
    slips = touch == SLIP
    assert slips.sum() > 1
    assert touch[0] == FREE
    side = np.hypot(*f.reshape(-1, 3)[slips, :2].T)
    limit = -p.friction[slips] * f.reshape(-1, 3)[slips, 2]
    np.testing.assert_allclose(side, limit, rtol=1e-15)


def test_motion_is_added_up_from_the_nodes_with_a_force() -> None:
    p = Problem(5)
    force = p.force * (np.arange(NODES) % 3 > 0)[:, None]
    force[4] = [0.0, 0.3, 0.0]
    force[5] = [0.0, 0.0, -0.2]
    force[7] = [0.1, 0.0, 0.0]
    before = np.linspace(-1, 1, 3 * NODES)
    u, read = before.copy(), p.compliance.copy()
    # Rows of nodes without a force are not read.
    read[np.repeat(~force.any(axis=1), 3)] = np.nan
    motion(read, force.reshape(-1), u)
    np.testing.assert_allclose(u, before + p.compliance @ force.reshape(-1), atol=1e-12)


COUNT = 50


def random_rows(seed: int) -> NDArray[np.float32]:
    """Columns (c, 3, c, 3) of a symmetric compliance, single precision."""
    root = np.random.default_rng(seed).standard_normal((3 * COUNT, 3 * COUNT)).astype(np.float32)
    return np.ascontiguousarray((root + root.T).reshape(COUNT, 3, COUNT, 3))


@pytest.mark.parametrize("known", [0, 7, 16, 32, 37, 41])
def test_a_block_is_gathered_beside_what_is_known(known: int) -> None:
    """Whole tiles of 16 nodes that are known are not read again."""
    rows = random_rows(2)
    nodes = np.random.default_rng(3).permutation(COUNT)[:41]
    dof = (3 * nodes[:, None] + np.arange(3)).ravel()
    expected = rows.reshape(3 * COUNT, 3 * COUNT)[np.ix_(dof, dof)].copy()
    block = np.full_like(expected, np.nan)
    block[: 3 * known, : 3 * known] = expected[: 3 * known, : 3 * known]
    kept = known // 16 * 16 if known < len(nodes) else known
    block[: 3 * kept, : 3 * kept] = expected[: 3 * kept, : 3 * kept] = 7.0
    gather_block(rows, nodes, block, known)
    np.testing.assert_array_equal(block, expected)


def test_motion_is_added_between_the_given_ends_only() -> None:
    rows = random_rows(4).astype(float)
    nodes = np.array([3, 41, 8, 20, 33])
    force = np.random.default_rng(6).standard_normal((5, 3))
    force[1] = [0.0, 0.2, 0.0]
    force[2] = 0.0
    force[3] = [0.0, 0.0, -0.4]
    starts, ends = np.array([6, 30, 99]), np.array([12, 75, 3 * COUNT])
    inside = np.zeros(3 * COUNT, dtype=bool)
    for start, end in zip(starts, ends, strict=True):
        inside[start:end] = True
    before = np.linspace(0, 1, 3 * COUNT)
    moved = before.copy()
    full = np.einsum("ia,iak->k", force, rows.reshape(COUNT, 3, -1)[nodes])
    rows[nodes[2]] = np.nan
    add_motion(rows.reshape(COUNT, 3, 3 * COUNT), nodes, force, starts, ends, moved)
    np.testing.assert_allclose(moved, before + np.where(inside, full, 0.0), atol=1e-12)
