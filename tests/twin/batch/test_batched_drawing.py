"""Markers and pictures side by side: areas and centroids of outlines, and single pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batch_rig import apart, contacts
from render_rig import CAMERA
from sim_rig import write_sensor
from stepping_rig import LINEAR, at

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.light.light_map import LightMap, red_green_sides
from gelslim_twin.batch.coverage import covered, drawn
from gelslim_twin.batch.projection import BatchedCamera
from gelslim_twin.batch.shading import BatchedShading
from gelslim_twin.batch.surfaces import BatchedSurfaces
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import NodeLattice
from gelslim_twin.render.surroundings import Sight
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.twin import Twin
from ifem_export.markers.grid import build_marker_grid
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

LENSES = (
    None,
    LensDistortion(k1=-0.12, k2=0.02, p1=1e-3, p2=-2e-3, k3=1e-3),
    LensDistortion(k1=-0.03, k2=0.004, k3=1e-4, k4=1e-5, model="kannala_brandt"),
)


@pytest.mark.parametrize("lens", LENSES)
def test_images_of_points_are_those_of_the_camera(engine: Any, lens: LensDistortion | None) -> None:
    """Also on faces of layers, above the gel, and at the foot of the pinhole."""
    camera = replace(CAMERA, lens=lens)
    rng = np.random.default_rng(1)
    points = rng.uniform([-12, -11, -4.4], [12, 11, 1.0], (200, 3))
    points[:2, :2] = camera.position_mm[:2]
    points[2:5, 2] = [-2.0, 0.0, -4.5]
    found = BatchedCamera(engine, camera).project(engine.double(points.reshape(2, 100, 3)))
    np.testing.assert_allclose(
        found.numpy().reshape(200, 2), camera.project(points), rtol=0, atol=1e-9
    )
    with pytest.raises(ValueError, match="behind"):
        BatchedCamera(engine, camera).project(engine.double([[0.0, 0.0, -60.0]]))


def test_covered_area_and_centroid_are_those_of_the_outlines(engine: Any) -> None:
    """By the shoelace formula; outlines turn either way, one is a triangle with level edges."""
    rng = np.random.default_rng(4)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    radii = rng.uniform(0.3, 6.0, (30, 2, 1))
    outlines = radii * np.stack([np.cos(angle), np.sin(angle)]) + rng.uniform(20, 40, (30, 2, 1))
    outlines = outlines.transpose(0, 2, 1).copy()
    outlines[::2] = outlines[::2, ::-1]
    outlines[7] = np.repeat([[25.0, 25.0], [29.0, 25.0], [27.0, 31.0]], 8, axis=0)
    windows = covered(engine, engine.double(outlines), 2)
    ahead = np.roll(outlines, -1, axis=1)
    cross = outlines[..., 0] * ahead[..., 1] - ahead[..., 0] * outlines[..., 1]
    area = cross.sum(axis=1) / 2
    centroid = ((outlines + ahead) * cross[..., None]).sum(axis=1) / (6 * area[:, None])
    ink = drawn(engine, windows, engine.double(np.ones(30)), 30, (64, 64)).numpy()
    np.testing.assert_allclose(ink.sum(axis=(1, 2)), np.abs(area), rtol=1e-9)
    assert ink.max() <= 1 + 1e-12
    assert ink.min() >= -1e-12
    for axis, coordinate in ((0, ink.sum(axis=1)), (1, ink.sum(axis=2))):
        middle = (coordinate * np.arange(64)).sum(axis=1) / np.abs(area)
        assert np.abs(middle - centroid[:, axis]).max() < 0.05


def lights() -> list[LightMap]:
    """One direction a source, and fans of directions that change over the pad."""
    plain = red_green_sides(14.0, 12.0, decay_mm=9.0)
    rng = np.random.default_rng(6)
    fans = rng.random((2, 4, 3, 12, 3))
    fans[..., 0] /= fans[..., 0].sum(axis=-1, keepdims=True)
    fans[..., 1:] = (fans[..., 1:] - 0.5) * 6 * fans[..., :1]
    return [plain, replace(plain, fans=fans)]


@pytest.mark.parametrize("light", lights())
def test_shaded_light_is_that_of_single_pictures(engine: Any, light: LightMap) -> None:
    """Dents, ridges and slopes at rays on the pad and beside it."""
    x, y = np.linspace(-7, 7, 29), np.linspace(-6, 6, 25)
    px, py = np.meshgrid(x, y)
    nodes = np.column_stack([px.ravel(), py.ravel()])
    rng, states = np.random.default_rng(3), []
    for _ in range(3):
        middle, spread = rng.uniform(-3, 3, 2), rng.uniform(0.8, 2.5)
        dent = np.exp(-((nodes - middle) ** 2).sum(axis=1) / spread**2)
        states.append(np.column_stack([*(0.1 * dent[:, None] * (nodes - middle)).T, -0.6 * dent]))
    sight, shading = Sight.of(CAMERA, 16), Shading(ambient_share=0.1, pixel_step=16)
    lattice = NodeLattice.of(nodes)
    surfaces = BatchedSurfaces.of(engine, lattice, np.array(states))
    found = BatchedShading(engine, shading, sight, light).gain(surfaces).numpy()
    for one, state in zip(found, states, strict=True):
        known = shading.gain(sight, lattice.state(state), light)
        assert np.ptp(known) > 0.3
        np.testing.assert_allclose(one, known, rtol=0, atol=2e-6)


@pytest.mark.parametrize("precision", ["double", pytest.param("single", marks=pytest.mark.slow)])
def test_markers_and_pictures_are_those_of_single_ones(
    seen_pad: Path, engine: Any, precision: Any
) -> None:
    """With shading, defocus, noise, dirt, glare, a response curve and faults of the print."""
    effects = {
        **LINEAR,
        **dict.fromkeys(("dirt", "defocus", "specular", "sensor_noise", "marker_print"), "on"),
        "exposure": {"use": "on", "gamma": 1.4, "gain": 1.3},
    }
    twin = Twin(seen_pad, ("force", "image"), {"image": 0.05}, effects=effects, seed=2)
    twin.add(Body.sphere(4.0))
    poses = np.concatenate([contacts(2, 4.0), [at(0, 0, 9.0)]])
    known = twin.batch(poses)
    found = twin.batch(poses, backend="torch", precision=precision)
    look = twin._shared.viewer.renderer.look
    assert None not in (look.shading, look.defocus, look.sensor_noise, look.exposure, look.specular)
    assert not found.one_by_one.any()
    exact = precision == "double"
    np.testing.assert_allclose(
        found.markers_px, known.markers_px, rtol=0, atol=1e-9 if exact else 2e-5
    )
    off = found.images().astype(int) - known.images()
    assert np.abs(off).max() <= 1
    assert (off != 0).mean() < (1e-4 if exact else 1e-3)
    np.testing.assert_array_equal(found.images([1])[0], found.images()[1])


@pytest.mark.slow
def test_a_crowned_gel(engine: Any, tmp_path: Path) -> None:
    """Contacts and markers side by side, pictures one by one."""
    mesh, _ = build_pad_mesh(
        RoundedRectangle(14.0, 12.0, 1.0), 2.0, cells=(14, 12, 3), crown=Paraboloid(0.4, 8.0)
    )
    write_sensor(tmp_path, mesh, build_marker_grid(11, 9, 1.1, 0.5, anchors="odd_sized"))
    twin = Twin(tmp_path, ("force", "image"), {"image": 0.5}, effects=LINEAR)
    assert np.ptp(twin.points_mm[:, 2]) > 0.3
    twin.add(Body.sphere(4.0))
    poses = contacts(6, 4.0, reach_mm=2.5)
    known, found = twin.batch(poses), twin.batch(poses, backend="torch")
    assert not found.one_by_one.any()
    assert apart(known, found).max() < 1e-9
    np.testing.assert_allclose(found.markers_px, known.markers_px, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(found.images([1]), known.images([1]))


@pytest.mark.slow
def test_correlated_noise_is_drawn_one_by_one(seen_pad: Path, engine: Any) -> None:
    effects = {**LINEAR, "sensor_noise": {"use": "on", "grain_px": 0.8}}
    twin = Twin(seen_pad, ("image",), {"image": 0.5}, effects=effects)
    twin.add(Body.sphere(4.0))
    poses = [at(0.0, 0.2, 3.8)]
    found = twin.batch(poses, backend="torch")
    np.testing.assert_array_equal(found.images(), twin.batch(poses).images())
