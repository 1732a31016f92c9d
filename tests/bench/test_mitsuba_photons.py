"""Light traced forwards against Mitsuba's own path integrator, which traces it backwards."""

from __future__ import annotations

import os
from functools import cache
from typing import Any

import numpy as np
import pytest

pytest.importorskip(
    "mitsuba",
    reason="Mitsuba 3 is absent: pictures of known forces were NOT drawn by it (extra `mitsuba`)",
)
if not os.environ.get("DRJIT_LIBLLVM_PATH"):
    pytest.skip(
        "DRJIT_LIBLLVM_PATH names no libLLVM: pictures of known forces were NOT drawn by Mitsuba",
        allow_module_level=True,
    )
from shipped_fingers import DESIGNS

from bench.models.mitsuba_finger import LONGEST_PATH, film_camera, renderer
from bench.models.mitsuba_photons import irradiance, kept_light, of_one_source, stage
from bench.models.mitsuba_view import Print, sight
from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import guide_profile, virtual_camera
from gelslim_cad.light.scene import light_scene
from gelslim_cad.spec.reader import read_spec

pytestmark = pytest.mark.slow
BLOCK_PX, RUNS, SAMPLES, RAYS = 16, 6, 6000, 2_000_000
ROWS, COLUMNS = slice(9, 24), slice(12, 29)
"""Blocks that see the middle of the gel with the dent."""


@cache
def finger() -> tuple[Any, Any]:
    (path,) = [p for p in DESIGNS if p.stem == "gelslim2"]
    d = derive(read_spec(path).spec)
    return of_one_source(light_scene(d, guide_profile(d)), 0), virtual_camera(d)


def dented(depth_mm: float, radius_mm: float = 4.0) -> Any:
    x, y = np.meshgrid(*(np.linspace(-14, 14, 281),) * 2)
    z = np.minimum(0, (x**2 + y**2) / (2 * radius_mm) - depth_mm)
    return np.dstack([x, y, z])


@pytest.mark.parametrize("depth_mm", [0.0, 0.6])
def test_the_light_of_the_coat_is_that_of_paths_traced_backwards(depth_mm: float) -> None:
    """In absolute terms, and block by block within the noise of the paths."""
    mi, (scene, camera) = renderer(), finger()
    surface = dented(depth_mm)
    full = stage(mi, scene, surface)
    found = irradiance(mi, full, kept_light(mi, scene, RAYS, 3), surface, 201, 4)
    bare = Print(np.array([[1e3, 1e3]]), np.array([0.1]))
    light = sight(mi, full, camera).light(found[None], bare, (28.0, 28.0))[..., 0]
    blocks = light.reshape(480 // BLOCK_PX, BLOCK_PX, 640 // BLOCK_PX, BLOCK_PX).mean(axis=(1, 3))
    lamps = scene.sources[0]
    bright = len(lamps.x_mm) * lamps.size_mm**2 / 28.0**2
    shine = scene.surfaces["paint"].reflectance / scene.media["gel"].index ** 2
    ours = blocks[ROWS, COLUMNS] * bright * shine

    path = {"type": "path", "max_depth": LONGEST_PATH, "rr_depth": LONGEST_PATH}
    integrator = mi.load_dict(path)
    sensor = mi.load_dict(film_camera(mi, camera, BLOCK_PX, (ROWS, COLUMNS)))
    runs = np.array(
        [
            np.array(mi.render(full, sensor=sensor, integrator=integrator, seed=k, spp=SAMPLES))
            for k in range(RUNS)
        ]
    )[..., 0]
    theirs, noise = runs.mean(axis=0), runs.std(axis=0, ddof=1) / np.sqrt(RUNS)
    assert noise.mean() < 0.08 * theirs.mean()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.015)
    left = (ours - theirs) / noise.mean()
    assert np.sqrt((left**2).mean()) < 1.5
    assert np.corrcoef(ours.ravel(), theirs.ravel())[0, 1] > 0.95
