"""The values of a virtual camera from the record that a bundle holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.refraction import Layer

MODEL = "folded pinhole at its image distance, behind flat layers"
MODEL_AT_INFINITY = "folded pinhole behind flat layers"
"""Of earlier bundles, whose scale is that of a lens focused on infinity."""
VECTORS = ("position_mm", "right", "down", "forward")
LENGTHS = ("focal_px", "window_bottom_z_mm")
COUNTS = ("image_width_px", "image_height_px")


def camera_from_record(record: Mapping[str, object]) -> dict[str, Any]:
    """The arguments of the `VirtualCamera` that `record` describes.

    Raises ValueError for another model, or for values that are missing or of the wrong type.
    """
    if record.get("model") == MODEL_AT_INFINITY:
        raise ValueError(
            "the camera record is of an earlier version, which took the lens to be focused on "
            "infinity; its scale is wrong by about a tenth. Make the bundle and the calibration "
            "again: gelslim bundle SPEC, gelslim calibrate BUNDLE REFERENCE"
        )
    if record.get("model") != MODEL:
        raise ValueError(
            f'the camera record has the model {record.get("model")!r}, must be "{MODEL}"'
        )
    values: dict[str, Any] = {name: _vector(record, name) for name in VECTORS}
    values |= {name: _number(record, name) for name in LENGTHS}
    for name in COUNTS:
        count = _number(record, name)
        if count != int(count):
            raise ValueError(f"the camera record's {name} = {count:g} is not a whole number")
        values[name] = int(count)
    layers = _entry(record, "layers")
    if not isinstance(layers, list | tuple) or not all(isinstance(v, Mapping) for v in layers):
        raise ValueError("the camera record's layers must be a list of thickness_mm and index")
    values["layers"] = tuple(Layer(_number(v, "thickness_mm"), _number(v, "index")) for v in layers)
    lens = record.get("lens_distortion")
    if lens is not None:
        if not isinstance(lens, Mapping):
            raise ValueError("the camera record's lens_distortion must give coefficients by name")
        values["lens"] = LensDistortion.from_record(lens)
    if "principal_offset_px" in record:
        values["principal_offset_px"] = tuple(_vector(record, "principal_offset_px", 2))
    return values


def _entry(record: Mapping[str, object], name: str) -> object:
    if name not in record:
        raise ValueError(f"the camera record has no {name}")
    return record[name]


def _number(record: Mapping[str, object], name: str) -> float:
    value = _entry(record, name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ValueError(f"the camera record's {name} = {value!r} must be a finite number")
    return float(value)


def _vector(record: Mapping[str, object], name: str, count: int = 3) -> list[float]:
    value = _entry(record, name)
    if not isinstance(value, list | tuple) or len(value) != count:
        raise ValueError(f"the camera record's {name} = {value!r} must be {count} numbers")
    return [_number({name: v}, name) for v in value]


def is_mono(record: Mapping[str, object]) -> bool:
    """Whether the camera of a record sees brightness alone; colours where it says nothing."""
    return record.get("picture") == "mono"
