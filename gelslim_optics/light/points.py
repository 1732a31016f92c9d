"""Points of the unit cube for the source: scrambled Sobol, or pseudo-random."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Sampling = Literal["sobol", "random"]
DIMENSIONS = 4


def point_batches(
    count: int, batch: int, *, seed: int, replicate: int, source: int, sampling: Sampling
) -> Iterator[NDArray[np.float64]]:
    """`count` points (n, 4) in pieces of `batch` rows; the pieces' size never changes a point.

    A Sobol sequence is scrambled anew for every replicate and source, so replicates are
    independent and each is unbiased. `count` should be a power of 2 for Sobol.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, replicate, source]))
    if sampling == "sobol":
        from scipy.stats import qmc

        engine = qmc.Sobol(DIMENSIONS, scramble=True, seed=rng)
        draw = engine.random
    else:

        def draw(n: int) -> NDArray[np.float64]:
            return rng.random((n, DIMENSIONS))

    for start in range(0, count, batch):
        with warnings.catch_warnings():
            # Only the whole set needs to be a power of 2 long, not each piece of it.
            warnings.simplefilter("ignore", UserWarning)
            points = draw(min(batch, count - start))
        yield points
