"""What a gel and a camera that are not as specified do to forces of an object of unknown shape.

Forces f minimise what data y leave of the model A f, weighted by W, and a prior. A parameter of the
model that differs by dθ changes them by -H⁻¹ Aᵀ W (dA/dθ) f dθ with the Hessian H. For the gel,
(dA/dθ) f is what markers and light show of the change of the motion under the same forces. For the
camera it is the lateral motion that a picture shows per mm of height.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.light.rows import LightRows
from ifem_export.compliance.compliance_change import ComplianceChange

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class OffDesign:
    """Derivatives of what n markers and the light show of forces, by p parameters of the gel.

    Attributes:
        gel: Change of the motion under forces; None for a gel that is known.
        nodes_to_markers: (n, c) interpolation.
        by_height: (n, 2) lateral motion that the picture shows per mm less of a marker's height.
        lean_sigma: Standard deviation of `by_height`, the same for all markers.
    """

    gel: ComplianceChange | None
    nodes_to_markers: Any
    by_height: Array
    lean_sigma: float = 0.0

    def by_parameter(
        self, used: Nodes, by_motion: Array, light: LightRows | None, spread: Array, force_n: Array
    ) -> Array | None:
        """Change (p, 6) of six sums of the forces per unit of each parameter of the gel.

        Args:
            used: (m,) markers from which the forces follow.
            by_motion: (6, m, 2) change of the sums per mm, as `MarkerRows.by_motion` gives it.
            light: The light from which they follow, too; None for the markers alone.
            spread: (6, q) product of the sums with the covariance of the forces.
            force_n: (c, 3) forces.

        Returns:
            The change; None without parameters.
        """
        if self.gel is None:
            return None
        change = self.gel.motion(force_n)
        count, nodes = change.shape[:2]
        moved = self.nodes_to_markers @ change.transpose(1, 0, 2).reshape(nodes, -1)
        moved = moved.reshape(-1, count, 3)[used]
        seen = moved[..., :2] - self.by_height[used, None] * moved[..., 2:]
        found = np.tensordot(seen, by_motion, axes=((0, 2), (1, 2)))
        if light is not None:
            found += light.pull(change[..., 2]) @ spread.T
        return np.asarray(-found)

    def by_camera(self, used: Nodes, by_motion: Array, height_mm: Array) -> Array:
        """Covariance (6, 6) of six sums of the forces by the lean of the camera's view.

        Args:
            used: As in `by_parameter`.
            by_motion: As in `by_parameter`.
            height_mm: (c,) of the surface nodes.
        """
        height = (self.nodes_to_markers @ height_mm)[used]
        change = self.lean_sigma * np.einsum("anb,n->ab", by_motion, height)
        return np.asarray(change @ change.T)
