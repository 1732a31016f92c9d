"""A sensor beside a simulation: its bundle, light and outline in a folder, for any worker."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path

import numpy as np

from gelslim_core.files.atomic_file import json_bytes, replace_file
from gelslim_core.files.file_lock import locked
from gelslim_core.files.shared_use import use, used_elsewhere
from gelslim_twin.simulation.run_folder import SimulationError
from gelslim_twin.simulation.twin_sensor import TwinSensor
from ifem_export.bundle.files import load_bundle, write_bundle

BUNDLE, LIGHT, OUTLINE = "bundle", "light.npz", "sensor.json"
USE = ".in_use"
MOST_COMPLIANCES = 4
LIGHT_FIELDS = ("x_mm", "y_mm", "irradiance", "azimuth_deg", "elevation_deg", "colour")


def store_sensor(sensor: TwinSensor, folder: Path, with_light: bool) -> None:
    """Write what is not there yet; another sensor there is replaced, its light included.

    The sensor is in use by this process from then on. Raises SimulationError where another process
    uses another sensor there, files of other origin are in the way, or the folder cannot be
    written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder / ".lock"):
            _store(sensor, folder, with_light)
            use(folder / USE)
    except OSError as error:
        raise SimulationError(
            f"{folder}: the sensor cannot be kept there ({(error.strerror or str(error)).lower()});"
            " choose a folder you can write to"
        ) from error


def _store(sensor: TwinSensor, folder: Path, with_light: bool) -> None:
    held, key = folder / BUNDLE, sensor_key(sensor)
    if _stored_key(folder) != key or not (held / "manifest.json").is_file():
        if used_elsewhere(folder / USE):
            raise SimulationError(
                f"{folder} holds the sensor of another simulation that is still running; "
                "wait for it, or choose an output folder whose parent is another"
            )
        _spare_strangers(folder)
        for name in (LIGHT, OUTLINE):  # never a light without the outline that tells whose it is
            (folder / name).unlink(missing_ok=True)
        write_bundle(held, sensor.bundle)
        _forget_compliances(folder)
        length, width = sensor.size_mm
        radius = sensor.corner_radius_mm
        outline = {"length_mm": length, "width_mm": width, "corner_radius_mm": radius}
        replace_file(folder / OUTLINE, json_bytes({"key": key, **outline}))
    if with_light and not (folder / LIGHT).is_file():
        light = sensor.light()
        stream = io.BytesIO()
        np.savez(stream, **{name: getattr(light, name) for name in LIGHT_FIELDS})
        replace_file(folder / LIGHT, stream.getvalue())


def _spare_strangers(folder: Path) -> None:
    """Raise SimulationError where files of these names are not what `_store` wrote."""
    known = bool(_stored_key(folder))
    for name in (OUTLINE, LIGHT):
        if not known and (folder / name).exists():
            raise SimulationError(
                f"{folder}: holds a {name} of other origin, which the sensor would replace; "
                "choose an output folder whose parent is another"
            )


def _forget_compliances(folder: Path) -> None:
    """Keep the newest: each changed pad leaves one, of up to hundreds of megabytes."""
    found = sorted(folder.glob("compliance-*.npy"), key=lambda path: path.stat().st_mtime)
    for path in found[:-MOST_COMPLIANCES]:
        path.unlink(missing_ok=True)


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
        from gelslim_optics.light.light_map import LightMap

        with np.load(folder / LIGHT, allow_pickle=False) as held:
            return LightMap(**{name: held[name] for name in LIGHT_FIELDS})

    return TwinSensor(
        load_bundle(folder / BUNDLE),
        lit if (folder / LIGHT).is_file() else None,
        outline["length_mm"],
        outline["width_mm"],
        outline["corner_radius_mm"],
    )


def sensor_key(sensor: TwinSensor) -> str:
    """Tells sensors apart: pad, gel, camera, outline and the spec that the light comes from."""
    bundle = sensor.bundle
    parts = (
        bundle.geometry_hash,
        repr(bundle.material),
        bundle.formulation,
        json.dumps(dict(bundle.camera), sort_keys=True),
        repr((sensor.size_mm, sensor.corner_radius_mm)),
        bundle.spec_hash,
    )
    return hashlib.sha256("|".join(parts).encode()).hexdigest()


def _stored_key(folder: Path) -> str:
    try:
        return str(json.loads((folder / OUTLINE).read_bytes())["key"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
