"""A sensor beside a simulation: its bundle, light and outline in a folder, for any worker."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import numpy as np

from gelslim_force.outputs.atomic_file import json_bytes, replace_file
from gelslim_twin.simulation.run_folder import SimulationError
from gelslim_twin.simulation.twin_sensor import TwinSensor
from ifem_export.bundle_io import load_bundle, write_bundle

BUNDLE, LIGHT, OUTLINE = "bundle", "light.npz", "sensor.json"
LIGHT_FIELDS = ("x_mm", "y_mm", "irradiance", "azimuth_deg", "elevation_deg", "colour")


def store_sensor(sensor: TwinSensor, folder: Path, with_light: bool) -> None:
    """Write what is not there yet; a bundle of another pad there is replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    held = folder / BUNDLE
    if not (held / "manifest.json").is_file() or _hash(held) != sensor.bundle.geometry_hash:
        shutil.rmtree(held, ignore_errors=True)
        write_bundle(held, sensor.bundle)
    length, width = sensor.size_mm
    outline = {"length_mm": length, "width_mm": width, "corner_radius_mm": sensor.corner_radius_mm}
    replace_file(folder / OUTLINE, json_bytes(outline))
    if with_light and not (folder / LIGHT).is_file():
        light = sensor.light()
        stream = io.BytesIO()
        np.savez(stream, **{name: getattr(light, name) for name in LIGHT_FIELDS})
        replace_file(folder / LIGHT, stream.getvalue())


def stored_sensor(folder: Path) -> TwinSensor:
    """The sensor that `store_sensor` wrote.

    Raises SimulationError where it is not whole, BundleError for a damaged bundle.
    """
    try:
        outline = json.loads((folder / OUTLINE).read_bytes())
    except (OSError, ValueError) as error:
        raise SimulationError(
            f"{folder}: the sensor stored there is not whole ({error})"
        ) from error

    def lit():  # type: ignore[no-untyped-def]
        from gelslim_twin.render.light_map import LightMap

        with np.load(folder / LIGHT, allow_pickle=False) as held:
            return LightMap(**{name: held[name] for name in LIGHT_FIELDS})

    return TwinSensor(
        load_bundle(folder / BUNDLE),
        lit if (folder / LIGHT).is_file() else None,
        outline["length_mm"],
        outline["width_mm"],
        outline["corner_radius_mm"],
    )


def _hash(folder: Path) -> str:
    try:
        return load_bundle(folder).geometry_hash
    except ValueError:
        return ""
