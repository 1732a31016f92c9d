"""Marker grid, pad mesh, light and bundle of a finger. All of them use the same marker grid."""

from __future__ import annotations

import hashlib
import json
import math
from functools import partial
from typing import Any, Literal, cast

import numpy as np

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.gel import bare, gel_material, gel_skin, tolerances
from gelslim_cad.geometry.gel_shape import GelShape, has_markers
from gelslim_cad.geometry.led_strips import camera_responses
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name
from gelslim_cad.geometry.optics import camera_record, guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.markers.nodes import NearestNodes, nearest_nodes
from gelslim_cad.markers.outline import Outline
from gelslim_cad.spec import Spec
from gelslim_core.errors import GelslimError
from gelslim_optics.light.light_map import LightMap, light_arrays
from gelslim_optics.light.result import Estimate
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.hex8 import Formulation
from ifem_export.elements.material import Material
from ifem_export.markers.grid import Anchors, MarkerGrid, build_marker_grid
from ifem_export.mesh.crop import CropReport, Weighting
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import REFERENCE_LAYERS, Progress, measure_ladder
from ifem_export.operators.operator_ladder import OperatorLadder

RAYS = 1 << 16
AZIMUTHS_DEG = 90.0, -90.0, 180.0
"""Directions of the light of the strips: left towards +y, right towards -y, tip towards -x."""
SLOPE_AXES: tuple[Literal["x", "y"], ...] = ("y", "y", "x")
"""Along which a slope changes the light of each strip most."""
SMOOTHING_MM = 0.6
GRID_NAMES: tuple[Name, ...] = (
    "design.gel.corner_radius_mm",
    "design.gel.length_mm",
    "design.gel.width_mm",
    "design.markers.anchors",
    "design.markers.diameter_mm",
    "design.markers.pattern",
    "design.markers.pitch_mm",
    "marker_grid.columns",
    "marker_grid.rows",
)
"""Names that the markers within the gel's outline look up."""
MARKER_NAMES: tuple[Name, ...] = (*GRID_NAMES, "manufacturing.kerf.film_mm")
"""Names that the drawings of the marker print look up."""
LADDER_NAMES: tuple[Name, ...] = (
    *GRID_NAMES,
    "design.gel.crown_height_mm",
    "design.gel.thickness_mm",
    "material.gel.density_kg_m3",
    "material.gel.poissons_ratio",
    "material.gel.youngs_modulus_mpa",
    "mesh.cells_across",
    "mesh.cells_along",
    "mesh.element",
    "mesh.layers",
    "mesh.least_fill",
    "mesh.weighting",
    "pad_mesh.cell_x_mm",
    "pad_mesh.cell_y_mm",
)
"""Names that markers, meshes and the ladder of the operators look up."""


def spec_hash(spec: Spec) -> str:
    """SHA-256 of the spec's content: comments, order and spelt-out defaults do not change it."""
    # A layer that is absent leaves the hash as it was before specs had layers.
    values = spec.model_dump(mode="json", exclude={"material": bare(spec)})
    content = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()


def pad_outline(d: Lookup) -> RoundedRectangle:
    """The gel seen from above."""
    return RoundedRectangle(
        d["design.gel.length_mm"], d["design.gel.width_mm"], d["design.gel.corner_radius_mm"]
    )


