"""Errors of the forces of built fingers, whose bundle has the nominal gel.

The pipeline multiplies displacements of the surface by the nominal stiffness. The true force of
the same displacements follows Young's modulus exactly. Its change with the gel's thickness,
Poisson's ratio and the lateral scale is taken from the project's own stiffness: a patch of the pad
is assembled with each figure a little larger and smaller, and the total forces of a press and of a
shear are compared. These exponents hold to first order; they are applied to ratios as powers.

Before a calibration a picture that is too large reads displacements that are too large. The
calibration takes the printed pitch for its ruler: camera pose, image distance, lens centring and
acrylic no longer matter, an error of the print's scale now does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.tolerance.assembly import Stage, assembled
from gelslim_cad.tolerance.built import LEAST_LAYER, Errors
from gelslim_cad.tolerance.causes import no_errors
from gelslim_cad.tolerance.picture import scales

Array = NDArray[np.float64]
STEP = 0.02
"""Relative step of thickness and lateral scale, of which the exponents are differences."""
POISSON_STEP = 0.004
WIDTH_MM, CELL_MM, CELLS = 2.0, 0.75, 20
"""Standard deviation of the bump that is pressed and sheared, and the patch's square cells."""
LARGEST_LOG = 5.0
"""Logarithms of ratios are cut off here, so that absurd tolerances give finite numbers."""
WAYS = {"normal": (0.0, 0.0, -1.0), "shear": (1.0, 0.0, 0.0)}


@dataclass(frozen=True)
class Exponents:
    """Logarithmic derivatives of a total force for given displacements of the surface.

    Attributes:
        thickness: d ln F / d ln h.
        poisson: d ln F / d ν.
        lateral: d ln F / d ln of the lateral scale of gel and displacement field.
    """

    thickness: float
    poisson: float
    lateral: float


@dataclass(frozen=True)
class ForceError:
    """Relative errors of one component of the force over the sampled fingers, in per cent.

    Attributes:
        component: `normal` or `shear`.
        calibrated: Whether the finger was calibrated.
        deviation_percent: Standard deviation.
        most_percent: Size that 95 % of the fingers do not exceed.
        causes: Standard deviation by cause, each alone.
    """

    component: str
    calibrated: bool
    deviation_percent: float
    most_percent: float
    causes: Mapping[str, float]


def exponents(d: Dimensions) -> dict[str, Exponents]:
    """Exponents of the normal and of the shear force of a finger's pad.

    Raises IfemError where the patch has no operator.
    """
    return _exponents(
        float(f"{d['design.gel.thickness_mm']:.6g}"),
        d["material.gel.poissons_ratio"],
        max(int(d["mesh.layers"]), 2),
        str(d["mesh.element"]),
    )


@lru_cache(maxsize=64)
def _exponents(
    thickness_mm: float, poisson: float, layers: int, element: str
) -> dict[str, Exponents]:
    step = min(POISSON_STEP, (0.5 - poisson) / 4)
    poisson = max(poisson, step)  # below 0 there is no legal gel

    def change(size: float, **factors: float) -> dict[str, float]:
        ends = [
            patch_forces(
                thickness_mm * (1 + sign * factors.get("thickness", 0.0)),
                poisson + sign * factors.get("poisson", 0.0),
                1 + sign * factors.get("lateral", 0.0),
                layers,
                element,
            )
            for sign in (1, -1)
        ]
        return {way: np.log(ends[0][way] / ends[1][way]) / (2 * size) for way in WAYS}

    by_thickness, by_lateral = (change(STEP, **{name: STEP}) for name in ("thickness", "lateral"))
    by_poisson = change(step, poisson=step)
    return {
        way: Exponents(float(by_thickness[way]), float(by_poisson[way]), float(by_lateral[way]))
        for way in WAYS
    }


