"""Frames of mount, gel and camera, and collision meshes, against the solids they stand for."""

from __future__ import annotations

import math

import numpy as np
import pytest
from robot_samples import WrittenFinger
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from gelslim_cad.export.brep import bounds_mm
from gelslim_cad.export.glb import LINEAR_MM, viewer_tolerances
from gelslim_cad.export.mesh import tessellate
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.optics import virtual_camera
from gelslim_cad.robot.frames import quaternion_wxyz, roll_pitch_yaw
from gelslim_cad.robot.pieces import convex_hull, crown_top_mm


def in_mount(written: WrittenFinger, points_mm: np.ndarray) -> np.ndarray:
    """Points of the sensor frame in mm, in the mount's frame in m."""
    gel = written.finger.frames.gel
    return np.atleast_2d(points_mm) * 1e-3 @ gel[:3, :3].T + gel[:3, 3]


def adapter_bounds_m(written: WrittenFinger) -> tuple[np.ndarray, np.ndarray]:
    adapter = next(p for p in written.parts if p.name == "gripper_adapter")
    low, high = bounds_mm(adapter.solid)
    return in_mount(written, low)[0], in_mount(written, high)[0]


@pytest.mark.slow
def test_the_mount_lies_on_the_face_that_meets_the_jaw(
    written: WrittenFinger, lateral: WrittenFinger
) -> None:
    low, high = adapter_bounds_m(written)
    assert low[0] == pytest.approx(0, abs=1e-9)
    # Bolts of M4 in the middle of a strip of 11 mm.
    assert low[2] == pytest.approx(-5.5e-3)
    assert low[1] == pytest.approx(-high[1])
    low, high = adapter_bounds_m(lateral)
    # The plate of 37.5 mm is centred on the jaw, and its lower face is the jaw's.
    assert low[0] == pytest.approx(-18.75e-3)
    assert low[2] == pytest.approx(0, abs=1e-9)


def test_the_gels_frame_is_in_the_middle_of_its_surface(written: WrittenFinger) -> None:
    gel = next(p for p in written.parts if p.name == "gel_pad")
    low, high = (in_mount(written, b)[0] for b in bounds_mm(gel.solid))
    place = written.finger.frames.gel[:3, 3]
    assert (low + high)[:2] / 2 == pytest.approx(place[:2], abs=1e-9)
    assert high[2] == pytest.approx(place[2])


def test_the_camera_mirrored_at_the_mirror_is_the_virtual_camera(written: WrittenFinger) -> None:
    d, frames = written.d, written.finger.frames
    angle = math.radians(d["mirror.angle_deg"])
    normal = np.array([-math.sin(angle), 0, math.cos(angle)])
    flip = np.eye(3) - 2 * np.outer(normal, normal)
    at_mm = (frames.optical[:3, 3] - frames.gel[:3, 3]) * 1e3
    on_mirror = np.array([d["mirror.lower_x_mm"], 0, d["mirror.lower_z_mm"]])
    seen = virtual_camera(d)
    assert on_mirror + flip @ (at_mm - on_mirror) == pytest.approx(seen.position_mm, abs=1e-6)
    right, down, forward = (flip @ frames.optical[:3, k] for k in range(3))
    assert right == pytest.approx(seen.right, abs=1e-9)
    assert down == pytest.approx(seen.down, abs=1e-9)
    assert forward == pytest.approx(seen.forward, abs=1e-9)
    for frame in (frames.optical, frames.graphics):
        assert np.linalg.det(frame[:3, :3]) == pytest.approx(1)
    # The other convention looks along -z with y up.
    assert frames.graphics[:3, 2] == pytest.approx(-frames.optical[:3, 2])
    assert frames.graphics[:3, 1] == pytest.approx(-frames.optical[:3, 1])


@pytest.mark.parametrize("seed", range(8))
def test_angles_and_quaternions_give_the_rotation_back(seed: int) -> None:
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    roll, pitch, yaw = roll_pitch_yaw(rotation)
    assert Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix() == pytest.approx(rotation)
    w, x, y, z = quaternion_wxyz(rotation)
    assert w >= 0
    assert Rotation.from_quat([x, y, z, w]).as_matrix() == pytest.approx(rotation)


@pytest.mark.parametrize("pitch", [90, -90])
@pytest.mark.parametrize("roll", [0, 33, -120])
def test_angles_at_the_pole(pitch: float, roll: float) -> None:
    rotation = Rotation.from_euler("xyz", [roll, pitch, 50], degrees=True).as_matrix()
    again = Rotation.from_euler("xyz", roll_pitch_yaw(rotation)).as_matrix()
    assert again == pytest.approx(rotation, abs=1e-6)


