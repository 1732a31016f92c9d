"""Expected error of the force field of a design, from a small patch of its own pad.

A bump of 0.1 mm, about a pad thickness wide, presses and shears a patch of the design's own cells,
layers and element. Two errors are measured there:

- mesh: forces against the same patch at half the pitch with eight B-bar layers, the reference of
  the bundle's ladder (`ifem_export.ladder`), relative in L2, the worse of press and shear;
- noise: forces that errors of the marker positions make, the markers as far apart as the design's
  and bilinear in between, root mean square over the contact (two widths around its middle),
  relative to the same force field.

Both depend only on ratios (cell over thickness, markers per cell) and on Poisson's ratio, so
designs that share these share the patch; Young's modulus drops out. Left out: the pad's edges and
crown, large strain and slip, and the pipeline's smoothing, which lowers the noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.lookup import Lookup

PAD_NAMES = (
    "design.gel.thickness_mm",
    "design.markers.diameter_mm",
    "design.markers.pitch_mm",
    "material.gel.poissons_ratio",
    "mesh.element",
    "mesh.layers",
    "pad_mesh.cell_x_mm",
    "pad_mesh.cell_y_mm",
    "view.marker_along_px",
    "view.marker_across_px",
)
"""What the error depends on."""
MARKER_NOISE_PX = 0.05
DEPTH_MM = 0.1
DIGITS = 6
WIDTHS = 7.0
MOST_CELLS = 48
DRAWS, SEED = 8, 20
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patch:
    """A patch in units of the pad's thickness: cells, layers, element, marker pitch."""

    cell_x: float
    cell_y: float
    layers: int
    element: str
    poissons_ratio: float
    pitch: float

    @classmethod
    def of(cls, d: Lookup) -> Patch:
        """The patch of a design, ratios rounded to `DIGITS` significant digits."""
        t = float(d["design.gel.thickness_mm"])
        return cls(
            rounded(d["pad_mesh.cell_x_mm"] / t),
            rounded(d["pad_mesh.cell_y_mm"] / t),
            int(d["mesh.layers"]),
            str(d["mesh.element"]),
            rounded(d["material.gel.poissons_ratio"]),
            rounded(d["design.markers.pitch_mm"] / t),
        )


@dataclass(frozen=True)
class PatchError:
    """Errors of a patch: of its mesh, and the gain of position noise over the bump's depth."""

    mesh: float
    noise_gain: float

    def noise(self, d: Lookup, noise_px: float) -> float:
        """Relative force error by marker positions known to `noise_px`, at the far edge."""
        px = min(d["view.marker_along_px"], d["view.marker_across_px"])
        sigma_mm = noise_px * d["design.markers.diameter_mm"] / px
        return float(self.noise_gain * sigma_mm / DEPTH_MM)


def patch_error(patch: Patch) -> PatchError:
    """Measure a patch: about a second. Raises IfemError where its mesh has no operator."""
    from ifem_export.ladder import reference_force
    from ifem_export.material import Material
    from ifem_export.surface_operator import surface_operator

    mesh, width = _mesh(patch)
    gel = Material(1.0, patch.poissons_ratio, 1000.0)
    rung: Any = "paper" if patch.layers == 1 else "pcg"
    element: Any = patch.element
    operator = surface_operator(mesh, gel, element, rung, rtol=1e-6)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    errors, sizes = [], []
    for way in ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)):

        def bump(p: Array, way: tuple[float, float, float] = way) -> Array:
            squares = (np.asarray(p)[:, :2] ** 2).sum(axis=1)
            return np.asarray(np.exp(-squares / (2 * width**2))[:, None] * np.array(way))

        expected = reference_force(mesh, gel, bump)
        found = operator.force(bump(points))
        errors.append(float(np.linalg.norm(found - expected) / np.linalg.norm(expected)))
        sizes.append(float(np.linalg.norm(expected)))
    contact = (points[:, :2] ** 2).sum(axis=1) <= (2 * width) ** 2
    noise = [operator.force(u)[contact] for u in _noise(points, patch.pitch)]
    gain = math.sqrt(float(np.mean([(f**2).sum() for f in noise]))) / min(sizes)
    return PatchError(rounded(max(errors)), rounded(gain))


def _mesh(patch: Patch) -> tuple[Any, float]:
    from ifem_export.pad_mesh import PadMesh

    width = max(1.0, 2.5 * max(patch.cell_x, patch.cell_y))
    nx, ny = (
        min(MOST_CELLS, 2 * math.ceil(WIDTHS * width / cell / 2))
        for cell in (patch.cell_x, patch.cell_y)
    )
    size = (patch.cell_x, patch.cell_y, 1.0 / patch.layers)
    corner = (-nx * patch.cell_x / 2, -ny * patch.cell_y / 2, -1.0)
    return PadMesh.from_occupancy(np.ones((nx, ny, patch.layers), bool), size, corner), width


def _noise(points: Array, pitch: float) -> list[Array]:
    """Displacements (draws, c, 3) of unit standard deviation at markers, bilinear between."""
    from scipy.interpolate import RegularGridInterpolator

    rng = np.random.default_rng(SEED)
    reach = np.abs(points[:, :2]).max(axis=0)
    lines = [pitch * np.arange(-(n := math.ceil(r / pitch) + 1), n + 1) for r in reach]
    fields = []
    for _ in range(DRAWS):
        values = rng.normal(size=(len(lines[0]), len(lines[1]), 3))
        fields.append(RegularGridInterpolator(tuple(lines), values)(points[:, :2]))
    return fields


def rounded(value: float) -> float:
    """To `DIGITS` significant digits, so that the last bits of a solver do not show."""
    return float(f"{float(value):.{DIGITS}g}")