def patch_forces(
    thickness_mm: float, poisson: float, lateral: float, layers: int, element: str
) -> dict[str, float]:
    """Total forces of a bump that is pressed and sheared, for E = 1 MPa and a height of 1 mm.

    `lateral` scales the patch and the bump's width; the displacements of its nodes stay.
    """
    from ifem_export.elements.material import Material
    from ifem_export.mesh.pad_mesh import PadMesh
    from ifem_export.operators.surface_operator import surface_operator

    cell = CELL_MM * lateral
    mesh = PadMesh.from_occupancy(
        np.ones((CELLS, CELLS, layers), bool),
        (cell, cell, thickness_mm / layers),
        (-CELLS * cell / 2, -CELLS * cell / 2, -thickness_mm),
    )
    formulation: Any = element
    operator = surface_operator(mesh, Material(1.0, poisson, 1000.0), formulation, "pcg", rtol=1e-8)
    at = np.asarray(mesh.nodes_mm)[mesh.surface][:, :2] / lateral
    bump = np.exp(-(at**2).sum(axis=1) / (2 * WIDTH_MM**2))[:, None]
    totals = {way: operator.force(bump * np.array(v)).sum(axis=0) for way, v in WAYS.items()}
    return {way: float(totals[way] @ np.array(v)) for way, v in WAYS.items()}


def force_errors(d: Dimensions, e: Errors, stage: Stage) -> tuple[ForceError, ...]:
    """Errors of the forces, without and with a calibration.

    Args:
        d: Dimensions of the design.
        e: Errors (n,) by name.
        stage: How the fingers are assembled.

    Returns:
        Normal and shear force, first without, then with calibration; nothing without markers.
    """
    if not has_markers(d):
        return ()
    powers = exponents(d)
    picture = picture_scale_log(d, e, stage)
    found = []
    for calibrated in (False, True):
        for way, power in powers.items():
            parts = _log_parts(d, e, power, picture, calibrated)
            ratio = np.exp(np.clip(sum(parts.values()), -LARGEST_LOG, LARGEST_LOG))
            error = 100 * (ratio - 1)
            alone = {
                name: float(np.std(100 * np.expm1(np.clip(v, -LARGEST_LOG, LARGEST_LOG))))
                for name, v in parts.items()
            }
            most = float(np.quantile(np.abs(error), 0.95))
            found.append(ForceError(way, calibrated, float(error.std()), most, alone))
    return tuple(found)


def _log_parts(
    d: Dimensions, e: Errors, power: Exponents, picture: Array, calibrated: bool
) -> dict[str, Array]:
    """Logarithms (n,) of the force that is read over the true one, by cause."""
    poisson = d["material.gel.poissons_ratio"]
    change = np.clip(poisson + e["poisson"], 0, 0.4999) - poisson
    printed = _log_ratio(e["print_percent"] / 100) + _log_ratio(-e["shrinkage_percent"] / 100)
    parts = {
        "Young's modulus": -_log_ratio(e["modulus_percent"] / 100),
        "Poisson's ratio": -power.poisson * change,
        "gel thickness": -power.thickness * _log_ratio(e["gel_mm"] / d["design.gel.thickness_mm"]),
        "marker print": -power.lateral * printed,
    }
    if not calibrated:
        return parts | {"scale of the picture": picture}
    parts["marker print"] = parts["marker print"] - printed
    return parts | {"calibration": _log_ratio(e["scale_percent"] / 100)}


def _log_ratio(relative: Array) -> Array:
    return np.asarray(np.log(np.maximum(1 + relative, LEAST_LAYER)))


def picture_scale_log(d: Dimensions, e: Errors, stage: Stage) -> Array:
    """Logarithm (n,) of the picture's scale at the middle of the gel over the design's."""
    middle = np.zeros((1, 1))
    _, seen = scales(assembled(d, e, stage), middle, middle)
    _, design = scales(assembled(d, no_errors(d), "as_built"), middle, middle)
    return np.asarray(np.log(np.maximum(seen / design, LEAST_LAYER)))[:, 0]
