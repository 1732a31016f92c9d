"""Frictionless contact forces of many poses: linear complementarity problems, side by side.

Block principal pivoting as in `gelslim_twin.contact.contact_forces.lcp_forces`, with the same
changes of the active sets. Each pose has as many rows as the largest one; the others are filled up
with nodes that are never pressed.
"""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.contact.contact_forces import BLOCK_TRIES, ROUNDING

SINGLE_ROUNDING = 2e-6
"""Share of the largest force or height that is rounding in single precision."""
MOST_FACTORS = 200


@dataclass(frozen=True, eq=False)
class Pushes:
    """Normal forces (b, m), none above 0, and whether (b,) the active set was found."""

    force: Tensor
    found: Tensor


def lcp_forces(engine: Engine, normal: Tensor, height: Tensor, guess: Tensor) -> Pushes:
    """Solve f <= 0, A f <= height, f (A f - height) = 0 for b poses.

    Args:
        engine: Where it is computed.
        normal: A (b, m, m) in mm/N, symmetric positive definite.
        height: (b, m) in mm; infinite for a node that is never pressed.
        guess: (b, m) initial active sets.
    """
    torch = engine.torch
    reachable = height.isfinite()
    room = height.masked_fill(~reachable, 0.0).to(engine.real)
    rounding = ROUNDING if engine.exact else SINGLE_ROUNDING
    narrow = rounding * room.abs().amax(dim=1, keepdim=True)
    pressed = (room < 0).any(dim=1)
    active = guess & reachable & pressed[:, None]
    force, found = torch.zeros_like(room), ~pressed
    given_up = torch.zeros_like(found)
    fewest = torch.full((len(room),), room.shape[1] + 1, device=engine.device)
    tries = torch.full_like(fewest, BLOCK_TRIES)
    for _ in range(MOST_FACTORS):
        left = (~found & ~given_up).nonzero()[:, 0]
        if len(left) == 0:
            break
        own = normal if len(left) == len(normal) else normal[left]
        push, wrong, lost = _pivoted(
            engine, own, room[left], reachable[left], active[left], narrow[left], rounding
        )
        count = wrong.sum(dim=1)
        # Rounding has made a matrix indefinite: such a pose has no solution here.
        given_up[left] = lost
        done = (count == 0) & ~lost
        force[left[done]] = push[done].clamp(max=0.0)
        found[left[done]] = True
        fewer, some = count < fewest[left], tries[left] > 0
        tries[left] = torch.where(fewer, BLOCK_TRIES, tries[left] - (some & ~fewer).long())
        fewest[left] = torch.minimum(fewest[left], count)
        # Where that cycles, one node at a time changes: the last one.
        single = ~fewer & ~some
        order = torch.arange(room.shape[1], device=engine.device)
        last = torch.where(wrong, order, -1).amax(dim=1, keepdim=True)
        wrong = torch.where(single[:, None], wrong & (order == last), wrong)
        active[left] = active[left] ^ wrong
    return Pushes(force, found)


def _pivoted(
    engine: Engine,
    normal: Tensor,
    room: Tensor,
    reachable: Tensor,
    active: Tensor,
    narrow: Tensor,
    rounding: float,
) -> tuple[Tensor, Tensor, Tensor]:
    """Forces of the active sets, which nodes violate a condition, and which factors failed."""
    torch = engine.torch
    both = active[:, :, None] & active[:, None, :]
    matrix = normal * both + torch.diag_embed((~active).to(normal.dtype))
    factor, info = torch.linalg.cholesky_ex(matrix)
    push = torch.cholesky_solve((room * active)[..., None], factor)[..., 0] * active
    slight = rounding * push.abs().amax(dim=1, keepdim=True)
    gap = room - (normal @ push[..., None])[..., 0]
    wrong = (active & (push > slight)) | (reachable & ~active & (gap < -narrow))
    return push, wrong, info > 0
