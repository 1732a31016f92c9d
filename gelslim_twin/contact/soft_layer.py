"""A body with a soft layer on a rigid core: its compliance, and that of gel and layer together.

A contact of two elastic bodies is that of one rigid and one whose compliance is the sum of theirs
(Johnson, Contact Mechanics, 4.1). So the solver takes the motion of a node relative to the point of
the body's surface that it touches, and the rigid tool in its undeformed place.

The layer is isotropic, bonded to the core, and as wide as the gel. To forces per area of the wave
number k it moves by

    u_z = A/k (L f_z + i M f_L),  u_L = A/k (N f_L - i M f_z),  u_T = tanh(kh)/(G k) f_T

with A = 2 (1 - ν²)/E, along z, along the wave and across it; L, M and N as in `BallOnLayer` (Hannah
1951). The signs of M are those of a layer that faces down. A nodal force acts with the shape of a
bilinear element's node, and the motion of a node is the mean with the same weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
OVERSAMPLED = 2
"""Points of the transform per distance of nodes."""
AROUND = 4.0
"""Room between the layer and its periodic images, in thicknesses."""
SMALLEST = 1e-5
"""Of kh: the layer moves in the mean as at this wave number."""


@dataclass(frozen=True)
class SoftLayer:
    """A layer on a rigid core.

    Attributes:
        youngs_modulus_mpa: Young's modulus.
        poissons_ratio: Poisson's ratio, from 0 to below 0.5.
        thickness_mm: Thickness.
    """

    youngs_modulus_mpa: float
    poissons_ratio: float
    thickness_mm: float

    def __post_init__(self) -> None:
        for name in ("youngs_modulus_mpa", "thickness_mm"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value}: must be a number above 0")
        if not 0 <= self.poissons_ratio < 0.5:
            raise ValueError(f"poissons_ratio = {self.poissons_ratio}: must be from 0 to below 0.5")

    def table(self, pitch_mm: tuple[float, float], counts: tuple[int, int]) -> Array:
        """Compliance by the way from one node of an even lattice to another.

        Args:
            pitch_mm: Distances of the nodes along x and y.
            counts: Numbers of nodes along x and y.

        Returns:
            (2 nx - 1, 2 ny - 1, 3, 3) in mm/N; no way at all is in the middle.
        """
        steps = [pitch / OVERSAMPLED for pitch in pitch_mm]
        sizes = [
            next_fast_len(
                OVERSAMPLED * (2 * count + int(np.ceil(AROUND * self.thickness_mm / pitch)))
            )
            for count, pitch in zip(counts, pitch_mm, strict=True)
        ]
        kx, ky = np.meshgrid(
            *(2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip(sizes, steps, strict=True)),
            indexing="ij",
        )
        weight = np.ones_like(kx)
        for wave, pitch in ((kx, pitch_mm[0]), (ky, pitch_mm[1])):
            # The hat's transform, once for the force and once for the mean of the motion.
            weight = weight * np.sinc(wave * pitch / (2 * np.pi)) ** 4
        # Places along both axes, those of negative ways at the end.
        ways = [
            OVERSAMPLED * np.arange(1 - n, n) % size for n, size in zip(counts, sizes, strict=True)
        ]
        found = np.empty((len(ways[0]), len(ways[1]), 3, 3))
        for (i, j), spectrum in self._spectra(kx, ky).items():
            moved = np.fft.ifft2(spectrum * weight).real / (steps[0] * steps[1])
            found[:, :, i, j] = moved[np.ix_(*ways)]
        return found

    def _spectra(self, kx: Array, ky: Array) -> dict[tuple[int, int], NDArray[np.complex128]]:
        """Motion along axis i by a force per area along axis j, at each wave number."""
        h, nu = self.thickness_mm, self.poissons_ratio
        k = np.maximum(np.hypot(kx, ky), SMALLEST / h)
        x, kappa = k * h, 3 - 4 * nu
        # Numerators and denominator over exp(2x), which would overflow.
        e = np.exp(-2 * x)
        sinh, cosh = (1 - e * e) / 2, (1 + e * e) / 2
        below = 2 * kappa * cosh + (1 + kappa**2 + 4 * x**2) * e
        scale = 2 * (1 - nu**2) / (self.youngs_modulus_mpa * k)
        along_z = scale * (2 * kappa * sinh - 4 * x * e) / below
        along = scale * (2 * kappa * sinh + 4 * x * e) / below
        mixed = scale * (8 * x**2 * e - 2 * kappa * (kappa - 1) * (cosh - e))
        mixed = mixed / ((kappa + 1) * below)
        across = 2 * (1 + nu) / (self.youngs_modulus_mpa * k) * (1 - e) / (1 + e)
        cx, cy = kx / k, ky / k
        # The mean motion has no direction.
        cx[0, 0] = cy[0, 0] = np.sqrt(0.5)
        mixed[0, 0] = 0.0
        both = (along - across) * cx * cy
        both[0, 0] = 0.0
        return {
            (0, 0): along * cx**2 + across * cy**2 + 0j,
            (1, 1): along * cy**2 + across * cx**2 + 0j,
            (2, 2): along_z + 0j,
            (0, 1): both + 0j,
            (1, 0): both + 0j,
            (2, 0): 1j * mixed * cx,
            (2, 1): 1j * mixed * cy,
            (0, 2): -1j * mixed * cx,
            (1, 2): -1j * mixed * cy,
        }


@dataclass(frozen=True, eq=False)
class GelAndLayer:
    """The compliance of the gel and of a soft layer of the body, for their relative motion."""

    gel: SurfaceCompliance
    layer_table: Array
    """As of `SoftLayer.table`."""
    places: NDArray[np.int64]
    """Places (c, 2) of the surface nodes in their lattice."""

    @classmethod
    def of(cls, gel: SurfaceCompliance, layer: SoftLayer) -> GelAndLayer:
        """The sum of both."""
        mesh = gel.bundle.mesh
        points, pitch = np.asarray(mesh.surface_mm)[:, :2], mesh.cell_size_mm[:2]
        places = np.rint((points - points.min(axis=0)) / np.asarray(pitch)).astype(np.int64)
        nx, ny = (int(n) + 1 for n in places.max(axis=0))
        return cls(gel, layer.table((pitch[0], pitch[1]), (nx, ny)), places)

    @property
    def bundle(self) -> Bundle:
        """The gel."""
        return self.gel.bundle

    def block(self, nodes: Nodes, known: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """C among nodes (n,), (3n, 3n) in mm/N; the sum is made anew, `known` is not used."""
        own = self._between(self.places[nodes], self.places[nodes])
        found: Array = self.gel.block(nodes) + own.transpose(0, 2, 1, 3).reshape(3 * len(nodes), -1)
        return found.astype(np.float32)

    def displacement(self, nodes: Nodes, force_n: Array, known_mm: Array | None = None) -> Array:
        """Relative motion (c, 3) under forces (n, 3) on the gel at `nodes` (n,)."""
        found = self.gel.displacement(nodes, force_n) + self.layer_motion_mm(nodes, force_n)
        if known_mm is not None:
            found[nodes] = known_mm
        return found

    def layer_motion_mm(self, nodes: Nodes, force_n: Array) -> Array:
        """The part (c, 3) of the layer: its surface moves by the opposite of this."""
        pushed = np.flatnonzero(force_n.any(axis=1))
        own = self._between(self.places, self.places[nodes[pushed]])
        return np.asarray(np.einsum("cnij,nj->ci", own, force_n[pushed]))

    def store(self) -> None:
        """Keep the columns of the gel that were computed."""
        self.gel.store()

    def _between(self, to: NDArray[np.int64], by: NDArray[np.int64]) -> Array:
        """Compliance (m, n, 3, 3) of motion at places (m, 2) by forces at places (n, 2)."""
        middle = np.array(self.layer_table.shape[:2]) // 2
        way = to[:, None] - by[None] + middle
        return self.layer_table[way[..., 0], way[..., 1]]
