"""From a bundle and one picture at rest to a force pipeline that is ready for frames."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_force.built_sensor import BuiltGel, built_gel, built_light
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.file import read_calibration
from gelslim_force.calibration.reference_picture import read_reference
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.indenter import Indenter, parse_indenter
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_force.contact.reflections import colours_oppose
from gelslim_force.frames.upright import upright
from gelslim_force.joint.checked_indenter import CheckedIndenter
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.sensor_source import layer_stiffness_n_mm, unknown_shape
from gelslim_force.joint.settings import ON_NODES, WITNESS, JointSettings
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.presses.gel_calibration import GelCalibration
from gelslim_force.settings import PipelineSettings
from gelslim_optics.camera.record import is_mono
from gelslim_optics.light.light_map import LightMap
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.files import load_bundle

if TYPE_CHECKING:
    from gelslim_force.contact.normal_source import NormalSource

Picture = NDArray[np.uint8]
FileName = str | os.PathLike[str]
UNKNOWN = "unknown"
"""Argument for an indenter whose shape is not known."""
NO_INDENTER = "none"
"""Argument for tangential forces alone."""
_MOST_NODES = 5000
"""Surface nodes up to which an unknown shape is looked for unasked: with more, preparing the sensor
takes minutes and gigabytes."""


class SensorError(GelslimError, ValueError):
    """A sensor that cannot be opened with these arguments.

    Attributes:
        argument: Name of the argument that is missing or cannot be used.
    """

    def __init__(self, argument: str, message: str) -> None:
        super().__init__(message)
        self.argument = argument


def open_sensor(
    bundle: Bundle | FileName,
    *,
    reference: Picture | FileName | None = None,
    calibration: Calibration | FileName | None = None,
    indenter: Indenter | str | None = None,
    depth_mm: float | None = None,
    normal: NormalSource | None = None,
    settings: PipelineSettings | None = None,
    gel_calibration: GelCalibration | FileName | None = None,
    light_calibration: LightCalibration | FileName | None = None,
) -> ForcePipeline:
    """Open a sensor: a force pipeline that is calibrated and ready for frames.

    Args:
        bundle: The sensor's bundle, or its folder.
        reference: Picture without contact, (h, w) or (h, w, 3) uint8, or its file, or a folder of
            several; the sensor is calibrated by it, unless a calibration is given.
        calibration: A calibration of this sensor, or its file. Contacts show in comparison with
            the reference; without one, with the picture that the calibration keeps.
        indenter: By default forces are those of an object of unknown shape, found from light and
            markers, where the camera has colour and the bundle light, and from the markers alone
            where the pictures are grey; otherwise the normal force is unknown. `"unknown"` insists
            on the former and `"none"` on the latter. A known shape, such as `"sphere:10"` (mm), is
            found by the rim of its contact alone, faster and without traced light.
        depth_mm: Known depth of the indenter in mm, which a flat punch needs.
        normal: Another source of the normal motion, in place of an indenter.
        settings: Choices of the pipeline; the defaults if None.
        gel_calibration: The gel as built, or its file of `gelslim calibrate-gel`. Its values take
            the place of the design's, and its covariance enters that of the wrench.
        light_calibration: The light as built, or its file of `gelslim calibrate-light`, for an
            indenter of unknown shape.

    Returns:
        The pipeline; `process` takes one frame after the other.

    Raises:
        SensorError: Arguments are missing, or contradict one another, or an indenter of known shape
            is to be found in the pictures of a mono camera.
        IfemError: The bundle cannot be read, or no operator keeps the budget.
        CalibrationError: The reference does not show this sensor at rest, or the calibration
            cannot be read or belongs to another sensor.
        IndenterError: The indenter's description cannot be read.
        PressError: The calibration of the gel cannot be read or belongs to another sensor.
    """
    _require_consistent(reference, calibration, indenter, depth_mm, normal)
    if light_calibration is not None and (indenter not in (None, UNKNOWN) or normal is not None):
        raise SensorError(
            "light_calibration",
            "a calibration of the light serves objects of unknown shape: leave the indenter out",
        )
    sensor = bundle if isinstance(bundle, Bundle) else load_bundle(Path(bundle))
    if indenter not in (None, NO_INDENTER, UNKNOWN):
        require_colour(sensor)
        indenter = _shape(indenter)
    picture = reference
    if picture is not None and not isinstance(picture, np.ndarray):
        picture = read_reference(picture)
    if calibration is None:
        assert picture is not None
        calibration = calibrate(sensor, picture)
    elif not isinstance(calibration, Calibration):
        calibration = read_calibration(calibration)
    gel = built_gel(sensor, calibration, gel_calibration, settings)
    light = built_light(sensor, light_calibration)
    if normal is None:
        normal = normal_source(gel, picture, indenter, depth_mm, settings, light)
    return ForcePipeline(gel.bundle, gel.calibration, settings, normal, gel.share)


def normal_source(
    sensor: BuiltGel,
    reference: Picture | None = None,
    indenter: Indenter | str | None = None,
    depth_mm: float | None = None,
    settings: PipelineSettings | None = None,
    light: LightCalibration | None = None,
) -> NormalSource | None:
    """Make the normal source for what is known of the object.

    Args:
        sensor: The sensor with its gel.
        reference: Picture without contact; None for the one that the calibration keeps.
        indenter: As in `open_sensor`.
        depth_mm: Known depth in mm, which a flat punch needs.
        settings: Choices of the pipeline; the defaults if None.
        light: The light as built; None for the traced light.

    Returns:
        The source; None where the normal force stays unknown.

    Raises:
        SensorError: An indenter is given and there is no picture without contact, or its shape is
            known and the camera mono, or a light is given and the pictures are grey.
        CalibrationError: The calibration belongs to another bundle.
        IndenterError: The indenter's description cannot be read.
        ValueError: An indenter is given and the reference is dark or of another size.
    """
    bundle, calibration = sensor.bundle, sensor.calibration
    picture = calibration.picture if reference is None else reference
    grey = _is_grey(bundle, picture)
    # Nobody can trace the light of an imported sensor.
    alone = grey or (bundle.imported is not None and not bundle.light)
    if indenter == NO_INDENTER or (indenter is None and not _shows_shapes(bundle, picture, alone)):
        return None
    if alone and indenter in (None, UNKNOWN):
        if light is not None:
            raise SensorError(
                "light_calibration",
                "the pictures of this sensor are grey or its light is not traced, and the markers "
                "alone are used: leave the calibration of the light out",
            )
        return unknown_source(bundle, calibration, None, settings, more=sensor.more)
    if picture is None:
        raise SensorError(
            "reference",
            "contacts show in comparison with a picture without contact, and this calibration "
            "keeps none: give the reference picture too, or calibrate again",
        )
    if indenter is None or indenter == UNKNOWN:
        return unknown_source(bundle, calibration, picture, settings, light, sensor.more)
    named = indenter_source(bundle, calibration, picture, indenter, depth_mm, settings)
    named = sensor.varied(named, settings)
    chosen = settings or PipelineSettings()
    if grey or not (chosen.check_indenter and _shows_shapes(bundle, picture, grey)):
        return named
    # The model of a named contact, with whose force it is compared, is linear.
    seen = replace(WITNESS, gamma=chosen.gamma)
    witness = unknown_shape(bundle, calibration, picture, gel="linear", settings=seen)
    return CheckedIndenter(named, witness)


def _is_grey(bundle: Bundle, picture: Picture | None) -> bool:
    """Whether the pictures of a sensor show brightness alone, be it in three equal channels."""
    if is_mono(bundle.camera) or picture is None:
        return is_mono(bundle.camera)
    return picture.ndim == 2 or bool((picture == picture[..., :1]).all())


def _shows_shapes(bundle: Bundle, picture: Picture | None, alone: bool) -> bool:
    """Whether forces of objects of unknown shape can be found, be it by the markers `alone`."""
    small = len(bundle.mesh.surface) <= _MOST_NODES
    return small and (alone or (picture is not None and bool(bundle.light)))


def indenter_source(
    bundle: Bundle,
    calibration: Calibration,
    reference: Picture,
    indenter: Indenter | str,
    depth_mm: float | None = None,
    settings: PipelineSettings | None = None,
) -> IndenterSource:
    """Make a normal source for a known indenter.

    Args:
        bundle: The sensor.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact.
        indenter: The shape that touches the gel, or its description, such as `"sphere:10"` (mm).
        depth_mm: Known depth in mm, which a flat punch needs.
        settings: Choose the operator of the contact model; the defaults if None.

    Returns:
        The source, for the constructor of `ForcePipeline`.

    Raises:
        SensorError: The sensor's camera is mono.
        CalibrationError: The calibration belongs to another bundle.
        IndenterError: The indenter's description cannot be read.
        ValueError: The reference cannot show a patch, because it is dark or of another size.
    """
    require_colour(bundle)
    calibration.require_bundle(bundle)
    shape = _shape(indenter)
    points_mm = np.asarray(bundle.mesh.surface_mm)
    followed = calibration.reference
    radius_px = 2 * np.sqrt(np.abs(calibration.dots.moments_px2).max(axis=1))
    finder = PatchFinder(
        calibration.camera,
        upright(reference, calibration.camera),
        followed.positions_px,
        marker_radius_px=radius_px[np.searchsorted(calibration.markers, followed.markers)],
        surface_mm=points_mm,
        indenter=shape,
        opposed=bool(bundle.light) and colours_oppose(LightMap.from_arrays(bundle.light)),
    )
    chosen = settings or PipelineSettings()
    model = chosen.contact(bundle, shape)
    unseen = JointSettings()
    hidden_n = unseen.unseen_force * bundle.material.youngs_modulus_mpa
    hidden_mm = hidden_n / layer_stiffness_n_mm(bundle)
    share = unseen.unseen_by_markers / unseen.unseen_force
    given = finder, model, shape, depth_mm
    return IndenterSource(*given, hidden_n=hidden_n, hidden_mm=hidden_mm, under_reflection=share)


def unknown_source(
    bundle: Bundle,
    calibration: Calibration,
    reference: Picture | None,
    settings: PipelineSettings | None = None,
    light: LightCalibration | None = None,
    more: Sequence[tuple[Bundle, float]] = (),
) -> UnknownShape:
    """Make a normal source for objects of unknown shape, from light and markers.

    Args:
        bundle: The sensor.
        calibration: Its camera, and its markers at rest.
        reference: (h, w, 3) uint8 picture without contact; None for forces from the markers alone.
        settings: Choose the law of the gel and the pressure; the defaults if None.
        light: The light as built; None takes it as traced.
        more: As of `unknown_shape`.

    Returns:
        The source, for the constructor of `ForcePipeline`.

    Raises:
        SensorError: A reference is given, and the camera is mono or the bundle has no light.
        CalibrationError: The calibration belongs to another bundle.
        MeshError: The pad has too many surface nodes.
        ValueError: The reference is dark or of another size.
    """
    if reference is not None:
        require_colour(bundle)
    if reference is not None and not bundle.light:
        raise SensorError(
            "indenter",
            "the bundle has no light, by which the contact of an unknown shape is seen: make it "
            "with `gelslim build` or `gelslim bundle`",
        )
    calibration.require_bundle(bundle)
    chosen = settings or PipelineSettings()
    by_light = replace(JointSettings() if chosen.finer_pressure else ON_NODES, gamma=chosen.gamma)
    return unknown_shape(
        bundle,
        calibration,
        reference,
        gel=chosen.gel,
        settings=None if reference is None else by_light,
        light=light,
        more=more,
    )


def require_colour(bundle: Bundle) -> None:
    """Raise SensorError for a mono camera, in whose pictures no contact patch is found.

    The lights of the two strips change by opposite amounts where the gel is tilted. In one
    brightness they cancel, so that a patch shows by the change of red against green alone.
    """
    if is_mono(bundle.camera):
        raise SensorError(
            "indenter",
            "the camera of this sensor is mono, and an indenter is found by the change of red "
            "against green: leave the indenter out for tangential forces, or give the normal "
            "motion by depth maps or another source",
        )


def _shape(indenter: Indenter | str) -> Indenter:
    return parse_indenter(indenter) if isinstance(indenter, str) else indenter


def _require_consistent(
    reference: object,
    calibration: object,
    indenter: object,
    depth_mm: float | None,
    normal: object,
) -> None:
    if indenter is not None and normal is not None:
        raise SensorError("normal", "give an indenter or another normal source, not both")
    if depth_mm is not None and indenter in (None, UNKNOWN, NO_INDENTER):
        raise SensorError(
            "depth_mm", "depth_mm is the depth of an indenter of known shape: give its shape too"
        )
    if reference is None and calibration is None:
        raise SensorError(
            "reference",
            "give a reference picture without contact, or a calibration of this sensor",
        )
