"""What a contact needs of the compliance of a pad's surface."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.node_convolution import NodeConvolution

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
NodeCompliance = NDArray[np.float32] | NodeConvolution
"""Compliance among n nodes: (3n, 3n) in mm/N, or a convolution."""


class SurfaceResponse(Protocol):
    """Motion under contact forces, as the contact's solver takes it: of a pad, or of a pad and a
    soft layer of the body."""

    @property
    def bundle(self) -> Bundle:
        """The gel."""

    def block(self, nodes: Nodes, known: Any = None) -> Any:
        """`NodeCompliance` among nodes (n,); `known` is that of the first of them."""

    def displacement(self, nodes: Nodes, force_n: Array, known_mm: Array | None = None) -> Array:
        """Displacement (c, 3) in mm under forces (n, 3) in N on `nodes` (n,).

        `known_mm` (n, 3) is the displacement of `nodes`, where it is known.
        """

    def store(self) -> None:
        """Keep for the next run what took time to compute."""


class PadCompliance(SurfaceResponse, Protocol):
    """Surface compliance of a pad: a table of columns, or a convolution."""

    @property
    def nodes(self) -> int:
        """Number of surface nodes."""

    def whole(self, force_n: Array) -> Array:
        """Exact displacement (c, 3) in mm under forces (c, 3) in N on all nodes, by a solve."""
