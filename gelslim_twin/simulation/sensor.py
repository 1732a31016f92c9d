"""The sensor of a simulation, and its copy next to the results, which every worker reads."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.file_lock import locked, use, used_elsewhere
from gelslim_core.files.replaced_file import json_bytes, replace_file, sweep
from gelslim_optics.camera.record import is_mono
from gelslim_twin.simulation.run_folder import SimulationError
from ifem_export.bundle.bundle import Bundle
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.errors import IfemError

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap
    from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True, eq=False)
class TwinSensor:
    """A sensor as the digital twin sees it. All of it comes from the bundle.

    Attributes:
        bundle: The sensor. Without an outline in it, the box of the mesh is that of the pad;
            without light, the pad is lit evenly from its sides, red and green but for a mono
            camera.
    """

    bundle: Bundle

    @property
    def points_mm(self) -> NDArray[np.float64]:
        """Surface nodes (c, 3) at rest in mm."""
        return np.asarray(self.bundle.mesh.surface_mm)

    @property
    def camera_record(self) -> Mapping[str, Any]:
        """The camera's parameters."""
        return self.bundle.camera

    @property
    def mono(self) -> bool:
        """Whether the camera sees brightness alone."""
        return is_mono(self.bundle.camera)

    @cached_property
    def grid(self) -> MarkerGrid:
        """The marker grid. Raises IfemError for a bundle without markers."""
        from gelslim_force.calibration.design import bundle_grid

        return bundle_grid(self.bundle)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Length and width of the pad in mm."""
        outline = self.bundle.outline
        if outline is not None:
            return outline.length_mm, outline.width_mm
        box = self.points_mm.max(axis=0) - self.points_mm.min(axis=0)
        return float(box[0]), float(box[1])

    @property
    def corner_radius_mm(self) -> float:
        """Radius of the pad's corners in mm."""
        return 0.0 if self.bundle.outline is None else self.bundle.outline.corner_radius_mm

    def light(self) -> LightMap:
        """The light on the untouched pad."""
        from gelslim_optics.light.light_map import LightMap, red_green_sides

        if self.bundle.light:
            return LightMap.from_arrays(self.bundle.light)
        length, width = self.size_mm
        light = red_green_sides(length, width, decay_mm=0.8 * width)
        return replace(light, colour=np.ones((2, 3))) if self.mono else light


@lru_cache(maxsize=2)
def nodes_to_markers(bundle: Bundle) -> Any:
    """Matrix (m, c) from the surface nodes to the markers as designed, kept for the last sensors.

    Raises IfemError for a bundle without markers.
    """
    from ifem_export.markers.interpolation import marker_to_node

    if bundle.markers is None:
        raise IfemError("the bundle has no markers")
    return marker_to_node(bundle.mesh.surface_mm, bundle.markers.positions_mm)


BUNDLE, RECORD = "bundle", "sensor.json"
USE = ".in_use"
MOST_COMPLIANCES = 4


def store_sensor(sensor: TwinSensor, folder: Path) -> None:
    """Write the sensor's bundle into a folder unless it is there; another sensor is replaced.

    A bundle with light also serves simulations that need none. Files that killed processes left
    incomplete are removed in any case. From then on this process counts as a user of the copy.

    Args:
        sensor: The sensor.
        folder: Folder of the copy.

    Raises:
        SimulationError: Another process uses another sensor in this folder, files of other origin
            are there, or the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with locked(folder / ".lock"):
            sweep(folder, again=True)
            _store(sensor, folder)
            use(folder / USE)
    except OSError as error:
        raise SimulationError(
            f"{folder}: the sensor cannot be kept there ({(error.strerror or str(error)).lower()});"
            " choose a folder you can write to"
        ) from error


def _store(sensor: TwinSensor, folder: Path) -> None:
    held, key, lit = folder / BUNDLE, sensor_key(sensor), bool(sensor.bundle.light)
    stored = _record(folder)
    whole = (held / "manifest.json").is_file()
    same = stored.get("key") == key and whole
    if same and (stored.get("light") or not lit):
        return
    if not same and used_elsewhere(folder / USE):
        raise SimulationError(
            f"{folder} holds the sensor of another simulation that is still running; "
            "wait for it, or choose an output folder whose parent is another"
        )
    if not stored and (folder / RECORD).exists():
        raise SimulationError(
            f"{folder}: holds a {RECORD} of other origin, which the sensor would replace; "
            "choose an output folder whose parent is another"
        )
    # Without the record the bundle counts as unfinished until it is written.
    (folder / RECORD).unlink(missing_ok=True)
    write_bundle(held, sensor.bundle)
    if not same:
        _forget_compliances(folder)
    replace_file(folder / RECORD, json_bytes({"key": key, "light": lit}))


def _forget_compliances(folder: Path) -> None:
    """Keep the newest: each changed pad leaves one, of up to hundreds of megabytes."""
    found = sorted(folder.glob("compliance-*.npy"), key=lambda path: path.stat().st_mtime)
    for path in found[:-MOST_COMPLIANCES]:
        path.unlink(missing_ok=True)


def stored_sensor(folder: Path) -> TwinSensor:
    """Read the sensor that `store_sensor` wrote.

    Args:
        folder: Folder of the copy.

    Returns:
        The sensor.

    Raises:
        SimulationError: The copy is not complete.
        BundleError: The bundle is damaged.
    """
    if not _record(folder):
        raise SimulationError(f"{folder}: the sensor stored there is not complete")
    return TwinSensor(load_bundle(folder / BUNDLE))


def sensor_key(sensor: TwinSensor) -> str:
    """Return a key of pad, gel, camera, outline and the spec that the light comes from."""
    bundle = sensor.bundle
    parts = (
        bundle.geometry_hash,
        repr(bundle.material),
        bundle.formulation,
        json.dumps(dict(bundle.camera), sort_keys=True),
        repr((sensor.size_mm, sensor.corner_radius_mm)),
        bundle.spec_hash,
        *(() if bundle.skin is None else (repr(bundle.skin),)),
    )
    return hashlib.sha256("|".join(parts).encode()).hexdigest()


def _record(folder: Path) -> dict[str, Any]:
    """What `_store` wrote of the sensor; empty where there is none, or a file of other origin."""
    try:
        found = json.loads((folder / RECORD).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and "key" in found else {}