class NoMarkersError(GelslimError):
    """Something needs markers, and the spec has none."""

    kind = "no markers"
    field = "design.markers.pattern"
    remedy = "set design.markers.pattern: grid"

    def __init__(self) -> None:
        super().__init__(
            f"{self.field} = none: a gel without markers has no marker files, no bundle and no "
            "forces, which are found from the motion of the printed dots; "
            f"{self.remedy} for them"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the error as data: kind, message, field, value and remedy."""
        return {**super().to_dict(), "field": self.field, "value": "none", "remedy": self.remedy}


def printed_grid(d: Lookup) -> MarkerGrid | None:
    """The printed lattice of markers; None for a gel without."""
    return marker_grid(d) if has_markers(d) else None


def marker_grid(d: Lookup) -> MarkerGrid:
    """Make the printed lattice of markers.

    Args:
        d: Dimensions of the finger.

    Returns:
        The markers, without those that would cross the gel's outline.

    Raises:
        NoMarkersError: The gel has no markers.
    """
    if not has_markers(d):
        raise NoMarkersError
    grid = build_marker_grid(
        round(d["marker_grid.rows"]),
        round(d["marker_grid.columns"]),
        d["design.markers.pitch_mm"],
        d["design.markers.diameter_mm"],
        anchors=cast(Anchors, d["design.markers.anchors"]),
    )
    outline = pad_outline(d)
    return grid.clipped(lambda points: outline.contains(points[:, 0], points[:, 1]))


def pad_mesh(d: Lookup, grid: MarkerGrid) -> tuple[PadMesh, CropReport]:
    """Mesh the pad with Hex-8 elements; nodes meet the markers where the cell size allows it.

    Args:
        d: Dimensions of the finger.
        grid: Its markers.

    Returns:
        The mesh, and what was cut off at the pad's outline.
    """
    outline, shape = pad_outline(d), GelShape.of(d)
    build = partial(
        build_pad_mesh,
        outline,
        shape.thickness_mm,
        crown=_crown(shape),
        weighting=cast(Weighting, d["mesh.weighting"]),
        floor=d["mesh.least_fill"],
    )
    along, across = d["mesh.cells_along"], d["mesh.cells_across"]
    if along is not None and across is not None:
        return build(cells=(along, across, d["mesh.layers"]))
    return build(
        pitch_mm=(d["pad_mesh.cell_x_mm"], d["pad_mesh.cell_y_mm"]),
        layers=d["mesh.layers"],
        align_to_mm=grid.positions_mm,
    )


def reference_mesh(d: Lookup, mesh: PadMesh) -> PadMesh | None:
    """Mesh of half the pitch and eight layers to measure a cut or crowned pad against.

    None where the pad's own cells can be split.
    """
    if mesh.fill is None and mesh.surface_shift is None:
        return None
    shape = GelShape.of(d)
    return build_pad_mesh(
        pad_outline(d),
        shape.thickness_mm,
        pitch_mm=(mesh.cell_size_mm[0] / 2, mesh.cell_size_mm[1] / 2),
        layers=max(REFERENCE_LAYERS, mesh.layers),
        align_to_mm=mesh.nodes_mm[mesh.surface[:1]],
        crown=_crown(shape),
        weighting="volume_fraction",
        floor=d["mesh.least_fill"],
    )[0]


def _crown(shape: GelShape) -> Paraboloid | None:
    return Paraboloid(shape.crown_mm, shape.rim_mm) if shape.crown_mm > 0 else None


def marker_print(d: Dimensions, grid: MarkerGrid) -> tuple[NearestNodes, Outline]:
    """What the marker files need beside the grid: nearest surface node per dot, gel outline."""
    mesh, _ = pad_mesh(d, grid)
    nodes = nearest_nodes(grid.positions_mm, mesh.nodes_mm[mesh.surface], mesh.surface)
    return nodes, print_outline(d)


def print_outline(d: Lookup) -> Outline:
    """The gel's outline on the marker print."""
    gel = pad_outline(d)
    return Outline.rounded_rectangle(gel.length_mm, gel.width_mm, gel.corner_radius_mm)


def make_bundle(
    spec: Spec,
    d: Dimensions,
    mesh: PadMesh,
    grid: MarkerGrid,
    *,
    with_stiffness: bool = False,
    with_light: bool = True,
    ladder: OperatorLadder | None = None,
    operator: str = "",
) -> Bundle:
    """Make the bundle of a sensor: all that force pipeline and twin need of it.

    Args:
        spec: The finger.
        d: Its dimensions.
        mesh: The pad's mesh.
        grid: The marker grid.
        with_stiffness: Store the stiffness matrix itself; its recipe is stored in any case.
        with_light: Trace the light of the guide, which only pictures need.
        ladder: Error and time of the force operators.
        operator: Label of the operator that the force pipeline starts with.

    Returns:
        The bundle.
    """
    light = light_arrays(pad_light(d)) if with_light else {}
    return build_bundle(
        mesh,
        gel_material(spec),
        spec.mesh.element,
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=camera_record(d),
        spec_hash=spec_hash(spec),
        with_stiffness=with_stiffness,
        ladder=ladder,
        operator=operator,
        outline=pad_outline(d),
        tolerances=tolerances(spec),
        light=light,
        skin=gel_skin(spec),
    )


def marker_inputs(d: Lookup) -> dict[str, Any]:
    """Values of MARKER_NAMES."""
    return {name: d[name] for name in MARKER_NAMES}


def ladder_inputs(d: Lookup) -> dict[str, Any]:
    """Values of LADDER_NAMES."""
    return {name: d[name] for name in LADDER_NAMES}


def measured_ladder(
    d: Lookup,
    mesh: PadMesh,
    *,
    timed: bool = True,
    dense: bool = False,
    progress: Progress | None = None,
) -> OperatorLadder:
    """Measure the force operators of a pad.

    Args:
        d: Dimensions of the finger, or `ladder_inputs` of them.
        mesh: The pad's mesh.
        timed: Measure times on this machine too; without them the ladder is the same everywhere.
        dense: Measure the dense operator too, which takes up to a minute.
        progress: Called as the work goes on.

    Returns:
        Error, counted work and time of each operator.
    """
    material = Material(
        d["material.gel.youngs_modulus_mpa"],
        d["material.gel.poissons_ratio"],
        d["material.gel.density_kg_m3"],
    )
    return measure_ladder(
        mesh,
        material,
        cast(Formulation, d["mesh.element"]),
        dense=dense,
        progress=progress,
        reference=reference_mesh(d, mesh),
        timed=timed,
    )


def pad_light(d: Dimensions) -> LightMap:
    """Trace the light of the guide on the untouched gel.

    Args:
        d: The dimensions of the finger.

    Returns:
        Irradiance and direction of the light of each strip over the pad.
    """
    from gelslim_optics.light.trace import trace_light

    scene = light_scene(d, guide_profile(d))
    traced = trace_light(scene, RAYS, seed=0)
    seen, colour = camera_responses(d)
    flux = [w * source.power for w, source in zip(seen, scene.sources, strict=True)]
    bins = [f * traced.irradiance(c) for f, c in zip(flux, traced.colours, strict=True)]
    axes = SLOPE_AXES[: len(scene.sources)]
    steep = [traced.slope_sensitivity(c, a) for c, a in zip(traced.colours, axes, strict=True)]
    return LightMap.from_bins(
        np.stack(bins),
        float(d["design.gel.length_mm"]),
        float(d["design.gel.width_mm"]),
        azimuth_deg=np.array(AZIMUTHS_DEG[: len(axes)]),
        elevation_deg=np.array([_elevation_deg(found) for found in steep]),
        colour=colour,
        smooth_mm=SMOOTHING_MM,
        fans=traced.fans,
    )


def _elevation_deg(sensitivity: Estimate) -> float:
    """Elevation of a beam that a slope shades as it does the traced light: cot e per unit slope."""
    return math.degrees(math.atan2(1.0, abs(sensitivity.value)))
