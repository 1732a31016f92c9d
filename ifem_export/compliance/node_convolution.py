"""Surface compliance and stiffness of the infinite pad among some nodes, as convolutions.

Among nodes that fill a box of m x m places of the lattice, a convolution needs its kernel for
distances below m only. Transforms of twice the box therefore give the same result as those of the
whole pad, in time m² log m instead of the square of m² for dense blocks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ifem_export.operators.layered_operator import even_fast_length
from ifem_export.operators.preconditioner import MirroredOperator

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LatticeKernel:
    """A convolution on a lattice by its blocks, and its windows for small boxes.

    Attributes:
        blocks: (ky >= 0, kx, 3, 3), real as in `MirroredOperator`.
        shape: Size (rows, columns) of the lattice, both even.
    """

    blocks: Array
    shape: tuple[int, int]

    @cached_property
    def response(self) -> Array:
        """(rows, columns, 3, 3): effect at a distance from the node that acts, periodic."""
        rows, half = self.shape[0], self.shape[0] // 2
        waves = np.empty((rows, self.shape[1] // 2 + 1, 3, 3), dtype=complex)
        waves[: half + 1] = self.blocks
        # With Y = diag(1, -1, 1) the wave vector -ky has the blocks Y B Y, which P turns into
        # the same with the sign of y.
        flipped = np.array([1.0, -1.0, 1.0])
        waves[half + 1 :] = (self.blocks * flipped[:, None] * flipped)[half - 1 : 0 : -1]
        waves[..., 2, :] *= 1j
        waves[..., 2] *= -1j
        return np.asarray(fft.irfft2(waves, s=self.shape, axes=(0, 1), workers=1))

    def window(self, positions: NDArray[np.int64]) -> MirroredOperator:
        """The convolution among nodes at lattice positions (n, 2), by transforms of their box."""
        corner = positions.min(axis=0)
        box = positions.max(axis=0) - corner + 1
        size = [even_fast_length(2 * int(m)) for m in box]
        if any(s >= whole for s, whole in zip(size, self.shape, strict=True)):
            return MirroredOperator(self.blocks, np.ascontiguousarray(positions), self.shape)
        rows, across = (_lags(s, int(m)) for s, m in zip(size, box, strict=True))
        near = np.zeros((*size, 3, 3))
        near[np.ix_(rows, across)] = self.response[np.ix_(rows, across)]
        waves = fft.rfft2(near, axes=(0, 1), workers=1)[: size[0] // 2 + 1]
        waves[..., 2, :] *= -1j
        waves[..., 2] *= 1j
        return MirroredOperator(
            np.ascontiguousarray(waves.real),
            np.ascontiguousarray(positions - corner),
            (size[0], size[1]),
        )

    @property
    def own(self) -> Array:
        """(3, 3) effect of a node on itself."""
        return np.array(self.response[0, 0])


def _lags(size: int, reach: int) -> NDArray[np.int64]:
    """Distances below `reach`, negative ones as negative indices."""
    return np.concatenate([np.arange(reach), np.arange(-reach + 1, 0)])


@dataclass(frozen=True, eq=False)
class NodeConvolution:
    """Compliance and stiffness of the infinite pad among n surface nodes.

    Attributes:
        compliance: Displacement (1, n, 3) in mm under forces (1, n, 3) in N on these nodes only.
        stiffness: Forces that hold displacements of these nodes, all others held at rest: an
            approximate inverse of the compliance.
        own: (3, 3) compliance of one node in mm/N.
    """

    compliance: MirroredOperator
    stiffness: MirroredOperator
    own: Array

    def __len__(self) -> int:
        """Number of unknowns 3n."""
        return 3 * len(self.compliance.columns)

    def displacement(self, force_n: Array) -> Array:
        """Displacement (n, 3) in mm under forces (n, 3) in N."""
        return np.asarray(self.compliance(force_n[None])[0])

    def force(self, displacement_mm: Array) -> Array:
        """Forces (n, 3) in N by the stiffness, for displacements (n, 3) in mm."""
        return np.asarray(self.stiffness(displacement_mm[None])[0])
