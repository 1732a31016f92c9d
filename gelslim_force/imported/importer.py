"""From a description and a picture of a sensor to its bundle and its calibration."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.fine_dots import fine_centres_px
from gelslim_force.calibration.reference_picture import read_reference
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.dot_tracking import DotsAtRest, dots_at_rest
from gelslim_force.frames.read_only import read_only
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.error import ImportSensorError
from gelslim_force.imported.first_view import first_view
from gelslim_force.imported.fitted_view import FittedView, fitted_view
from gelslim_force.imported.knowledge import knowledge
from gelslim_force.imported.marker_lattice import grid_of
from gelslim_force.imported.pad import gel_outline, sensor_bundle
from gelslim_force.lattice.growth import LatticeError
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import Progress
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]
_LEAST_MARKERS = 20
_MOST_OUTSIDE = 0.5
"""Largest part of the dots that may lie outside the gel."""


@dataclass(frozen=True, eq=False)
class ImportedSensor:
    """An imported sensor.

    Attributes:
        description: What was stated of it.
        bundle: Its bundle, which says in `imported` what is known.
        calibration: Its camera and markers in the reference picture.
    """

    description: SensorDescription
    bundle: Bundle
    calibration: Calibration


@single_threaded
def import_sensor(
    asked: SensorDescription,
    folder: Path,
    defaulted: Set[str] = frozenset(),
    *,
    ladder: bool = True,
    progress: Progress | None = None,
) -> ImportedSensor:
    """Make bundle and calibration of a marker sensor that was not generated here.

    Args:
        asked: The description.
        folder: Folder to which its paths are relative.
        defaulted: Dotted paths of the fields that nobody gave.
        ladder: Measure error and time of the force operators, which takes some seconds.
        progress: Called as the ladder is measured.

    Returns:
        The sensor.

    Raises:
        ImportSensorError: The picture does not fit the description.
        CalibrationError: The reference picture cannot be read.
        InputError: The intrinsics cannot be read.
        IfemError: The pad cannot be meshed.
    """
    picture = read_reference(folder / asked.view.reference)
    rest = _dots(picture, asked)
    high, wide = picture.shape[:2]
    first = first_view(asked, folder, rest.reference, (wide, high))
    centres = fine_centres_px(picture, rest.dots, rest.settings)
    view = fitted_view(asked, first, rest.dots, centres)
    inside = _inside(asked, view)
    grid, order = grid_of(view.sites[inside], view.frame, view.shape, view.diameter_mm)
    chosen = inside[order]
    told = knowledge(
        asked, defaulted, rest, view, first.origin, grid, len(view.number) - len(inside)
    )
    bundle = sensor_bundle(asked, grid, view.camera, told, ladder=ladder, progress=progress)
    _require_seen(bundle, view)
    calibration = Calibration(
        camera=view.camera,
        grid=grid,
        markers=np.arange(len(grid)),
        dots=rest.dots.take(view.number[chosen]),
        residual_px=view.fit.residual_px[chosen],
        rest_mm=view.rest_mm[chosen],
        detector=rest.settings,
        geometry_hash=bundle.geometry_hash,
        deviation=view.deviation(),
        diagnosis=told.measured,
        warnings=tuple(line.removesuffix(".") for line in told.missing),
        picture=read_only(picture.copy()),
    )
    return ImportedSensor(asked, bundle, calibration)


def _dots(picture: NDArray[np.uint8], asked: SensorDescription) -> DotsAtRest:
    sizes = asked.markers.diameters_px
    settings = None if sizes is None else DetectorSettings.for_diameters(np.array(sizes), "double")
    try:
        return dots_at_rest(picture, settings)
    except (LatticeError, ValueError) as error:
        raise ImportSensorError("view.reference", f"{asked.view.reference}: {error}") from error


def _require_seen(bundle: Bundle, view: FittedView) -> None:
    """Refuse a camera that shows a part of the gel nowhere."""
    try:
        view.camera.project(bundle.mesh.surface_mm)
    except ValueError as error:
        raise ImportSensorError(
            "lens",
            f"the distortion that the dots show cannot be continued to the edge of the gel "
            f"({error}): check the size of the gel and the pitch, or give lens.intrinsics",
        ) from error


def _inside(asked: SensorDescription, view: FittedView) -> NDArray[np.int64]:
    """Dots on the gel, as indices into those of the view."""
    outline = gel_outline(asked.gel)
    inside = np.flatnonzero(outline.contains(*view.places_mm.T))
    gel, total = asked.gel, len(view.number)
    if len(inside) < _LEAST_MARKERS or len(inside) < (1 - _MOST_OUTSIDE) * total:
        span = np.ptp(view.places_mm, axis=0)
        raise ImportSensorError(
            "gel",
            f"{total - len(inside)} of {total} dots lie outside a gel of {gel.length_mm:g} x "
            f"{gel.width_mm:g} mm: they span {span[0]:.1f} x {span[1]:.1f} mm; check the size of "
            "the gel, markers.pitch_mm or view.points, and where x points",
        )
    return inside
