"""What the correction of drift takes off the motion that forces cause.

The drift of a frame is p = K d, linear in the motion d of the markers far from the contact. Forces
f move these a little too, d = G f, and the correction takes off a part of that motion for motion of
the camera. What is left is d - A p, so that the model of the corrected motion is (1 - A K) G f with
the motion A by a unit of drift. Otherwise forces that reach far are found too small.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.joint.markers.rows import MarkerRows
from gelslim_force.tracking.drift_filter import FrameDrift

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TakenDrift:
    """The correction of one frame, in mm on the gel.

    Attributes:
        markers: (k,) those of n whose motion tells the drift.
        gain: (4, 2k) drift per mm of their motion.
        basis: (n, 2, 4) motion of all markers per unit of drift.
    """

    markers: Nodes
    gain: Array
    basis: Array

    @classmethod
    def of(cls, drift: FrameDrift, mm_per_px: Array) -> TakenDrift | None:
        """By the drift of a frame, and (n, 2, 2) of the markers; None where none is corrected."""
        markers = np.flatnonzero(drift.gain.any(axis=(0, 2)))
        if len(markers) == 0:
            return None
        px_per_mm = np.linalg.inv(mm_per_px[markers])
        gain = np.einsum("ank,nkj->anj", drift.gain[:, markers], px_per_mm)
        return cls(markers, gain.reshape(4, -1), mm_per_px @ drift.basis)

    def off(self, data: MarkerRows, rows: Any, moved_mm: Array) -> MarkerRows:
        """The data of markers without what the correction takes off.

        Args:
            data: As without a correction.
            rows: (2k, 3p) motion of the markers that tell the drift, by the forces.
            moved_mm: (k, 2) present motion of these by the model.
        """
        basis = self.basis[data.used].reshape(-1, 4).astype(rows.dtype)
        taken = basis @ (self.gain.astype(rows.dtype) @ rows)
        present = self.at(data.used, moved_mm).ravel()
        return replace(data, rows=data.rows - taken, residual=data.residual + present)

    def at(self, chosen: Nodes, moved_mm: Array) -> Array:
        """(m, 2) motion that is taken off markers (m,) where the k markers move by (k, 2)."""
        return np.asarray(self.basis[chosen] @ (self.gain @ moved_mm.ravel()))
