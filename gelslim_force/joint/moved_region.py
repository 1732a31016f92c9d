"""Where the gel is touched, from the motion of the markers alone.

The traction of least size and roughness that explains the motion of all markers is a linear
function of it. Where this traction is large, the gel is touched. Pressure and tangential traction
are hard to tell apart without the limits of a friction cone, so their sum of squares counts. A node
must also have more traction than the errors of the markers cause: forces that may only push would
turn the noise of a wide region into a force. The region is an upper estimate: the fit then removes
nodes that hardly press.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_force.joint.responses import Responses

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TRACTION, ROUGHNESS = 0.3, 0.2
"""Standard deviations of each component of the traction and of the difference of neighbouring
nodes, over Young's modulus."""
_SHARE = 0.35
"""Share of the mean traction, weighted by itself, from which a node may be touched."""
_NOISE_SIGMAS = 2.0
"""A touched node has more traction than what the model leaves open of the markers, together with
this many standard deviations of their noise, causes over all components."""
_MOVED_SIGMAS, _LEAST_MOVED = 4.0, 4
"""Standard deviations beyond which a coordinate of a marker has moved, and how many must have."""
_NOISE_STEP = 1.2
"""Noise is rounded up to powers of this, so that the equations of a frame serve the next."""
_NOT_SEEN_MM = 1e3


class MovedRegion:
    """Finds the nodes in contact for one sensor. Preparing it computes the responses of all nodes.

    Args:
        responses: Of the markers to nodal forces.
        area_mm2: (c,) shares of the nodes in the surface.
        neighbours: (c, c) with 1 where nodes share an edge of a cell.
        lattice: The lattice of the nodes.
        youngs_modulus_mpa: Of the gel.
    """

    def __init__(
        self,
        responses: Responses,
        area_mm2: Array,
        neighbours: sparse.csr_array,
        lattice: NodeLattice,
        youngs_modulus_mpa: float,
    ) -> None:
        self._lattice = lattice
        nodes, markers = len(area_mm2), responses.markers
        rows = responses.of_markers(np.arange(nodes), np.arange(markers))
        seen = rows.astype(float).reshape(2 * markers, nodes, 3) / area_mm2[:, None]
        laplacian = sparse.diags_array(neighbours.sum(axis=1)) - neighbours
        stiff = laplacian / (ROUGHNESS * youngs_modulus_mpa) ** 2
        stiff = stiff + sparse.eye_array(nodes) / (TRACTION * youngs_modulus_mpa) ** 2
        factor = splu(stiff.tocsc())
        spread = [factor.solve(np.ascontiguousarray(seen[:, :, axis].T)) for axis in range(3)]
        self._traction = np.stack(spread, axis=1).astype(np.float32)
        self._covariance = sum(seen[:, :, axis] @ spread[axis] for axis in range(3))
        # In these modes the errors of the markers are independent for any size that all share.
        self._variance, modes = np.linalg.eigh(self._covariance)
        by_mode = self._traction.reshape(-1, 2 * markers) @ modes.astype(np.float32)
        self._square = np.square(by_mode).reshape(nodes, 3, -1).sum(axis=1)
        self._kept: tuple[bytes, tuple[Array, bool]] | None = None

    def nodes(self, lateral_mm: Array, noise_mm: Array, unresolved_mm: float) -> Mask:
        """(c,) nodes that may be in contact; none where the markers do not move.

        Args:
            lateral_mm: (n, 2) motion of the markers as a picture shows it; NaN for lost ones.
            noise_mm: (n,) standard deviation of each coordinate by the noise of the image.
            unresolved_mm: The same by what the model leaves open.
        """
        sigma_mm = np.hypot(noise_mm, unresolved_mm)
        lost = np.asarray(np.isnan(lateral_mm).any(axis=1))
        motion = np.where(lost[:, None], 0.0, lateral_mm)
        moved = np.abs(motion) > _MOVED_SIGMAS * sigma_mm[:, None]
        if moved.sum() < _LEAST_MOVED:
            return np.zeros(len(self._traction), dtype=bool)
        weights = cho_solve(self._factor(lost, sigma_mm), motion.ravel())
        traction = self._traction @ weights.astype(np.float32)
        size = np.sqrt((traction**2).sum(axis=1))
        mean = float(size @ size) / float(size.sum())
        by_errors = self._by_errors(float(np.median(noise_mm[~lost])), unresolved_mm)
        return self._lattice.widened((size > _SHARE * mean) & (size > by_errors), 1)

    def _by_errors(self, noise_mm: float, unresolved_mm: float) -> Array:
        """(c,) size of the traction that errors of the markers cause, all of them seen."""
        error_mm = float(np.hypot(unresolved_mm, _NOISE_SIGMAS * noise_mm))
        expected = self._variance + noise_mm**2 + unresolved_mm**2
        weight = np.square(error_mm / expected).astype(np.float32)
        return np.asarray(np.sqrt(self._square @ weight))

    def _factor(self, lost: Mask, sigma_mm: Array) -> tuple[Array, bool]:
        """Of the covariance of the motion; of lost markers it is all but unknown."""
        rounded = _NOISE_STEP ** np.ceil(np.log(sigma_mm) / np.log(_NOISE_STEP))
        sigma = np.where(lost, _NOT_SEEN_MM, rounded)
        key = sigma.tobytes()
        if self._kept is None or self._kept[0] != key:
            noise = np.diag(np.repeat(sigma, 2) ** 2)
            self._kept = key, cho_factor(self._covariance + noise, check_finite=False)
        return self._kept[1]
