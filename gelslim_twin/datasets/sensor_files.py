"""The built sensors of a data set as files: nodes, dots and picture of the untouched gel."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from gelslim_core.files.replaced_file import replace_file
from gelslim_twin.datasets.formats import Pictures
from gelslim_twin.datasets.job import DataSetJob
from gelslim_twin.datasets.making import maker_of
from gelslim_twin.datasets.picture_files import encoded
from gelslim_twin.scene.draw import Drawn, sensor_values

SENSORS = "sensors"


def are_written(job: DataSetJob) -> bool:
    """Whether the files of all sensors are there."""
    return all(_place(job, built.number).with_suffix(".npz").is_file() for built in job.sensors)


def _place(job: DataSetJob, number: int) -> Path:
    return job.out_folder / SENSORS / f"sensor_{number:02d}"


def write_sensors(job: DataSetJob) -> None:
    """Write `sensors/sensor_00.npz` and, where pictures are observed, `sensors/sensor_00.png`.

    The archive holds `points_mm` (c, 3), the surface nodes at rest, and where the camera is
    observed `markers_mm` (m, 3), the dots as printed, and `markers_px` (m, 2), their images at
    rest. The picture is that of the untouched gel, with the noise of frame 0.
    """
    maker = maker_of(job)
    for built in job.sensors:
        path = _place(job, built.number)
        if path.with_suffix(".npz").is_file():
            continue
        prepared = maker.prepared(built.number)
        scene = job.loaded.scene
        held: dict[str, Any] = {"points_mm": prepared.sensor.points_mm}
        if {"markers", "image"} & set(scene.observe):
            values = sensor_values(scene, built.number)
            loaded = job.loaded.with_drawn(Drawn(0, sensor=built.number, values=values))
            viewer = prepared.base(loaded)
            held["markers_mm"] = viewer.rest_mm
            held["markers_px"] = viewer.rest_px
            if "image" in scene.observe:
                picture = encoded(viewer.renderer.frame().image, Pictures())
                replace_file(path.with_suffix(".png"), picture, parents=True)
        stream = io.BytesIO()
        np.savez(stream, **held)
        replace_file(path.with_suffix(".npz"), stream.getvalue(), parents=True)