def test_the_hull_of_a_cube_and_of_points_within() -> None:
    corners = np.array([[x, y, z] for x in (0, 2) for y in (0, 3) for z in (0, 4)], dtype=float)
    inside = np.random.default_rng(1).uniform(0.1, 1.9, (50, 3))
    mesh = convex_hull(np.concatenate([corners, inside]))
    assert len(mesh.vertices_mm) == 8
    a, b, c = (mesh.vertices_mm[mesh.faces[:, k]] for k in range(3))
    # Outward: the divergence theorem gives the volume with its sign.
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(24)


@pytest.mark.parametrize(
    ("sides_mm", "radius_mm", "crown_mm"),
    [((20, 20), 1.5, 0.8), ((28, 18), 9.0, 2.0), ((20, 14), 7.0, 0.06), ((30, 12), 0.0, 0.0005)],
)
def test_the_top_of_a_crown_is_flat_and_close_to_the_gel(
    sides_mm: tuple[float, float], radius_mm: float, crown_mm: float
) -> None:
    gel = GelShape(*sides_mm, radius_mm, 2.0, crown_mm)
    top = crown_top_mm(gel)
    excess = top[:, 2] - gel.surface_z_mm(top[:, 0], top[:, 1])
    assert (excess > 0).all()
    assert (excess <= LINEAR_MM + 1e-12).all()
    assert gel.outline.contains(0.999 * top[:, :2]).all()
    assert top.mean(axis=0) == pytest.approx([0, 0, 0])
    # With points of the crown below it, it is the one horizontal face of the hull.
    u, v = (half.ravel() for half in np.meshgrid(*[np.linspace(-0.5, 0.5, 41)] * 2))
    x, y = u * sides_mm[0], v * sides_mm[1]
    crown = np.stack([x, y, gel.surface_z_mm(x, y)], axis=1)
    hull = ConvexHull(np.concatenate([top, crown[gel.outline.contains(crown[:, :2])]]))
    flat = hull.equations[:, 2] > 1 - 1e-12
    corners = hull.points[hull.simplices[flat]]
    first, second = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    areas = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    assert areas.sum() == pytest.approx(4 * abs(top[0, 0] * top[0, 1]))


def test_a_flat_gel_has_no_top_of_its_own() -> None:
    assert crown_top_mm(GelShape(20.0, 20.0, 1.5, 2.0)).shape == (0, 3)


@pytest.mark.parametrize("which", ["written", pytest.param("lateral", marks=pytest.mark.slow)])
def test_no_part_reaches_out_of_the_collision_meshes(
    which: str, request: pytest.FixtureRequest
) -> None:
    finger: WrittenFinger = request.getfixturevalue(which)
    names = {p.name.removeprefix("collision_") for p in finger.finger.collisions}
    assert names == {"case", "gel", "flange"} | ({"plate"} if which == "lateral" else set())
    origin = -finger.finger.frames.gel[:3, 3] * 1e3
    for part in finger.parts:
        if part.name == "camera_cable" or "wire" in part.tags:
            continue  # they leave the case, and yield
        points = tessellate(part.solid, *viewer_tolerances(part)).vertices_mm - origin
        out = np.full(len(points), np.inf)
        for piece in finger.finger.collisions:
            planes = ConvexHull(piece.mesh.vertices_mm).equations
            out = np.minimum(out, (points @ planes[:, :3].T + planes[:, 3]).max(axis=1))
        assert out.max() < 1e-3, part.name


@pytest.mark.slow
def test_collision_volumes_are_those_of_the_outside(lateral: WrittenFinger) -> None:
    d = lateral.d
    volumes = {p.name: p.volume_mm3 for p in lateral.finger.collisions}
    # The plate on the jaw is a box; its holes do not matter to a hull.
    assert volumes["collision_plate"] == pytest.approx(37.5 * 22 * 6, rel=1e-4)
    gel = next(p for p in lateral.parts if p.name == "gel_pad")
    assert volumes["collision_gel"] == pytest.approx(gel.solid.Volume(), rel=5e-3)
    box = d["finger.length_mm"] * d["finger.width_mm"]
    box *= d["finger.thickness_mm"] - d["design.housing.gel_proud_mm"]
    assert 0.97 * box < volumes["collision_case"] < box
