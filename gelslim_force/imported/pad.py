"""The pad of an imported sensor: its mesh at a cell size that fits, and its bundle."""

from __future__ import annotations

import hashlib
import json
import math

from gelslim_force.imported.description import Gel, SensorDescription
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.bundle.imported import Imported
from ifem_export.elements.material import Material
from ifem_export.markers.grid import MarkerGrid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.ladder import Progress, measure_ladder

LAYERS = 4
MOST_NODES = 2600
"""Surface nodes of the mesh: forces of an object of unknown shape stay quick."""
_CELLS_PER_PITCH = 2
_CELLS_PER_THICKNESS = 3.0
"""Cells along a length of one thickness, over which the surface bends."""
_SCALE_POWER = 3
"""Power of the scale of the picture in the force of a wide contact: displacement times area."""


def gel_outline(gel: Gel) -> RoundedRectangle:
    """The gel seen from above."""
    return RoundedRectangle(gel.length_mm, gel.width_mm, gel.corner_radius_mm)


def cell_size_mm(gel: Gel, pitches_mm: tuple[float, float]) -> tuple[float, float]:
    """Size of the cells along x and y, whole parts of the distances of the dots.

    Two cells for each dot, or more where the gel is thin; fewer where there would be too many.
    """
    wanted = min(min(pitches_mm) / _CELLS_PER_PITCH, gel.thickness_mm / _CELLS_PER_THICKNESS)
    least = math.sqrt(gel.length_mm * gel.width_mm / MOST_NODES)
    x, y = (_part(pitch, wanted, least) for pitch in pitches_mm)
    return x, y


def _part(pitch_mm: float, wanted_mm: float, least_mm: float) -> float:
    """The largest whole part of a pitch up to a length, but none below the least length."""
    if pitch_mm < least_mm:
        return least_mm
    cells = math.ceil(pitch_mm / wanted_mm - 1e-9)
    return pitch_mm / min(cells, math.floor(pitch_mm / least_mm))


def pad_mesh(gel: Gel, grid: MarkerGrid) -> PadMesh:
    """Mesh the pad; nodes meet the dots of a lattice along the axes."""
    frame = grid.frame
    pitches = (grid.pitch_mm, grid.pitch_mm) if frame is None else frame.pitches_mm
    return build_pad_mesh(
        gel_outline(gel),
        gel.thickness_mm,
        pitch_mm=cell_size_mm(gel, pitches),
        layers=LAYERS,
        align_to_mm=grid.positions_mm,
    )[0]


def tolerances(asked: SensorDescription) -> dict[str, float]:
    """Standard deviations of the gel by name of the bundle.

    An error of the picture's scale makes places, displacements and contact areas wrong alike. It
    counts as one of Young's modulus, which changes all forces in one proportion too.
    """
    gel = asked.gel
    by_scale = _SCALE_POWER * asked.view.scale_tolerance_ratio
    share = math.hypot(gel.youngs_modulus_tolerance_ratio, by_scale)
    return {
        "youngs_modulus_mpa": share * gel.youngs_modulus_mpa,
        "poissons_ratio": gel.poissons_ratio_tolerance,
        "thickness_mm": gel.thickness_tolerance_mm,
    }


def sensor_bundle(
    asked: SensorDescription,
    grid: MarkerGrid,
    camera: VirtualCamera,
    imported: Imported,
    *,
    ladder: bool = True,
    progress: Progress | None = None,
) -> Bundle:
    """Make the bundle.

    Args:
        asked: The description.
        grid: The dots on the gel.
        camera: The fitted camera.
        imported: What is known, and from where.
        ladder: Measure error and work of the force operators.
        progress: Called as the ladder is measured.

    Returns:
        The bundle, without light.

    Raises:
        IfemError: The pad cannot be meshed, or the dots do not determine a field.
    """
    gel = asked.gel
    mesh = pad_mesh(gel, grid)
    material = Material(gel.youngs_modulus_mpa, gel.poissons_ratio, gel.density_kg_m3)
    rungs = None
    if ladder:
        rungs = measure_ladder(mesh, material, "bbar", progress=progress)
    return build_bundle(
        mesh,
        material,
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=camera.to_record(),
        spec_hash=description_hash(asked),
        with_stiffness=False,
        ladder=rungs,
        operator="" if rungs is None else rungs.balanced().label,
        outline=gel_outline(gel),
        tolerances=tolerances(asked),
        imported=imported,
    )


def description_hash(asked: SensorDescription) -> str:
    """SHA-256 of a description's content; comments, order and spelt-out defaults do not count."""
    content = json.dumps(asked.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(content.encode()).hexdigest()
