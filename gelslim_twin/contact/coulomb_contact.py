"""Contact forces with Coulomb friction at the candidate nodes of a tool.

Block Gauss-Seidel sweeps solve the contact; where these converge slowly, semismooth Newton steps on
the sets of sticking and slipping nodes take over (Alart and Curnier 1991).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, lu_factor, lu_solve

from gelslim_twin.contact.contact_forces import SLIP, ContactForces
from gelslim_twin.contact.coulomb_kernel import answers, motion, own_compliance, sweeps
from gelslim_twin.contact.gel_state import ContactError

Array = NDArray[np.float64]
MOST_SWEEPS = 1000
CHECK_EVERY = 6
SLOW = 0.7
"""Ratio of residuals over CHECK_EVERY sweeps above which Newton's method is tried."""
NEWTON_STEPS = 12
RELAXATIONS = (1.0, 0.6, 0.3)
PATIENCE = 50
SURE = 0.1
"""Share of the tolerance at which Newton's method stops, as its steps do not estimate the error."""
LEAST_RATE = 0.5
"""Least rate of convergence assumed for the sweeps."""


class FrictionalContact:
    """The contact of n nodes with friction; for the arguments see `solve_contact_forces`."""

    def __init__(
        self,
        compliance: Array | NDArray[np.float32],
        height: Array,
        target: Array,
        friction: float | Array,
        frames: Array | None,
    ) -> None:
        n = len(height)
        self.c = np.ascontiguousarray(compliance)
        self.frames = np.zeros((n, 3, 3)) if frames is None else np.array(frames)
        if frames is None:
            self.frames.reshape(n, 9)[:, ::4] = 1.0
        self.own = np.empty((n, 3, 3))
        own_compliance(self.c, self.frames, self.own)
        self.height = np.ascontiguousarray(height, dtype=float)
        self.target = np.ascontiguousarray(target, dtype=float)
        self.mu = np.full(n, friction, dtype=float)
        self.touch = np.zeros(len(height), dtype=np.int8)

    def balance(self, start: Array, start_mm: Array | None, tolerance: float) -> ContactForces:
        """Sweep until no node changes its force.

        Args:
            start: Forces (c, 3) in N to begin with.
            start_mm: Motion (c, 3) in mm under these forces, where it is known.
            tolerance: Largest residual, relative to the forces.

        Raises:
            ContactError: The sweeps do not converge.
        """
        f = np.ascontiguousarray(start).reshape(-1).copy()
        beside = np.isinf(self.height)
        if f.reshape(-1, 3)[beside].any():
            f.reshape(-1, 3)[beside], start_mm = 0.0, None
        best, count, newton = np.inf, 0, 0
        known = None if start_mm is None else np.array(start_mm, dtype=float).reshape(-1)
        for relaxation in RELAXATIONS:
            u = self._motion(f) if known is None else known
            known, last, changes = None, np.inf, np.full(3, np.inf)
            turn = 0
            while turn < MOST_SWEEPS:
                done, near = sweeps(
                    self.c, self.own, self.frames, self.height, self.target, self.mu, relaxation,
                    turn, CHECK_EVERY - turn % CHECK_EVERY, tolerance, LEAST_RATE, changes,
                    f, u, self.touch,
                )  # fmt: skip
                turn, count = turn + done, count + done
                residual = self._residual(f, u)
                # Without a steady rate of convergence the residual decides, with a margin.
                if residual <= (tolerance if near else SURE * tolerance) and (
                    near or turn > PATIENCE
                ):
                    return self._balance(f, u, residual, count)
                best = min(best, residual)
                if residual > SLOW * last:
                    newton += 1
                    found = self._newton(f, residual, tolerance) if newton <= 20 else None
                    if found is not None:
                        f = found
                        u = self._motion(f)
                        residual = self._residual(f, u)
                        if residual <= SURE * tolerance:
                            return self._balance(f, u, residual, count)
                        changes[:] = np.inf
                last = residual
        raise ContactError(
            f"the contact of {len(self.height)} nodes with friction {self.mu.max():g} did not "
            f"converge in {count} sweeps: the smallest residual is {best:.1e} of the forces, the "
            f"tolerance {tolerance:.1e}; take smaller steps of the motion, a lower friction or a "
            "larger tolerance",
            best,
        )

    def _balance(self, f: Array, u: Array, residual: float, sweeps: int) -> ContactForces:
        return ContactForces(
            f.reshape(-1, 3), u.reshape(-1, 3), self.touch.copy(), residual, sweeps
        )

    def _motion(self, f: Array) -> Array:
        """The displacement C f."""
        u = np.zeros_like(f)
        motion(self.c, f, u)
        return u

    def _residual(self, f: Array, u: Array) -> float:
        """Relative residual under the displacement C f; sets the contact status `touch`."""
        own = np.empty_like(f)
        answers(self.own, self.frames, self.height, self.target, self.mu, f, u, own, self.touch)
        size = float(np.linalg.norm(own))
        off = float(np.linalg.norm(own - f))
        return off / size if size > 0 else float(off > 0)

    def _newton(self, f: Array, residual: float, tolerance: float) -> Array | None:
        """Forces of a smaller residual by Newton's method, or None."""
        start, x = residual, f.copy()
        for _ in range(NEWTON_STEPS):
            self._residual(x, self._motion(x))
            try:
                step = self._step(x)
            except (LinAlgError, ValueError):
                return None
            # Line search: the longest of three steps that lowers the residual.
            for share in (1.0, 0.5, 0.25):
                trial = x + share * step
                ahead = self._residual(trial, self._motion(trial))
                if ahead < residual:
                    break
            else:
                return x if residual < 0.5 * start else None
            x, residual = trial, ahead
            if residual <= SURE * tolerance:
                break
        return x

    def _step(self, f: Array) -> Array:
        """Newton's step for the present contact status, with the derivative of slip directions."""
        n, on = len(self.height), np.flatnonzero(self.touch)
        dof, m = (3 * on[:, None] + np.arange(3)).ravel(), len(on)
        q = self.frames[on]
        c = (q.transpose(0, 2, 1) @ self.c[np.ix_(dof, dof)].reshape(m, 3, 3 * m)).reshape(-1, m, 3)
        c = np.ascontiguousarray(np.einsum("imb,mbd->imd", c, q)).reshape(3 * m, 3 * m)
        present = np.einsum("mba,mb->ma", q, f.reshape(n, 3)[on]).reshape(-1)
        moved = (c @ present).reshape(m, 3)
        matrix = c.copy().reshape(m, 3, 3 * m)
        right = np.column_stack([self.target[on], self.height[on]])
        at = np.flatnonzero(self.touch[on] == SLIP)
        force = present.reshape(m, 3)[at]
        own, mu = matrix.reshape(m, 3, m, 3)[at, :, at, :], self.mu[on][at]
        # G = f_t + μ f_z d with d along f_t - ρ slip, ρ of the size of the node's stiffness.
        rho = 2.0 / (own[:, 0, 0] + own[:, 1, 1])
        along = force[:, :2] - rho[:, None] * (moved[at, :2] - right[at, :2])
        size = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-300)
        d = along / size[:, None]
        swing = (mu * np.maximum(-force[:, 2], 0.0) / size)[:, None, None] * (
            np.eye(2) - d[:, :, None] * d[:, None, :]
        )
        rows = np.matmul(swing * rho[:, None, None], c.reshape(m, 3, -1)[at, :2])
        grid = rows.reshape(len(at), 2, m, 3)
        grid[np.arange(len(at)), :, at, :2] += np.eye(2) - swing
        grid[np.arange(len(at)), :, at, 2] += mu[:, None] * d
        matrix[at, :2] = rows
        right[at, :2] = rows @ present - (force[:, :2] + mu[:, None] * force[:, 2:] * d)
        x = np.zeros(3 * n)
        local = lu_solve(lu_factor(matrix.reshape(3 * m, 3 * m)), right.reshape(-1))
        x[dof] = np.einsum("mab,mb->ma", q, local.reshape(m, 3)).reshape(-1)
        return x - f
