"""How far normals of nodes turn at once, where whole turns go to and fro."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FIRST, GROWTH = 0.5, 1.25


class Turning(Protocol):
    """Remembers the turns asked for."""

    def share(self, way: Array) -> Array:
        """Share (n,) of the turns `way` (n, 3) that is made."""


@dataclass
class EvenTurns:
    """Normals become the mean of all that were asked for. It always slows down."""

    _count: int = 1

    def share(self, way: Array) -> Array:
        """See `Turning`."""
        self._count += 1
        return np.full(len(way), 1 / self._count)


@dataclass
class HalvedTurns:
    """Each node halves its share where it turns back, and takes more where it goes on.

    Never as much as when it last turned back, so that nodes astride an edge come to the normal
    that holds them there as by bisection (Riedmiller and Braun 1993 for the rule of the signs).
    """

    _share: Array = field(default_factory=lambda: np.zeros(0))
    _most: Array = field(default_factory=lambda: np.zeros(0))
    _way: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def share(self, way: Array) -> Array:
        """See `Turning`."""
        if len(self._way) == 0:
            self._share, self._most = np.full(len(way), FIRST), np.ones(len(way))
            self._way = np.zeros_like(way)
        back = (way * self._way).sum(axis=1) < 0
        halved, grown = 0.5 * self._share, np.minimum(GROWTH * self._share, self._most)
        self._share = np.where(back, halved, grown)
        self._most = np.where(back, halved, self._most)
        self._way = way
        return self._share
