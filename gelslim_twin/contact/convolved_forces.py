"""Contact forces at the nodes of a fine pad, whose compliance is a convolution and no matrix.

The active-set method and Newton's method are those of `contact_forces` and `coulomb_contact`.
Their linear systems are solved by Krylov methods, which need products with the compliance C only:
conjugate gradients for the normal forces (Hestenes and Stiefel 1952), GMRES for the unsymmetric
equations of slipping nodes (Saad and Schultz 1986). The stiffness of the infinite pad, restricted
to the nodes in contact, preconditions both, so that the number of products hardly grows with the
number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from gelslim_twin.contact.contact_forces import FREE, SLIP, STICK, ContactForces
from gelslim_twin.contact.coulomb_kernel import answers
from gelslim_twin.contact.gel_state import ContactError
from ifem_export.compliance.node_convolution import NodeConvolution

Array = NDArray[np.float64]
Active = NDArray[np.bool_]
NORMAL_RTOL = 1e-8
"""Relative residual of the normal forces of one active set."""
SIGN = 1e-7
"""Share of the largest force and height below which a sign is rounding."""
MOST_SETS, MOST_GRADIENTS = 60, 300
NEWTON_STEPS, SHORTEST = 40, 1.0 / 64
FORCING, RESTART, RESTARTS = 1e-2, 60, 4
"""Relative residual of Newton's linear equations, and the steps of GMRES."""
SURE = 0.1
"""Share of the tolerance at which Newton's method stops, as its steps do not estimate the error."""


