"""The sensor of a scene, made from its spec or read from a bundle."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from gelslim_core.yaml.errors import InputError
    from gelslim_twin.effects.circumstances import SensorFigures
    from gelslim_twin.scene.reader import LoadedScene
    from ifem_export.bundle.bundle import Bundle


def sensor_figures(loaded: LoadedScene) -> SensorFigures:
    """Return the figures of a sensor that planning needs; they need no stiffness.

    Raises InputError if the sensor is missing or its spec has faults, IfemError if the folder is
    not a bundle.
    """
    from gelslim_twin.planning.sensor_figures import bundle_figures

    _require_present(loaded)
    if loaded.scene.sensor.bundle is not None:
        return bundle_figures(loaded.sensor_path)
    return _spec_figures(loaded)


def scene_bundle(loaded: LoadedScene, with_light: bool = True) -> Bundle:
    """Return the bundle of a scene's sensor, read or made from the spec without a ladder.

    Raises the same errors as `sensor_figures`.
    """
    _require_present(loaded)
    if loaded.scene.sensor.bundle is not None:
        from ifem_export.bundle.files import load_bundle

        return load_bundle(loaded.sensor_path)
    return spec_bundle(loaded.sensor_path, with_light)


def spec_bundle(path: Path, with_light: bool = True) -> Bundle:
    """Return the bundle of a spec without a ladder; light is traced only with `with_light`.

    Raises InputError if the spec has faults.
    """
    from gelslim_cad.dimensions import derive
    from gelslim_cad.sensor import make_bundle, marker_grid, pad_mesh
    from gelslim_cad.tolerance.asked import read_spec

    spec = read_spec(path).spec
    d = derive(spec)
    grid = marker_grid(d)
    return make_bundle(spec, d, pad_mesh(d, grid)[0], grid, with_light=with_light)


def require_within_gel(loaded: LoadedScene, thickness_mm: float) -> None:
    """Raise InputError if the tool goes deeper than `DEEPEST_SHARE` of the gel."""
    from gelslim_twin.effects.contact_estimate import DEEPEST_SHARE

    most = DEEPEST_SHARE * thickness_mm
    lowest = min(indenter.raised_mm for indenter in loaded.scene.indenters)
    depth = max(pose.depth_mm for pose in loaded.poses) - lowest
    if depth <= most:
        return
    field = "motion.csv" if loaded.scene.motion.csv is not None else "motion.waypoints"
    for number, waypoint in enumerate(loaded.scene.motion.waypoints or ()):
        if getattr(waypoint, "depth_mm", 0.0) and waypoint.move == "press":
            field = f"motion.waypoints[{number}].depth_mm"
    raise loaded.problem(
        field,
        f"{depth + lowest:g}",
        f"the tool goes {depth:g} mm deep into a gel of {thickness_mm:g} mm",
        f"press at most {most:.3g} mm deep, {DEEPEST_SHARE:.0%} of the gel",
    )


def _require_present(loaded: LoadedScene) -> None:
    sensor, path = loaded.scene.sensor, loaded.sensor_path
    if sensor.spec is not None and not path.is_file():
        raise _missing(loaded, "sensor.spec", sensor.spec, "no such file")
    if sensor.bundle is not None and not path.is_dir():
        raise _missing(loaded, "sensor.bundle", sensor.bundle, "no such folder")


def _missing(loaded: LoadedScene, field: str, value: str, message: str) -> InputError:
    from gelslim_core.yaml.errors import shown

    return loaded.problem(
        field, shown(value), message, f"paths are relative to the scene's folder, {loaded.folder}"
    )


def _spec_figures(loaded: LoadedScene) -> SensorFigures:
    import numpy as np

    from gelslim_cad.dimensions import derive
    from gelslim_cad.gel import gel_skin
    from gelslim_cad.geometry.optics import camera_record
    from gelslim_cad.sensor import marker_grid, pad_light, pad_mesh
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_twin.planning.sensor_figures import figures, least_light

    spec = read_spec(loaded.sensor_path).spec
    d = derive(spec)
    grid = marker_grid(d)
    mesh, _ = pad_mesh(d, grid)
    cells = mesh.occupancy.shape
    size = tuple(n * h for n, h in zip(cells, mesh.cell_size_mm, strict=True))
    gel, skin, camera = spec.material.gel, gel_skin(spec), camera_record(d)
    return figures(
        camera,
        size_mm=(float(size[0]), float(size[1]), float(size[2])),
        material=(gel.youngs_modulus_mpa, gel.poissons_ratio),
        surface_nodes=len(mesh.surface),
        layers=mesh.layers,
        markers=len(grid),
        marker_pitch_mm=float(d["design.markers.pitch_mm"]),
        marker_diameter_mm=float(np.median(grid.diameter_mm)),
        skin_n_per_mm=0.0 if skin is None else skin.stiffness_n_per_mm,
        skin_friction=None if skin is None else skin.friction,
        least_light=least_light(pad_light(d), grid.positions_mm, camera),
    )
