"""From camera frames of a marker sensor to forces on its gel.

`open_sensor` makes a calibrated `ForcePipeline` from a bundle and a picture without contact; its
method `process` takes one frame after the other and returns a `FrameResult` with the wrench and
the force field. The names below are the public face of this package; they load when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim_force.calibration.calibration import calibrate
    from gelslim_force.calibration.error import CalibrationError
    from gelslim_force.calibration.file import read_calibration, write_calibration
    from gelslim_force.calibration.intrinsics import Intrinsics, read_intrinsics
    from gelslim_force.calibration.reference_picture import read_reference
    from gelslim_force.calibration.sensor_calibration import Calibration
    from gelslim_force.contact.depth_map_source import DepthMapSource, read_depth_maps
    from gelslim_force.contact.normal_source import NormalReading, NormalSource
    from gelslim_force.forces.contact_patches import PatchForce, contact_patches
    from gelslim_force.forces.estimator import ForceSettings
    from gelslim_force.forces.frame_result import ForceField, FrameResult
    from gelslim_force.forces.wrench import Wrench
    from gelslim_force.frames.frame import Frame
    from gelslim_force.frames.source import open_frames
    from gelslim_force.joint.light.calibration import (
        LightCalibration,
        read_light_calibration,
        write_light_calibration,
    )
    from gelslim_force.outputs.overlay import Overlay
    from gelslim_force.outputs.recorded_run import read_run
    from gelslim_force.outputs.run_recorder import RunRecorder
    from gelslim_force.outputs.sinks import PictureSink, RecorderSink
    from gelslim_force.pipeline import ForcePipeline
    from gelslim_force.presses.calibrate_gel import calibrate_gel
    from gelslim_force.presses.calibrate_light import calibrate_light
    from gelslim_force.presses.gel_calibration import (
        GelCalibration,
        read_gel_calibration,
        write_gel_calibration,
    )
    from gelslim_force.presses.load_table import Load, read_loads
    from gelslim_force.presses.press_error import PressError
    from gelslim_force.run import run_frames
    from gelslim_force.sensor import indenter_source, open_sensor
    from gelslim_force.settings import PipelineSettings
    from gelslim_force.tracking.drift_filter import DriftSettings, TareError, TareRecord

__all__ = [
    "Calibration",
    "CalibrationError",
    "DepthMapSource",
    "DriftSettings",
    "ForceField",
    "ForcePipeline",
    "ForceSettings",
    "Frame",
    "FrameResult",
    "GelCalibration",
    "Intrinsics",
    "LightCalibration",
    "Load",
    "NormalReading",
    "NormalSource",
    "Overlay",
    "PatchForce",
    "PictureSink",
    "PipelineSettings",
    "PressError",
    "RecorderSink",
    "RunRecorder",
    "TareError",
    "TareRecord",
    "Wrench",
    "calibrate",
    "calibrate_gel",
    "calibrate_light",
    "contact_patches",
    "indenter_source",
    "open_frames",
    "open_sensor",
    "read_calibration",
    "read_depth_maps",
    "read_gel_calibration",
    "read_intrinsics",
    "read_light_calibration",
    "read_loads",
    "read_reference",
    "read_run",
    "run_frames",
    "write_calibration",
    "write_gel_calibration",
    "write_light_calibration",
]

__getattr__, __dir__ = lazy_exports(__name__)