@dataclass(eq=False)
class ConvolvedContact:
    """The contact of n nodes; for the arguments see `contact_forces.solve_contact_forces`."""

    compliance: NodeConvolution
    height_mm: Array
    target_mm: Array
    friction: float
    frames: Array
    """(n, 3, 3): in the columns two tangents and the normal of each node."""

    def __post_init__(self) -> None:
        self.products = 0
        turned = self.frames.transpose(0, 2, 1) @ self.compliance.own @ self.frames
        self._own = np.ascontiguousarray(turned)
        self._height = np.ascontiguousarray(self.height_mm, dtype=float)
        self._target = np.ascontiguousarray(self.target_mm, dtype=float)
        self.touch = np.zeros(len(self._height), dtype=np.int8)

    def balance(self, start_n: Array, tolerance: float) -> ContactForces:
        """Forces of the contact, from initial forces (n, 3). Raises ContactError."""
        push = (start_n * self.frames[:, :, 2]).sum(axis=1)
        if self.friction == 0:
            push = self._normal_forces(np.minimum(push, 0.0))
            force = push[:, None] * self.frames[:, :, 2]
            motion = self._motion(force)
            residual = self._residual(force, motion)
            return ContactForces(force, motion, self.touch.copy(), residual, self.products)
        force = np.where(np.isinf(self._height)[:, None], 0.0, start_n)
        if not force.any():
            force = self._normal_forces(push)[:, None] * self.frames[:, :, 2]
        return self._newton(force, tolerance)

    def _motion(self, force: Array) -> Array:
        self.products += 1
        return self.compliance.displacement(force)

    def _residual(self, force: Array, motion: Array) -> float:
        """Relative residual as in `ContactForces`; sets the contact status `touch`."""
        own = np.empty(force.size)
        answers(
            self._own, self.frames, self._height, self._target,
            np.full(len(self._height), self.friction),
            np.ascontiguousarray(force).reshape(-1), np.ascontiguousarray(motion).reshape(-1),
            own, self.touch,
        )  # fmt: skip
        size = float(np.linalg.norm(own))
        off = float(np.linalg.norm(own - force.reshape(-1)))
        return off / size if size > 0 else float(off > 0)

    def _normal_forces(self, start: Array) -> Array:
        """Frictionless forces (n,) along the normals, by block principal pivoting."""
        reachable = np.isfinite(self._height)
        active = (start < 0) & reachable
        if not active.any():
            active = self._height < 0
        force = np.where(active, start, 0.0)
        narrow = SIGN * float(np.abs(self._height[reachable]).max())
        for _ in range(MOST_SETS):
            force = self._gradients(active, force)
            slight = SIGN * float(np.abs(force).max())
            gap = self._height - self._along_normals(force)
            wrong = (active & (force > slight)) | (~active & (gap < -narrow))
            if not wrong.any():
                return np.asarray(np.minimum(force, 0.0))
            active = active ^ wrong
        raise ContactError(
            f"the active set of {len(force)} nodes does not settle in {MOST_SETS} steps: take "
            "smaller steps of the motion"
        )

    def _along_normals(self, push: Array) -> Array:
        normals = self.frames[:, :, 2]
        return np.asarray((self._motion(push[:, None] * normals) * normals).sum(axis=1))

    def _gradients(self, active: Active, start: Array) -> Array:
        """Normal forces (n,) that hold the active nodes at their heights, zero elsewhere."""
        normals = self.frames[:, :, 2]
        right = np.where(active, self._height, 0.0)
        if not active.any():
            return np.zeros_like(right)
        x = np.where(active, start, 0.0)
        r = np.where(active, right - self._along_normals(x), 0.0)
        goal = NORMAL_RTOL * float(np.linalg.norm(right))
        p, rho = np.zeros_like(r), 1.0
        for _ in range(MOST_GRADIENTS):
            if np.linalg.norm(r) <= goal:
                return x
            held = (self.compliance.force(r[:, None] * normals) * normals).sum(axis=1)
            z = np.where(active, held, 0.0)
            rho, last = float(r @ z), rho
            p = z + rho / last * p
            q = np.where(active, self._along_normals(p), 0.0)
            step = rho / float(p @ q)
            x, r = x + step * p, r - step * q
        raise ContactError(
            f"the normal forces of {int(active.sum())} nodes do not converge: use cells of an "
            "aspect nearer 1 or a Poisson's ratio further from 0.5"
        )

    def _newton(self, force: Array, tolerance: float) -> ContactForces:
        motion = self._motion(force)
        residual = self._residual(force, motion)
        for _ in range(NEWTON_STEPS):
            if residual <= SURE * tolerance:
                break
            step = self._step(force, motion)
            moved = self._motion(step)
            share = 1.0
            while True:
                trial = force + share * step, motion + share * moved
                ahead = self._residual(*trial)
                if ahead < residual or share <= SHORTEST:
                    break
                share /= 2
            if ahead >= residual:
                break
            (force, motion), residual = trial, ahead
        if residual > tolerance:
            raise ContactError(
                f"the contact of {len(force)} nodes with friction {self.friction:g} did not "
                f"converge: the smallest residual is {residual:.1e} of the forces, the tolerance "
                f"{tolerance:.1e}; take smaller steps of the motion, a lower friction or a larger "
                "tolerance",
                residual,
            )
        self._residual(force, motion)
        return ContactForces(force, motion, self.touch.copy(), residual, self.products)

    def _step(self, force: Array, motion: Array) -> Array:
        """Newton's step (n, 3) for the status `touch` of the nodes at these forces."""
        self._residual(force, motion)
        equations = _Equations.at(self, force, motion)
        size = 3 * len(force)
        matrix = LinearOperator((size, size), matvec=equations.product, dtype=float)
        guide = LinearOperator((size, size), matvec=equations.preconditioned, dtype=float)
        found, _ = gmres(
            matrix, -equations.residual.reshape(-1), M=guide, rtol=FORCING, atol=0.0,
            restart=min(RESTART, size), maxiter=RESTARTS,
        )  # fmt: skip
        return np.einsum("nab,nb->na", self.frames, found.reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class _Equations:
    """Newton's linear equations in the frames of the nodes, for forces x (n, 3).

    Rows of nodes that touch: the motion along the normal, and along the tangents where they stick,
    meets the tool. Rows of slipping nodes along the tangents: Coulomb's law G = f_t + μ f_z d with
    d along f_t - ρ s. Rows of free nodes: no force.
    """

    contact: ConvolvedContact
    residual: Array
    held: Active
    """(n, 3) components whose motion is prescribed."""
    slips: Active
    """(n,)"""
    swing: Array
    """(n, 2, 2) derivative of the direction d, times the friction limit."""
    along: Array
    """(n, 2) d."""
    rho: Array
    """(n,) ρ in N/mm, of the size of the node's own stiffness."""

    @classmethod
    def at(cls, contact: ConvolvedContact, force: Array, motion: Array) -> _Equations:
        touch, mu = contact.touch, contact.friction
        local = np.einsum("nba,nb->na", contact.frames, force)
        moved = np.einsum("nba,nb->na", contact.frames, motion)
        goal = np.column_stack([contact._target, np.where(touch != FREE, contact._height, 0.0)])
        slips = touch == SLIP
        rho = 2.0 / (contact._own[:, 0, 0] + contact._own[:, 1, 1])
        ahead = local[:, :2] - rho[:, None] * (moved[:, :2] - goal[:, :2])
        size = np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-300)
        d = ahead / size[:, None]
        limit = mu * np.maximum(-local[:, 2], 0.0)
        swing = (limit / size)[:, None, None] * (np.eye(2) - d[:, :, None] * d[:, None, :])
        held = np.column_stack([touch == STICK, touch == STICK, touch != FREE])
        residual = np.where(held, moved - goal, local)
        residual[slips, :2] = (local[:, :2] + mu * local[:, 2:] * d)[slips]
        return cls(contact, residual, held, slips, swing, d, rho)

    def product(self, values: Array) -> Array:
        """Rows (3n,) of forces (3n,)."""
        c = self.contact
        x = values.reshape(-1, 3)
        moved = np.einsum("nba,nb->na", c.frames, c._motion(np.einsum("nab,nb->na", c.frames, x)))
        rows = np.where(self.held, moved, x)
        swung = self.rho[:, None] * moved[:, :2] - x[:, :2]
        slip = x[:, :2] + np.einsum("nab,nb->na", self.swing, swung)
        slip += c.friction * x[:, 2:] * self.along
        rows[self.slips, :2] = slip[self.slips]
        return np.asarray(rows.reshape(-1))

    def preconditioned(self, values: Array) -> Array:
        """Forces (3n,) that nearly have the rows (3n,)."""
        c = self.contact
        rows = values.reshape(-1, 3)
        wanted = np.einsum("nab,nb->na", c.frames, np.where(self.held, rows, 0.0))
        x = np.einsum("nba,nb->na", c.frames, c.compliance.force(wanted))
        x = np.where(self.held, x, rows)
        x[self.slips, :2] -= (c.friction * x[:, 2:] * self.along)[self.slips]
        return np.asarray(x.reshape(-1))
