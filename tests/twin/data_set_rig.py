"""A small sensor with a scene that draws everything, for the tests of data sets."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

from sim_rig import small_sensor

from gelslim_core.jobs import Engine
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.datasets.data_set import make_data_set
from gelslim_twin.datasets.formats import pictures_of
from gelslim_twin.datasets.job import DataSetJob, FrameChoice
from gelslim_twin.datasets.prepare import prepared
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.sensor import TwinSensor, store_sensor
from ifem_export.bundle.files import load_bundle, write_bundle

WIDTH_PX, HEIGHT_PX = 160, 120
SCENE = """\
format: gelslim-scene/1
name: touch.es
sensor: {bundle: bundle}
indenters: [{shape: sphere, radius_mm: 6}]
motion:
  waypoints:
    - {move: press, depth_mm: 0.25, steps: 2, duration_s: 0.1}
    - {move: shear, x_mm: 0.1, steps: 2, duration_s: 0.1}
contact: {friction: 0.6}
observe: [displacement, force, markers, image]
tolerance: {force_n: 0.2, image_px: 0.5}
effects: {nonlinearity: off}
vary:
  x_mm: [-1, 1]
  tilt_x_deg: [-3, 3, normal]
  depth_factor: [0.5, 1.2, log_uniform]
  friction: [0.3, 0.9]
  tools:
    - {shape: sphere, radius_mm: 6}
    - {shape: sphere, radius_mm: 3}
    - {shape: flat_punch, radius_mm: 2}
  light_gain: [0.8, 1.2]
  sensors: 2
  gel:
    youngs_modulus_factor: [0.8, 1.25]
    poissons_ratio: [0.30, 0.34]
    thickness_factor: [0.95, 1.05]
  camera: {along_mm: [-0.2, 0.2], turn_deg: [-1, 1]}
  effects:
    exposure: {gain: [0.8, 1.2]}
    marker_print: {jitter_mm: [0.0, 0.02]}
seed: 8
"""


def written(folder: Path, change: tuple[str, str] = ("", ""), name: str = "scene.yaml") -> Path:
    """The scene beside its bundle, with one text replaced by another."""
    if not (folder / "bundle").is_dir():
        bundle = load_bundle(small_sensor(folder))
        seen = VirtualCamera.from_record(bundle.camera)
        small = replace(
            seen, focal_px=seen.focal_px / 4, image_width_px=WIDTH_PX, image_height_px=HEIGHT_PX
        )
        write_bundle(folder / "bundle", replace(bundle, camera=bundle.camera | small.to_record()))
    path = folder / name
    assert change[0] in SCENE
    path.write_text(SCENE.replace(*change) if change[0] else SCENE, encoding="utf-8")
    return path


def job_in(scene: Path, out: str, **given: Any) -> DataSetJob:
    """The data set of a scene, in the folder `out` beside it."""
    loaded = read_scene(scene)
    place = scene.parent / ".sensor"
    store_sensor(TwinSensor(load_bundle(scene.parent / "bundle")), place)
    chosen: dict[str, Any] = {"format_name": "folder", "frames_per_shard": 2, **given}
    chosen["pictures"] = pictures_of(chosen.pop("pictures", "png"), chosen.pop("quality", 95))
    chosen["frames"] = FrameChoice.parsed(chosen.pop("frames", "last"))
    return prepared(loaded, place, scene.parent / out, **chosen)


def made(scene: Path, out: str, count: int, jobs: int = 1, **given: Any) -> Path:
    """A data set; returns its folder."""
    job = job_in(scene, out, **given)
    make_data_set(job, count, Engine(jobs))
    return job.out_folder


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file by path."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
