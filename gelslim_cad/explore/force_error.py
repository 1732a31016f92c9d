"""Expected error of the force field of a design, from a small patch of its own pad.

The same contact for every design, a bump 0.1 mm deep and 2 mm wide (standard deviation), presses
and shears a patch of the design's own thickness, cells, layers and element. Two errors are
measured there:

- mesh: forces against the same patch at half the pitch with eight B-bar layers, the reference of
  the bundle's ladder (`ifem_export.operators.ladder`), relative in L2, the worse of press and
  shear;
- noise: forces that errors of the marker positions make, the markers as far apart as the design's
  and bilinear in between, root mean square over the contact (two widths around its middle),
  relative to the same force field.

Designs that share thickness, cells, layers, marker pitch and Poisson's ratio share the patch;
Young's modulus drops out. Left out: the pad's edges and crown, large strain and slip, and the
pipeline's smoothing, which lowers the noise. So errors rank designs; a bundle's ladder and the
calibration of a built sensor say more of one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name

PAD_NAMES: tuple[Name, ...] = (
    "design.gel.thickness_mm",
    "design.markers.diameter_mm",
    "design.markers.pitch_mm",
    "material.gel.poissons_ratio",
    "material.gel.youngs_modulus_mpa",
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
WIDTH_MM, SIDE_MM = 2.0, 14.0
MOST_CELLS = 56
DRAWS, SEED = 8, 20
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patch:
    """A patch of a pad: its thickness, cells, layers, element and marker pitch."""

    thickness_mm: float
    cell_x_mm: float
    cell_y_mm: float
    layers: int
    element: str
    poissons_ratio: float
    pitch_mm: float

    @classmethod
    def of(cls, d: Lookup) -> Patch:
        """The patch of a design, numbers rounded to `DIGITS` significant digits."""
        return cls(
            rounded(d["design.gel.thickness_mm"]),
            rounded(d["pad_mesh.cell_x_mm"]),
            rounded(d["pad_mesh.cell_y_mm"]),
            int(d["mesh.layers"]),
            str(d["mesh.element"]),
            rounded(d["material.gel.poissons_ratio"]),
            rounded(d["design.markers.pitch_mm"]),
        )


@dataclass(frozen=True)
class PatchError:
    """Errors of a patch: of its mesh, and of position noise as large as the bump is deep.

    `press_mm` times Young's modulus is its stiffness: the work of pressing the bump in, u·f, over
    the square of its depth.
    """

    mesh: float
    noise_gain: float
    press_mm: float

    def noise(self, d: Lookup, noise_px: float) -> float:
        """Relative force error by marker positions known to `noise_px`, at the far edge."""
        px = min(d["view.marker_along_px"], d["view.marker_across_px"])
        sigma_mm = noise_px * d["design.markers.diameter_mm"] / px
        return float(self.noise_gain * sigma_mm / DEPTH_MM)

    def total(self, d: Lookup, noise_px: float) -> float:
        """Error of mesh and noise together, as independent errors."""
        return math.hypot(self.mesh, self.noise(d, noise_px))

    def stiffness(self, d: Lookup) -> float:
        """Stiffness of the gel against the bump in N/mm: u·f over the square of the depth."""
        return rounded(self.press_mm * d["material.gel.youngs_modulus_mpa"])


def patch_error(patch: Patch) -> PatchError:
    """Measure a patch: about a second. Raises IfemError where its mesh has no operator."""
    from ifem_export.elements.material import Material
    from ifem_export.operators.ladder import reference_forces
    from ifem_export.operators.surface_operator import surface_operator

    mesh = _mesh(patch)
    gel = Material(1.0, patch.poissons_ratio, 1000.0)
    rung: Any = "paper" if patch.layers == 1 else "pcg"
    element: Any = patch.element
    operator = surface_operator(mesh, gel, element, rung, rtol=1e-6)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    errors, sizes, work = [], [], 0.0
    motions = [_bump((1.0, 0.0, 0.0)), _bump((0.0, 0.0, -1.0))]
    truth = reference_forces(mesh, gel, motions)
    for bump, expected in zip(motions, truth, strict=True):
        found = operator.force(bump(points))
        errors.append(float(np.linalg.norm(found - expected) / np.linalg.norm(expected)))
        sizes.append(float(np.linalg.norm(expected)))
        work = float((bump(points) * expected).sum())  # the last way, the press, stays
    contact = (points[:, :2] ** 2).sum(axis=1) <= (2 * WIDTH_MM) ** 2
    noise = [operator.force(u)[contact] for u in _noise(points, patch.pitch_mm)]
    gain = math.sqrt(float(np.mean([(f**2).sum() for f in noise]))) / min(sizes)
    return PatchError(rounded(max(errors)), rounded(gain), rounded(work))


def _bump(way: tuple[float, float, float]) -> Callable[[Array], Array]:
    """Motion of surface points (n, 3) that is 1 mm along `way` at the middle."""

    def motion(points: Array) -> Array:
        squares = (np.asarray(points)[:, :2] ** 2).sum(axis=1)
        return np.asarray(np.exp(-squares / (2 * WIDTH_MM**2))[:, None] * np.array(way))

    return motion


def _mesh(patch: Patch) -> Any:
    from ifem_export.mesh.pad_mesh import PadMesh

    hx, hy, t = patch.cell_x_mm, patch.cell_y_mm, patch.thickness_mm
    nx, ny = (min(MOST_CELLS, 2 * math.ceil(SIDE_MM / h / 2)) for h in (hx, hy))
    cells = np.ones((nx, ny, patch.layers), bool)
    return PadMesh.from_occupancy(
        cells, (hx, hy, t / patch.layers), (-nx * hx / 2, -ny * hy / 2, -t)
    )


def _noise(points: Array, pitch_mm: float) -> list[Array]:
    """Displacements (draws, c, 3) of unit standard deviation at markers, bilinear between."""
    from scipy.interpolate import RegularGridInterpolator

    rng = np.random.default_rng(SEED)
    reach = np.abs(points[:, :2]).max(axis=0)
    lines = [pitch_mm * np.arange(-(n := math.ceil(r / pitch_mm) + 1), n + 1) for r in reach]
    fields = []
    for _ in range(DRAWS):
        values = rng.normal(size=(len(lines[0]), len(lines[1]), 3))
        fields.append(RegularGridInterpolator(tuple(lines), values)(points[:, :2]))
    return fields


def rounded(value: float) -> float:
    """To `DIGITS` significant digits, so that the last bits of a solver do not show."""
    return float(f"{float(value):.{DIGITS}g}")
