"""Stiffness of the gel against finite elements and limits; what the forms for MuJoCo mean."""

from __future__ import annotations

import math

import numpy as np
import pytest
from robot_samples import WrittenFinger

from gelslim_cad.robot.contact import POINTS, GelContact, apparent_modulus_mpa


def finite_element_modulus_mpa(
    modulus: float, nu: float, sides: tuple[float, float], thickness: float
) -> float:
    """A quarter of the layer with quadratic bricks: bottom fixed, top moved down as a whole."""
    skfem = pytest.importorskip("skfem", reason="finite elements need the [dev] extra")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    # Cells become narrower towards the free edges, where the pressure falls.
    along = 1 - np.linspace(1, 0, 8) ** 2
    mesh = skfem.MeshHex.init_tensor(
        along * sides[0] / 2, along * sides[1] / 2, np.linspace(0, thickness, 4)
    )
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    stiffness = linear_elasticity(*lame_parameters(modulus, nu)).assemble(basis)
    fixed = basis.get_dofs(lambda p: p[2] < 1e-9).all()
    top = basis.get_dofs(lambda p: p[2] > thickness - 1e-9)
    planes = [
        basis.get_dofs(lambda p: p[0] < 1e-9).all(["u^1"]),
        basis.get_dofs(lambda p: p[1] < 1e-9).all(["u^2"]),
    ]
    given, down, strain = np.zeros(basis.N), top.all(["u^3"]), 1e-3
    given[down] = -strain * thickness
    held = np.unique(np.concatenate([fixed, top.all(), *planes]))
    solution = skfem.solve(*skfem.condense(stiffness, x=given, D=held))
    force = -(stiffness @ solution)[down].sum() * 4
    return float(force / (sides[0] * sides[1]) / strain)


@pytest.mark.parametrize(
    ("nu", "sides", "thickness"),
    [
        (0.48, (20.0, 20.0), 2.0),
        pytest.param(0.45, (24.0, 16.0), 3.0, marks=pytest.mark.slow),
        pytest.param(0.49, (12.0, 12.0), 2.0, marks=pytest.mark.slow),
    ],
)
def test_the_pads_stiffness_agrees_with_finite_elements(
    nu: float, sides: tuple[float, float], thickness: float
) -> None:
    expected = finite_element_modulus_mpa(0.2, nu, sides, thickness)
    assert apparent_modulus_mpa(0.2, nu, sides, thickness) == pytest.approx(expected, rel=0.15)


def test_limits_of_the_apparent_modulus() -> None:
    # A tall column is compressed freely.
    assert apparent_modulus_mpa(0.2, 0.45, (1, 1), 500) == pytest.approx(0.2, rel=0.01)
    # A wide layer cannot spread: bulk modulus, and the modulus of free compression.
    bulk = 0.2 / (3 * (1 - 2 * 0.45))
    assert apparent_modulus_mpa(0.2, 0.45, (4000, 4000), 1) == pytest.approx(0.2 + bulk, rel=0.01)
    # Nearly incompressible square of shape factor S: E (1 + c S²), by Gent and Lindley c = 2;
    # the exact pressure of a square gives 2.25 (Kelly, 6.75 G).
    s = 20 / (4 * 2)
    stiff = apparent_modulus_mpa(0.2, 0.49999, (20, 20), 2)
    assert stiff == pytest.approx(0.2 * (1 + 2.25 * s**2), rel=0.03)


@pytest.mark.parametrize("mass_kg", [0.01, 0.1, 1.0])
def test_mujocos_form_has_the_stiffness_and_is_critically_damped(mass_kg: float) -> None:
    contact = GelContact(0.5, 2e5, mass_kg)
    d = contact.solimp[0]
    s, c = (-v for v in contact.solref)
    # A point bears s r / ((1 - d) w) at depth r with w = 1 / m (MuJoCo, computation, solver
    # parameters); n points bear K r.
    assert POINTS * s / ((1 - d) / mass_kg) == pytest.approx(2e5)
    assert c**2 == pytest.approx(4 * s)
    assert contact.damping_n_s_m == pytest.approx(2 * math.sqrt(2e5 * mass_kg))


def test_the_finger_has_the_stiffness_of_its_pad(written: WrittenFinger) -> None:
    d, contact = written.d, written.finger.contact
    modulus = apparent_modulus_mpa(
        d["material.gel.youngs_modulus_mpa"],
        d["material.gel.poissons_ratio"],
        (d["design.gel.length_mm"], d["design.gel.width_mm"]),
        d["design.gel.thickness_mm"],
    )
    area = 20 * 20 - (4 - math.pi) * d["design.gel.corner_radius_mm"] ** 2
    expected = modulus * area / d["design.gel.thickness_mm"] * 1e3
    assert contact.stiffness_n_m == pytest.approx(expected, rel=1e-6)
