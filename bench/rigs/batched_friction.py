"""A trial of friction side by side, which the twin does not have: where it loses, and by how much.

The law of Coulomb is a projection: with the pressure p along a normal, the tangential force t, the
gap g and the slip s of a node, (p, t) is the projection of (p, t) - ρ (g + μ|s|, s) onto the cone
|t| <= μ p (De Saxcé and Feng 1998). All nodes of all contacts are projected at once, with the
acceleration of Nesterov and restarts (Mazhar et al. 2015), until every force field is within the
tolerance of the known solution: a rule that no solver has, and that favours the trial.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.contact.contact_forces import solve_contact_forces
from gelslim_twin.contact.solver import CANDIDATE_SHARE
from gelslim_twin.stepping.placement import placed
from gelslim_twin.stepping.twin import Twin

Array = NDArray[np.float64]
EXACT, MOST, EVERY = 1e-7, 3000, 2
TOLERANCE = 1e-3
"""Of the force field, relative, in the L2 norm."""


@dataclass(frozen=True)
class Frictional:
    """A contact at its nodes at rest: compliance (3n, 3n), heights (n,), exact forces (n, 3)."""

    compliance: Array
    height: Array
    exact: Array


def frictional(twin: Twin, poses: Array, friction: float) -> list[Frictional]:
    """The contacts of the bodies of a twin, whose nodes meet the tool at its height over them."""
    mechanics, found = twin._shared.mechanics, []
    for pose in poses:
        where = placed(twin.bodies, pose[None], None, (0.0, 0.0), 0.0)
        assert where is not None
        below = where.tool.clearance_mm(where.pose, mechanics.points_mm)
        nodes = np.flatnonzero(below < -CANDIDATE_SHARE * below.min())
        block, height = mechanics.compliance.block(nodes), below[nodes]
        none = np.zeros((len(nodes), 2))
        exact = solve_contact_forces(block, height, none, friction, tolerance=EXACT).force_n
        found.append(Frictional(block.astype(float), height, exact))
    return found


def one_by_one(
    problems: list[Frictional], friction: float, clock: Callable[[], float]
) -> dict[str, Any]:
    """The twin's solver: block Gauss-Seidel and Newton's method."""
    seconds = []
    errors: list[float] = []
    blocks = [p.compliance.astype(np.float32) for p in problems]
    for _ in range(2):
        begun, errors = clock(), []
        for block, p in zip(blocks, problems, strict=True):
            none = np.zeros((len(p.height), 2))
            found = solve_contact_forces(block, p.height, none, friction, tolerance=TOLERANCE)
            errors.append(float(np.linalg.norm(found.force_n - p.exact) / np.linalg.norm(p.exact)))
        seconds.append(clock() - begun)
    return {"ms": 1e3 * seconds[-1] / len(problems), "force_error": max(errors)}


def side_by_side(
    problems: list[Frictional], friction: float, device: str, clock: Callable[[], float]
) -> dict[str, Any]:
    """The trial."""
    import torch

    most = max(len(p.height) for p in problems)
    size = len(problems), most
    matrix = np.zeros((*size, 3, most, 3))
    height, exact, real = np.ones(size), np.zeros((*size, 3)), np.zeros(size, bool)
    for k, p in enumerate(problems):
        n = len(p.height)
        matrix[k, :n, :, :n] = p.compliance.reshape(n, 3, n, 3)
        height[k, :n], exact[k, :n], real[k, :n] = p.height, p.exact, True
    on = [torch.as_tensor(a, device=device) for a in (matrix, height, exact, real)]
    seconds, steps, error = [], 0, np.inf
    for _ in range(2):
        begun = clock()
        steps, error = projected(
            torch, on[0].reshape(size[0], 3 * most, 3 * most), *on[1:], friction
        )
        if device == "cuda":
            torch.cuda.synchronize()
        seconds.append(clock() - begun)
    return {"ms": 1e3 * seconds[-1] / size[0], "force_error": error, "iterations": steps}


def projected(
    torch: Any, matrix: Any, height: Any, exact: Any, real: Any, mu: float
) -> tuple[int, float]:
    """Iterations until every force field is within the tolerance, and the largest error then."""
    b, n = height.shape
    vector = torch.ones((b, 3 * n, 1), dtype=matrix.dtype, device=matrix.device)
    for _ in range(20):
        vector = matrix @ vector
        vector = vector / vector.norm(dim=1, keepdim=True)
    rho = 1 / (vector * (matrix @ vector)).sum(dim=(1, 2))[:, None]
    force, ahead = torch.zeros_like(exact), torch.zeros_like(exact)
    momentum, size = torch.ones_like(rho), exact.norm(dim=(1, 2))
    error = float("inf")
    for step in range(1, MOST + 1):
        moved = (matrix @ ahead.view(b, 3 * n, 1)).view(b, n, 3)
        slip = moved[..., :2].norm(dim=2)
        push = -ahead[..., 2] - rho * (height - moved[..., 2] + mu * slip)
        along = ahead[..., :2] - rho[..., None] * moved[..., :2]
        new = _onto_cone(torch, push, along, mu) * real[..., None]
        # A step against the last direction restarts the acceleration.
        restart = ((ahead - new) * (new - force)).sum(dim=(1, 2))[:, None] > 0
        later = (1 + (1 + 4 * momentum**2).sqrt()) / 2
        weight = torch.where(restart, 0.0, (momentum - 1) / later)
        momentum = torch.where(restart, 1.0, later)
        ahead, force = new + weight[..., None] * (new - force), new
        if step % EVERY == 0:
            error = float(((force - exact).norm(dim=(1, 2)) / size).max())
            if error < TOLERANCE:
                return step, error
    return MOST, error


def _onto_cone(torch: Any, push: Any, along: Any, mu: float) -> Any:
    """Forces (b, n, 3) nearest to pressures (b, n) and tangential forces (b, n, 2) in the cone."""
    size = along.norm(dim=2)
    inside, outside = size <= mu * push, mu * size <= -push
    share = (push + mu * size) / (1 + mu * mu)
    held = torch.where(inside, push, torch.where(outside, 0.0, share))
    scale = torch.where(inside, 1.0, mu * held / size.clamp(min=1e-300))
    return torch.cat([along * scale[..., None], -held[..., None]], dim=2)


def friction_rows(
    twin: Twin, name: str, poses: Array, friction: float, devices: list[str]
) -> Iterator[dict[str, Any]]:
    """Both solvers at the same contacts."""
    problems = frictional(twin, poses, friction)
    row = {"body": name, "contacts": len(poses), "friction": friction,
           "nodes": float(np.mean([len(p.height) for p in problems]))}  # fmt: skip
    yield {**row, "way": "NumPy, one by one",
           **one_by_one(problems, friction, time.process_time)}  # fmt: skip
    for device in devices:
        clock = time.perf_counter if device == "cuda" else time.process_time
        yield {**row, "way": f"trial in PyTorch, {device}",
               **side_by_side(problems, friction, device, clock)}  # fmt: skip
