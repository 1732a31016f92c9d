"""Contact forces at the candidate nodes of a tool.

Frictionless contact is a linear complementarity problem, which an active-set method solves to
rounding. Contact with friction is that of `coulomb_contact`, which is loaded where there is some.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gelslim_twin.contact.gel_state import ContactError
from ifem_export.compliance.node_convolution import NodeConvolution

Array = NDArray[np.float64]
Touches = NDArray[np.int8]
FREE, STICK, SLIP = 0, 1, 2
BLOCK_TRIES = 10
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Forces (n, 3) in N, displacements (n, 3) in mm and contact status (n,) of the nodes.

    `residual` is the root mean square of the change of forces if every node were solved alone,
    over the root mean square of the forces.
    """

    force_n: Array
    motion_mm: Array
    touch: Touches
    residual: float
    sweeps: int


def solve_contact_forces(
    compliance: Array | NDArray[np.float32] | NodeConvolution,
    height_mm: Array,
    target_mm: Array,
    friction: float | Array,
    start_n: Array | None = None,
    tolerance: float = 1e-3,
    frames: Array | None = None,
    start_mm: Array | None = None,
) -> ContactForces:
    """Solve the contact of n nodes with a rigid tool.

    Args:
        compliance: C (3n, 3n) in mm/N among the nodes, symmetric positive definite; single
            precision halves the time of a large one. For very many nodes, a convolution.
        height_mm: (n,) largest displacement of each node along its normal (the gap at rest);
            inf for a node that is never in contact.
        target_mm: (n, 2) displacement along its tangents of a node that sticks.
        friction: coefficient μ >= 0, of all nodes or of each (n,).
        start_n: (n, 3) forces to start from.
        tolerance: on `ContactForces.residual`, and on the error of the forces that follows from
            the rate of convergence; frictionless contact is solved to rounding, or to 1e-8 with
            a convolution.
        frames: (n, 3, 3), in the columns each node's tangents and the normal into the tool;
            None for x, y, z.
        start_mm: (n, 3) displacement C f under `start_n`, if it is known.

    Raises:
        ContactError: the tolerance is not reached, or the input is invalid.
    """
    n = len(height_mm)
    if not (np.isfinite(friction) & (np.asarray(friction) >= 0)).all():
        raise ContactError(f"friction = {friction}: must be finite and at least 0")
    if np.isnan(height_mm).any() or not np.isfinite(target_mm).all():
        raise ContactError("the heights or the targets of the nodes hold NaN")
    start = np.zeros((n, 3)) if start_n is None else np.array(start_n, dtype=float)
    if not (height_mm < 0).any():
        nothing = np.zeros((n, 3))
        return ContactForces(nothing, nothing, np.zeros(n, dtype=np.int8), 0.0, 0)
    if not isinstance(compliance, np.ndarray):
        from gelslim_twin.contact.convolved_forces import ConvolvedContact

        axes = np.tile(np.eye(3), (n, 1, 1)) if frames is None else frames
        if not isinstance(friction, float | int):
            raise ContactError("a convolution takes one coefficient of friction for all nodes")
        convolved = ConvolvedContact(compliance, height_mm, target_mm, friction, axes)
        return convolved.balance(start, tolerance)
    if not np.any(friction):
        return _frictionless(compliance, height_mm, start, frames)
    from gelslim_twin.contact.coulomb_contact import FrictionalContact

    found = FrictionalContact(compliance, height_mm, target_mm, friction, frames)
    return found.balance(start, start_mm, tolerance)


def _frictionless(
    compliance: Array | NDArray[np.float32], height: Array, start: Array, frames: Array | None
) -> ContactForces:
    n = len(height)
    if frames is None:
        across = compliance[:, 2::3].astype(float)
        normal, normals = across[2::3], np.array([[0.0, 0.0, 1.0]])
    else:
        normals = frames[:, :, 2]
        across = np.einsum("ijb,jb->ij", compliance.reshape(3 * n, n, 3), normals)
        normal = np.einsum("iaj,ia->ij", across.reshape(n, 3, n), normals)
    # Contact forces act against the normals.
    push, pivots = lcp_forces(normal, height, (start * normals).sum(axis=1) < 0)
    force = push[:, None] * normals
    motion = np.asarray(across @ push).reshape(n, 3)
    own = np.minimum((height - normal @ push) / np.diag(normal) + push, 0.0)
    size = float(np.linalg.norm(push))
    residual = float(np.linalg.norm(own - push)) / size if size > 0 else 0.0
    touch = np.where(push < 0, SLIP, FREE).astype(np.int8)
    return ContactForces(force, motion, touch, residual, pivots)


def lcp_forces(normal: Array, height: Array, guess: NDArray[np.bool_]) -> tuple[Array, int]:
    """Solve the linear complementarity problem f <= 0, A f <= height, f (A f - height) = 0.

    Block principal pivoting (Júdice and Pires 1994): all nodes that violate a condition change
    their status at once. Where that cycles, one node at a time does (Murty 1974), which terminates
    for every positive definite matrix.

    Args:
        normal: A (n, n) in mm/N, symmetric positive definite.
        height: (n,) in mm; inf for a node that is never pressed.
        guess: (n,) initial active set.

    Returns the forces (n,) and the number of factorisations. Raises ContactError where rounding
    prevents convergence of the active set.
    """
    active, reachable = guess & np.isfinite(height), np.isfinite(height)
    # Rounding must not change the status of a node whose force or gap is zero.
    narrow = ROUNDING * float(np.abs(height[reachable]).max())
    fewest, tries = len(height) + 1, BLOCK_TRIES
    for factors in range(1, 20 * len(height) + 200):
        force = np.zeros(len(height))
        if active.any():
            factor = cho_factor(normal[np.ix_(active, active)], check_finite=False)
            force[active] = cho_solve(factor, height[active], check_finite=False)
        slight = ROUNDING * float(np.abs(force).max())
        wrong = (active & (force > slight)) | (~active & (height - normal @ force < -narrow))
        count = int(wrong.sum())
        if count == 0:
            return np.minimum(force, 0.0), factors
        if count < fewest:
            fewest, tries = count, BLOCK_TRIES
        elif tries > 0:
            tries -= 1
        else:
            wrong &= np.arange(len(height)) == np.flatnonzero(wrong)[-1]
        active = active ^ wrong
    raise ContactError(
        f"the active set of {len(height)} nodes does not converge: the compliance is too close to "
        "singular; use cells of an aspect nearer 1 or a Poisson's ratio further from 0.5"
    )
