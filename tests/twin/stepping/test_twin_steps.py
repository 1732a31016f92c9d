"""Steps of one body: the contact of a scene, balance, symmetry, and pictures on request."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from stepping_rig import DT_S, LINEAR, Array, at, box_facets, linear_twin, turned, write_stl

from gelslim_twin.contact.solver import ContactSettings, ContactSolver
from gelslim_twin.scene.indenter import FlatPunch, Sphere, Wedge
from gelslim_twin.scene.pose import Pose
from gelslim_twin.stepping.body import Body
from gelslim_twin.stepping.request import Request
from gelslim_twin.stepping.rigid_motion import motion_of
from gelslim_twin.stepping.step_error import StepError
from gelslim_twin.stepping.twin import Twin
from gelslim_twin.tools.tool import Tool
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance

PATH = (
    Pose(0.0, depth_mm=-0.1),
    Pose(0.1, x_mm=0.2, depth_mm=0.2),
    Pose(0.2, x_mm=0.5, y_mm=0.1, depth_mm=0.3, twist_deg=4.0),
    Pose(0.3, x_mm=0.6, y_mm=0.1, depth_mm=0.25, twist_deg=4.0, tilt_x_deg=3.0, tilt_y_deg=-2.0),
    Pose(0.4, x_mm=0.6, y_mm=0.1, depth_mm=-0.2),
)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_steps_are_the_contact_of_a_scene(pad: Path, friction: float) -> None:
    ball = Sphere(shape="sphere", radius_mm=5.0)
    twin = linear_twin(pad, friction=friction)
    twin.add(Body.from_indenters(ball))
    settings = ContactSettings(Request(force_share=0.002).solver_tolerance, friction)
    solver = ContactSolver(SurfaceCompliance(load_bundle(pad)), Tool.of([ball], Path()), settings)
    for pose, known in zip(PATH, solver.states(PATH), strict=True):
        found = twin.step(motion_of(pose), 0.1)
        size = np.abs(known.force_n).max()
        np.testing.assert_allclose(found.force_n, known.force_n, atol=1e-7 * size)
        np.testing.assert_array_equal(found.gel.touch, known.touch)
        np.testing.assert_allclose(found.displacement_mm, known.displacement_mm, atol=1e-9)


def test_wrench_and_reaction_are_the_resultants_of_the_nodal_forces(pad: Path) -> None:
    twin = linear_twin(pad, friction=0.6)
    twin.add(Body.sphere(4.0))
    twin.step(at(0.5, 0.3, 3.8), DT_S)
    step = twin.step(at(0.9, 0.2, 3.7, turned("x", 2.0)), DT_S)
    total = np.zeros(6)
    torque_on_body = np.zeros(3)
    for point, moved, force in zip(step.points_mm, step.displacement_mm, step.force_n, strict=True):
        total += [*force, *np.cross(point, force)]
        torque_on_body -= np.cross(point + moved - [0.9, 0.2, 3.7], force)
    assert abs(total[0]) > 0.01 < -total[2]
    np.testing.assert_allclose(step.wrench, total, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(step.reactions[0, :3], -total[:3], rtol=1e-12)
    np.testing.assert_allclose(step.reactions[0, 3:], torque_on_body, rtol=1e-12)


def test_nothing_is_computed_without_contact(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    for height in (4.0, 4.5, 50.0):
        step = twin.step(at(0.0, 0.0, height), DT_S)
        assert not step.in_contact
        assert not step.wrench.any()
        assert not step.displacement_mm.any()
    made = twin._shared.mechanics.compliance._made
    assert not made.any()
    assert twin.step(at(0.0, 0.0, 3.9), DT_S).in_contact
    assert made.sum() > 0


def test_mirror_images_have_mirrored_wrenches(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.box(3.0, 2.0, 4.0))

    def wrench(x: float, y: float, roll: float, pitch: float) -> Array:
        turn = Rotation.from_euler("xy", [roll, pitch], degrees=True)
        return twin.step(at(x, y, 1.85, turn), DT_S).wrench

    fx, fy, fz, tx, ty, tz = wrench(1.3, 0.7, 2.0, 3.0)
    assert fz < -0.01
    np.testing.assert_allclose(
        wrench(-1.3, 0.7, 2.0, -3.0), [-fx, fy, fz, tx, -ty, -tz], atol=3e-5 * abs(fz)
    )
    np.testing.assert_allclose(
        wrench(1.3, -0.7, -2.0, 3.0), [fx, -fy, fz, -tx, ty, -tz], atol=3e-5 * abs(fz)
    )


def test_a_ball_presses_alike_however_it_is_turned(pad: Path) -> None:
    twin = linear_twin(pad)
    twin.add(Body.sphere(4.0))
    known = twin.step(at(0.3, 0.2, 3.7), DT_S).wrench
    for turn in Rotation.random(12, random_state=8):
        twin.reset()
        found = twin.step(at(0.3, 0.2, 3.7, turn), DT_S).wrench
        np.testing.assert_allclose(found, known, atol=2e-3 * abs(known[2]))


@pytest.mark.parametrize(
    ("turn", "indenter", "low"),
    [
        (turned("x", 0.0), FlatPunch(shape="flat_punch", length_mm=3, width_mm=3), 1.5),
        (turned("y", 90.0), FlatPunch(shape="flat_punch", length_mm=3, width_mm=3), 1.5),
        (
            turned("x", 45.0),
            Wedge(shape="wedge", included_angle_deg=90, length_mm=3, tip_radius_mm=0),
            1.5 * np.sqrt(2),
        ),
    ],
)
def test_a_box_on_its_face_and_on_its_edge(
    pad: Path, tmp_path: Path, turn: Rotation, indenter: FlatPunch | Wedge, low: float
) -> None:
    mesh = Body.from_mesh(
        write_stl(tmp_path / "cube.stl", box_facets(3, 3, 3)), resolution_mm=0.005
    )
    forces = []
    for body in (Body.box(3, 3, 3), mesh, Body.from_indenters(indenter)):
        twin = linear_twin(pad)
        twin.add(body)
        upright = body.name == "tool"
        motion = at(0, 0, -0.2) if upright else at(0, 0, low - 0.2, turn)
        forces.append(twin.step(motion, DT_S).wrench[2])
    assert forces[0] < -0.01
    assert forces[0] == pytest.approx(forces[2], rel=1e-6)
    # A height map cuts off an edge between its points: by half a cell, 0.0025 of 0.2 mm.
    assert forces[1] == pytest.approx(forces[2], rel=2e-2)


def test_pictures_and_markers_are_made_when_asked_for(seen_pad: Path) -> None:
    twin = Twin(seen_pad, ("force", "image"), {"image": 0.5}, effects=LINEAR, seed=3)
    twin.add(Body.sphere(6.0))
    away = twin.step(at(0, 0, 7.0), DT_S)
    pressed = twin.step(at(0, 0, 5.6), DT_S)
    assert "frame" not in vars(pressed)
    still, image = away.image(), pressed.image()
    assert image.shape == (480, 640, 3)
    assert pressed.image() is image
    assert np.abs(image.astype(float) - still).max() > 30
    camera = twin._shared.viewer.camera
    rest = np.column_stack([twin._shared.sensor.grid.positions_mm, np.zeros(99)])
    np.testing.assert_allclose(away.markers_px, camera.project(rest), atol=1e-9)
    # The centre of the ball pushes its dot straight down; the ones around move aside.
    moved = pressed.markers_px - away.markers_px
    assert np.linalg.norm(moved, axis=1).max() > 1.0


def test_what_is_not_observed_is_refused(pad: Path, seen_pad: Path) -> None:
    blind = linear_twin(pad)
    blind.add(Body.sphere(4.0))
    step = blind.step(at(0, 0, 3.9), DT_S)
    with pytest.raises(StepError, match="not observed"):
        step.image()
    with pytest.raises(StepError, match="not observed"):
        _ = step.markers_px
    dots = Twin(seen_pad, ("markers",), effects=LINEAR)
    dots.add(Body.sphere(4.0))
    step = dots.step(at(0, 0, 3.9), DT_S)
    assert step.markers_px.shape == (99, 2)
    with pytest.raises(StepError, match="not observed"):
        step.image()


def test_a_turn_through_half_a_turn_is_a_small_one(pad: Path) -> None:
    """Angles jump from 180° to -180°; the load steps do not lead once round in between."""
    twin = linear_twin(pad, friction=0.8)
    twin.add(Body.box(3.0, 3.0, 3.0))
    twin.step(at(0.0, 0.0, 1.3, turned("z", 165.0)), DT_S)
    over = twin.step(at(0.0, 0.0, 1.3, turned("z", 195.0)), DT_S)
    twin.reset()
    twin.step(at(0.0, 0.0, 1.3, turned("z", 75.0)), DT_S)
    known = twin.step(at(0.0, 0.0, 1.3, turned("z", 105.0)), DT_S)
    assert known.wrench[5] > 1e-4
    np.testing.assert_allclose(over.wrench, known.wrench, atol=1e-4 * np.abs(known.wrench).max())
