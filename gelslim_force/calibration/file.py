"""Calibrations as JSON, format `gelslim-calibration/1`; lengths in mm and px as named."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.json_record import RecordFile
from gelslim_force.calibration.built_deviation import BuiltDeviation
from gelslim_force.calibration.camera_deviation import PARAMETERS
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.calibration.stored_picture import picture_of, picture_record
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import MarkerGrid
from ifem_export.markers.lattice_frame import LatticeFrame

FORMAT = "gelslim-calibration/1"
_MAKE = "make it with `gelslim calibrate BUNDLE REFERENCE -o FILE`"
_GRID = ("positions_mm", "row", "column", "diameter_mm", "kind", "pitch_mm", "lattice_shape",
         "omitted")  # fmt: skip
_DOTS = ("centres_px", "area_px", "contrast", "moments_px2", "flags")
_ARRAYS = ("values", "sigma", "tolerance")


def calibration_record(calibration: Calibration) -> dict[str, Any]:
    """Return the calibration as numbers, strings, lists and dicts."""
    c = calibration
    return {
        "format": FORMAT,
        "geometry_hash": c.geometry_hash,
        "camera": c.camera.to_record(),
        "deviation": None if c.deviation is None else _deviation_record(c.deviation),
        "diagnosis": list(c.diagnosis),
        "warnings": list(c.warnings),
        "detector": dataclasses.asdict(c.detector),
        "grid": _grid_record(c.grid),
        "markers": c.markers.tolist(),
        "dots": {name: _plain(getattr(c.dots, name)) for name in _DOTS},
        "residual_px": c.residual_px.tolist(),
        "rest_mm": c.rest_mm.tolist(),
        "picture": None if c.picture is None else picture_record(c.picture),
    }


def calibration_of(record: Mapping[str, Any]) -> Calibration:
    """Return the calibration of a record.

    Raises ValueError, KeyError or TypeError for a record of another kind. `read_calibration` turns
    these into errors that name the file, and refuses another format.
    """
    deviation, picture = record["deviation"], record.get("picture")
    grid, dots = record["grid"], record["dots"]
    return Calibration(
        camera=VirtualCamera.from_record(record["camera"]),
        grid=MarkerGrid(
            positions_mm=_floats(grid["positions_mm"]),
            row=_integers(grid["row"]),
            column=_integers(grid["column"]),
            diameter_mm=_floats(grid["diameter_mm"]),
            kind=_integers(grid["kind"]),
            pitch_mm=float(grid["pitch_mm"]),
            lattice_shape=(int(grid["lattice_shape"][0]), int(grid["lattice_shape"][1])),
            omitted=_integers(grid["omitted"]).reshape(-1, 2),
            frame=None if grid.get("frame") is None else LatticeFrame.from_record(grid["frame"]),
        ),
        markers=_integers(record["markers"]),
        dots=Detections(
            centres_px=_finite(dots["centres_px"], "centres_px"),
            area_px=_finite(dots["area_px"], "area_px"),
            contrast=_finite(dots["contrast"], "contrast"),
            moments_px2=_finite(dots["moments_px2"], "moments_px2"),
            flags=_integers(dots["flags"]),
        ),
        residual_px=_floats(record["residual_px"]),
        rest_mm=_floats(record["rest_mm"]),
        detector=DetectorSettings(**record["detector"]),
        geometry_hash=str(record["geometry_hash"]),
        deviation=None if deviation is None else _deviation_of(deviation),
        diagnosis=tuple(str(line) for line in record["diagnosis"]),
        warnings=tuple(str(line) for line in record["warnings"]),
        picture=None if picture is None else picture_of(picture),
    )


def write_calibration(calibration: Calibration, path: str | os.PathLike[str]) -> None:
    """Write a calibration to a file.

    The file is replaced as a whole: if writing fails, an earlier file is kept.

    Args:
        calibration: What to write.
        path: File to write; its folder must exist.

    Raises:
        OSError: The file cannot be written.
    """
    _FILE.write(calibration, path)


def read_calibration(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration from a file.

    Args:
        path: File written by `write_calibration`, or by `gelslim calibrate`.

    Returns:
        The calibration.

    Raises:
        CalibrationError: There is no such file, or it is damaged.
    """
    return _FILE.read(path)


def _grid_record(grid: MarkerGrid) -> dict[str, Any]:
    """The lattice; `frame` is left out where it is square and centred."""
    record = {name: _plain(getattr(grid, name)) for name in _GRID}
    return record if grid.frame is None else {**record, "frame": grid.frame.to_record()}


def _deviation_record(deviation: BuiltDeviation) -> dict[str, Any]:
    record: dict[str, Any] = {}
    for field in dataclasses.fields(deviation):
        value = getattr(deviation, field.name)
        if field.name in _ARRAYS:
            value = dict(zip(PARAMETERS, value.tolist(), strict=True))
        elif field.name == "weak":
            value = [
                {
                    "prior_variance_left": left,
                    "direction": dict(zip(PARAMETERS, along.tolist(), strict=True)),
                }
                for left, along in value
            ]
        record[field.name] = value
    return record


def _deviation_of(record: Mapping[str, Any]) -> BuiltDeviation:
    values: dict[str, Any] = {}
    for field in dataclasses.fields(BuiltDeviation):
        value = record[field.name]
        if field.name in _ARRAYS:
            values[field.name] = _by_parameter(value)
        elif field.name == "weak":
            values[field.name] = tuple(
                (float(w["prior_variance_left"]), _by_parameter(w["direction"])) for w in value
            )
        else:
            values[field.name] = float(value)
    return BuiltDeviation(**values)


def _by_parameter(value: Mapping[str, Any]) -> NDArray[np.float64]:
    return _floats([value[name] for name in PARAMETERS])


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _converter(kind: type) -> Callable[[Any], NDArray[Any]]:
    def converted(values: Any) -> NDArray[Any]:
        array = np.array(values)
        if array.size and array.dtype.kind not in "if":
            raise ValueError(f"a list holds {array.dtype}, not numbers")
        if kind is np.int64 and not np.array_equal(array, np.rint(array)):
            raise ValueError("a list of ids, indices or flags holds numbers that are not integers")
        return array.astype(kind)

    return converted


_floats, _integers = _converter(np.float64), _converter(np.int64)


def _finite(values: Any, name: str) -> NDArray[np.float64]:
    array: NDArray[np.float64] = _floats(values)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} holds a value that is not finite")
    return array


_FILE = RecordFile(
    FORMAT,
    "calibration",
    _MAKE,
    calibration_record,
    calibration_of,
    partial(CalibrationError, "file"),
)
