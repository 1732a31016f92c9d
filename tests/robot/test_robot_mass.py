"""Masses and inertias against closed forms and against meshes by trimesh."""

from __future__ import annotations

import math

import cadquery as cq
import numpy as np
import pytest
import trimesh
from robot_samples import WrittenFinger

from gelslim_cad.export.mesh import tessellate
from gelslim_cad.robot.mass import MassProperties, combined_mass, mass_properties, part_mass


def by_mesh(solid: cq.Shape, density_g_cm3: float) -> MassProperties:
    """Mass properties of a fine mesh in metres, by trimesh."""
    found = tessellate(solid, 0.01, 4.0)
    mesh = trimesh.Trimesh(found.vertices_mm * 1e-3, found.faces, process=False)
    mesh.density = density_g_cm3 * 1e3
    return MassProperties(float(mesh.mass), mesh.center_mass, mesh.moment_inertia)


def test_a_box_and_a_cylinder_have_the_moments_of_the_textbook() -> None:
    a, b, c = 0.02, 0.03, 0.05
    box = cq.Solid.makeBox(20, 30, 50, cq.Vector(7, -4, 1))
    found = mass_properties(box, 2.0)
    mass = 2000 * a * b * c
    assert found.mass_kg == pytest.approx(mass)
    assert found.centre_m == pytest.approx([0.017, 0.011, 0.026])
    diagonal = mass / 12 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    assert found.inertia_kg_m2 == pytest.approx(np.diag(diagonal), abs=1e-15)
    rod = mass_properties(cq.Solid.makeCylinder(5, 40), 7.85)
    mass = 7850 * math.pi * 0.005**2 * 0.04
    side = mass * (3 * 0.005**2 + 0.04**2) / 12
    expected = np.diag([side, side, mass * 0.005**2 / 2])
    assert found.mass_kg != rod.mass_kg
    assert rod.inertia_kg_m2 == pytest.approx(expected, abs=1e-15)


def test_a_turned_box_has_the_turned_tensor() -> None:
    """The signs of the products of inertia: I' = R I R^T."""
    box = cq.Solid.makeBox(20, 30, 50)
    turned = box.rotate(cq.Vector(), cq.Vector(1, 2, 3), 40)
    axis = np.array([1, 2, 3]) / math.sqrt(14)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = math.radians(40)
    rotation = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    before, after = mass_properties(box, 1.0), mass_properties(turned, 1.0)
    expected = rotation @ before.inertia_kg_m2 @ rotation.T
    assert after.inertia_kg_m2 == pytest.approx(expected, abs=1e-16)
    assert abs(expected[0, 1]) > 1e-7


def test_halves_make_the_whole_and_order_does_not_matter() -> None:
    whole = mass_properties(cq.Solid.makeBox(20, 30, 50), 1.3)
    halves = [
        mass_properties(cq.Solid.makeBox(20, 30, 20), 1.3),
        mass_properties(cq.Solid.makeBox(20, 30, 30, cq.Vector(0, 0, 20)), 1.3),
    ]
    for order in (halves, halves[::-1]):
        joined = combined_mass(order)
        assert joined.mass_kg == pytest.approx(whole.mass_kg)
        assert joined.centre_m == pytest.approx(whole.centre_m)
        assert joined.inertia_kg_m2 == pytest.approx(whole.inertia_kg_m2, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_principal_axes_give_the_tensor_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(3, 3))
    tensor = half @ half.T * 1e-5
    moments, axes = MassProperties(1.0, np.zeros(3), tensor).principal()
    assert axes @ np.diag(moments) @ axes.T == pytest.approx(tensor)
    assert np.linalg.det(axes) == pytest.approx(1)
    noisy = MassProperties(1.0, np.zeros(3), tensor * (1 + 1e-15))
    assert noisy.principal()[1] == pytest.approx(axes)


@pytest.mark.slow
def test_every_part_and_the_finger_agree_with_meshes_to_a_thousandth(
    written: WrittenFinger,
) -> None:
    gel = written.d["material.gel.density_kg_m3"]
    origin = written.finger.frames.gel[:3, 3]
    by_kernel, by_triangles = [], []
    for part in written.parts:
        exact = part_mass(part, gel)
        meshed = by_mesh(part.solid, exact.density_g_cm3)
        assert meshed.mass_kg == pytest.approx(exact.properties.mass_kg, rel=1e-3), part.name
        by_kernel.append(exact.properties.moved(origin))
        by_triangles.append(meshed.moved(origin))
    kernel, mesh, told = combined_mass(by_kernel), combined_mass(by_triangles), written.finger.mass
    for other in (kernel, mesh):
        assert told.mass_kg == pytest.approx(other.mass_kg, rel=1e-3)
        assert told.centre_m == pytest.approx(other.centre_m, abs=1e-3 * 0.05)
        scale = np.abs(told.inertia_kg_m2).max()
        assert told.inertia_kg_m2 == pytest.approx(other.inertia_kg_m2, abs=1e-3 * scale)


def test_every_part_has_a_density_with_a_source(written: WrittenFinger) -> None:
    for mass in written.finger.part_masses:
        assert "no table" not in mass.source, mass.name
        assert 0.8 < mass.density_g_cm3 < 9
    assumed = {m.name for m in written.finger.part_masses if m.assumed}
    bought = {"camera", "camera_cable", "led_board_red", "led_board_green"}
    assert assumed == bought | {f"led_wire_{k}" for k in (1, 2, 3, 4)}
    screw = next(m for m in written.finger.part_masses if m.name == "mount_bolt_1")
    assert screw.density_g_cm3 == 7.85
