"""Pictures of the steps: arrows of the right size, and moving parts that can be seen."""

from __future__ import annotations

import io
import math

import assembly_samples as samples
import numpy as np
import pytest
from PIL import Image

from gelslim_cad.assembly.order import Step
from gelslim_cad.assembly.scenes import FASTENER, MOVING, step_scene
from gelslim_cad.export.mesh import TriangleMesh, bad_edges, volume_mm3
from gelslim_cad.pictures.shaded_mesh import shaded_mesh
from gelslim_cad.pictures.step_pictures import (
    HEAD_LENGTH,
    HEAD_RATIO,
    SIDES,
    Arrow,
    StepScene,
    arrow_mesh,
    picture_steps,
)
from gelslim_cad.pictures.window import PictureError, offscreen_window

NAME = "mini20"


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (-0.6, 0.0, -0.8), (1, 0, 0)])
def test_an_arrow_is_closed_and_ends_at_its_tip(direction: tuple[float, float, float]) -> None:
    tip = np.array([1.0, 2.0, 3.0])
    points, faces = arrow_mesh(Arrow(tip, np.array(direction, dtype=float), 10.0, 1.0))
    mesh = TriangleMesh(points, faces)
    assert len(bad_edges(mesh)) == 0
    polygon = SIDES / 2 * math.sin(2 * math.pi / SIDES)  # area over the radius squared
    head = 10.0 * HEAD_LENGTH
    expected = polygon * (0.25 * (10.0 - head) + (HEAD_RATIO / 2) ** 2 * head / 3)
    assert volume_mm3(mesh) == pytest.approx(expected, rel=1e-9)
    along = points @ np.array(direction)
    assert along.max() == pytest.approx(float(tip @ np.array(direction)))
    assert np.ptp(along) == pytest.approx(10.0)


def scenes() -> tuple[tuple[Step, ...], list[StepScene]]:
    made = samples.parts(NAME)
    steps = samples.order(samples.dimensions(NAME), made)
    colours = {p.name: p.colour for p in made}
    meshes = {name: shaded_mesh(*mesh) for name, mesh in samples.drawn(NAME).items()}
    return steps, [step_scene(s, meshes, colours) for s in steps]


@pytest.mark.slow
def test_parts_are_drawn_on_their_way_and_not_at_their_seat() -> None:
    meshes = samples.drawn(NAME)
    for step, scene in zip(*scenes(), strict=True):
        for name in step.moves:
            seated = meshes[name].vertices_mm
            (shift,) = {
                tuple(m.shift_mm)
                for m in scene.meshes
                if np.array_equal(m.mesh.vertices_mm, seated)
            }
            back = sum(
                (np.multiply(leg.direction, -leg.length_mm) for leg in step.way[1:]), np.zeros(3)
            )
            first = np.array(shift) - back
            way = float(first @ np.array(step.way[0].direction))
            assert way < -6.0
            np.testing.assert_allclose(first, way * np.array(step.way[0].direction), atol=1e-5)


@pytest.mark.parametrize("stride", [4, pytest.param(1, marks=pytest.mark.slow)])
def test_what_moves_is_seen_in_every_picture(stride: int) -> None:
    """At least 0.2 % of each picture has the hue of moving parts or of fasteners."""
    steps, drawn = (every[::stride] for every in scenes())
    try:
        with offscreen_window() as window:
            pictures = picture_steps(window, drawn, 320)
    except PictureError as error:
        pytest.skip(str(error))
    for step, png in zip(steps, pictures, strict=True):
        pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float) / 255
        for colour, wanted in ((MOVING, bool(step.moves)), (FASTENER, bool(step.fasteners))):
            if wanted:
                assert share_of_hue(pixels, colour) > 2e-3, (step.key, colour)


def share_of_hue(pixels: np.ndarray, colour: tuple[float, float, float]) -> float:
    """Share of saturated pixels whose hue is within 25° of a colour's."""

    def hue(rgb: np.ndarray) -> np.ndarray:
        r, g, b = np.moveaxis(rgb, -1, 0)
        return np.degrees(np.arctan2(math.sqrt(3) * (g - b), 2 * r - g - b))

    strong = np.ptp(pixels, axis=-1) > 0.25
    apart = (hue(pixels) - hue(np.array(colour)) + 180) % 360 - 180
    return float((strong & (np.abs(apart) < 25)).mean())


def test_no_picture_is_drawn_for_no_step() -> None:
    assert picture_steps(None, []) == []
