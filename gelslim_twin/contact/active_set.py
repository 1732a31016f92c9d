"""Which nodes a frictionless tool presses, and how hard: a linear complementarity problem.

Block principal pivoting (Júdice and Pires 1994): all nodes on the wrong side change sides at once;
where that cycles, one at a time (Murty 1974), which ends for every positive definite matrix.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from gelslim_twin.contact.contact_error import ContactError

Array = NDArray[np.float64]
BLOCK_TRIES = 10
ROUNDING = 1e-12


def pressed_nodes(normal: Array, height: Array, guess: NDArray[np.bool_]) -> tuple[Array, int]:
    """Forces f (n,) <= 0 with A f <= height and f (A f - height) = 0, and how many factors it took.

    Args:
        normal: A (n, n) in mm/N, symmetric positive definite.
        height: (n,) in mm; inf for a node that is never pressed.
        guess: (n,) nodes to begin with.

    Raises ContactError where rounding keeps the set from settling.
    """
    active, reachable = guess & np.isfinite(height), np.isfinite(height)
    # Rounding must not move a node whose force or gap is nothing.
    narrow = ROUNDING * float(np.abs(height[reachable]).max(initial=0.0))
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
        f"the active set of {len(height)} nodes does not settle: the compliance is too close to "
        "singular; use cells of an aspect nearer 1 or a Poisson's ratio further from 0.5"
    )
