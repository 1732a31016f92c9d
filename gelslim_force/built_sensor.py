"""The gel and the light of a sensor as built, in the place of the designed ones."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.forces.finite_strain import law_of
from gelslim_force.joint.light.calibration import LightCalibration, read_light_calibration
from gelslim_force.presses.gel_calibration import (
    GelCalibration,
    read_gel_calibration,
    specified_gel,
)
from gelslim_force.presses.gel_share import GelShare, varied_bundles
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle

FileName = str | os.PathLike[str]


@dataclass(frozen=True, eq=False)
class BuiltGel:
    """A sensor with its gel as built, or as designed where that is not known.

    Attributes:
        bundle: The sensor.
        calibration: Its camera and markers, for this bundle.
        share: What gel and law add to the covariance; None for nothing.
        more: The same sensor with more of a parameter of its gel, and how much more.
    """

    bundle: Bundle
    calibration: Calibration
    share: GelShare | None = None
    more: tuple[tuple[Bundle, float], ...] = ()

    def varied(self, source: IndenterSource, settings: PipelineSettings | None) -> IndenterSource:
        """The source with the derivatives of its motion by the parameters of the gel."""
        chosen = settings or PipelineSettings()
        # The same operators as of the source itself: a difference of two kinds is no derivative.
        models = [(chosen.contact(b, source.indenter), step) for b, step in self.more]
        return replace(source, varied=tuple(models))


def built_gel(
    bundle: Bundle,
    calibration: Calibration,
    gel: GelCalibration | FileName | None,
    settings: PipelineSettings | None = None,
) -> BuiltGel:
    """Put a calibrated gel in the place of the designed one.

    Args:
        bundle: The sensor as designed.
        calibration: Its camera, and its markers at rest.
        gel: The gel as built, or its file; by default the gel is as specified, with the tolerances
            that the bundle holds.
        settings: Choose the operators; the defaults if None.

    Raises:
        PressError: The gel calibration cannot be read, or belongs to another sensor.
        CalibrationError: The calibration belongs to another bundle.
        IfemError: No operator keeps the budget.
    """
    law = law_of(bundle, (settings or PipelineSettings()).gel)
    made, moved = bundle, calibration
    if gel is None:
        found = specified_gel(bundle)
        if found is None:
            return BuiltGel(bundle, calibration, GelShare.of_law(bundle, law))
    else:
        found = gel if isinstance(gel, GelCalibration) else read_gel_calibration(gel)
        made, moved = found.applied(bundle, calibration)
    more = tuple((thicker, step) for _, thicker, step in varied_bundles(bundle, found))
    return BuiltGel(made, moved, GelShare.of(bundle, found, law), more)


def built_light(
    bundle: Bundle, light: LightCalibration | FileName | None
) -> LightCalibration | None:
    """The calibrated light of a sensor as designed; None stays None.

    Raises:
        CalibrationError: It cannot be read, or belongs to another sensor.
    """
    if light is None:
        return None
    found = light if isinstance(light, LightCalibration) else read_light_calibration(light)
    found.require_bundle(bundle)
    return found
