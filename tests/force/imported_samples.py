"""Descriptions of sensors that the tests draw, imported from their pictures alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.yaml.reader import Loaded, load_bytes
from gelslim_force.imported.description import SensorDescription
from gelslim_force.imported.importer import ImportedSensor, import_sensor
from ifem_export.markers.grid import MarkerGrid

BLOCKS: dict[str, Any] = {
    "format": "gelslim-sensor/1",
    "name": "drawn",
    "gel": {
        "length_mm": 22.0, "width_mm": 20.5, "thickness_mm": 2.0, "corner_radius_mm": 1.0,
        "youngs_modulus_mpa": 0.147, "youngs_modulus_tolerance_ratio": 0.0,
        "poissons_ratio": 0.3223, "poissons_ratio_tolerance": 0.0, "thickness_tolerance_mm": 0.0,
    },
    "markers": {"pitch_mm": 1.1},
    "view": {"reference": "reference.png", "x_points": "down", "mirrored": True},
}  # fmt: skip
"""Of the sensor of `sensor_samples`, whose gel is known and whose camera is not."""


def described(**changes: dict[str, Any] | list[Any]) -> Loaded[SensorDescription]:
    """The description with some fields of its blocks changed; None removes a field."""
    blocks = {name: dict(v) if isinstance(v, dict) else v for name, v in BLOCKS.items()}
    for name, fields in changes.items():
        if isinstance(fields, dict):
            block = {**blocks.get(name, {}), **fields}
            blocks[name] = {k: v for k, v in block.items() if v is not None}
        else:
            blocks[name] = fields
    return load_bytes("drawn.yaml", json.dumps(blocks).encode(), SensorDescription)


def imported(picture: NDArray[np.uint8], folder: Path, **changes: Any) -> ImportedSensor:
    """The sensor of a picture."""
    np.save(folder / "reference.npy", picture)
    view = {**changes.pop("view", {}), "reference": "reference.npy"}
    loaded = described(view=view, **changes)
    return import_sensor(loaded.model, folder, frozenset(loaded.defaulted), ladder=False)


def off_places_mm(made: ImportedSensor, centres_px: NDArray[np.float64], grid: MarkerGrid):
    """(n, 2) distances of the imported markers, as seen, from those of the true print.

    Dots are assigned by their true centres (m, 2) in the picture, which the import does not know.
    """
    apart, true = cKDTree(centres_px).query(made.calibration.reference_px)
    assert apart.max() < 3
    return made.calibration.rest_mm - grid.positions_mm[true]
