"""Inner products of the motions that single nodal forces make, for fits to a motion.

A fit of forces f on few nodes to a motion u of the whole surface, |C f - u|², needs C only through
CᵀC among those nodes. For a convolution that is a convolution again as long as the pad is not
cropped; cropping takes something away. What is kept here therefore bounds the true products from
above: steps of a fit made with it never overshoot, and are exact far from the rim.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ifem_export.operators.layered_operator import LayeredOperator

Array = NDArray[np.float64]


class ComplianceGram:
    """Upper bound of CᵀC of a cropped convolution `compliance` with blocks (ky, kx, 3, 3)."""

    def __init__(self, compliance: LayeredOperator) -> None:
        self._compliance = compliance

    @cached_property
    def kernel(self) -> Array:
        """(rows, columns, 3, 3) mm²/N² between two nodes by their distance in columns, periodic."""
        blocks, shape = self._compliance.blocks, self._compliance.shape
        square = np.matmul(blocks.conj().swapaxes(-1, -2), blocks)
        return np.ascontiguousarray(np.fft.irfft2(square, s=shape, axes=(0, 1)))

    def block(self, nodes: NDArray[np.intp]) -> Array:
        """(3n, 3n) among surface nodes (n,), symmetric."""
        from ifem_export.operators.surface_kernel import gathered

        out = np.empty((3 * len(nodes), 3 * len(nodes)))
        gathered(self.kernel, np.ascontiguousarray(self._compliance.columns[nodes]), out)
        return out


def gram_of(operator: Any) -> ComplianceGram | None:
    """That of an operator whose compliance is a convolution, else None."""
    found = getattr(operator, "gram", None)
    return found if isinstance(found, ComplianceGram) else None
