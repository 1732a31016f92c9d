"""Which element locks, over Poisson's ratio and layers, against independent references."""

import numpy as np
import pytest
from ifem_layer import mixed_force, press_force, strip_force_closed_form

from ifem_export.elements.hex8 import FORMULATIONS
from ifem_export.elements.material import Material

NUS = (0.3, 0.45, 0.49, 0.499, 0.4999)
LAYERS = (1, 2, 4, 8)
HALF_MM, THICKNESS_MM = 3.0, 2.0
CURED = ("bbar", "incompatible")


@pytest.fixture(scope="module")
def error():
    """Relative error of the resultant of a uniform press, by (element, ν, layers)."""
    pytest.importorskip(
        "skfem", reason="scikit-fem is not installed: locking is NOT checked against it"
    )
    found = {}
    for nu in NUS:
        reference = mixed_force(nu, HALF_MM, THICKNESS_MM, 4)
        for formulation in FORMULATIONS:
            for layers in LAYERS:
                force = press_force(
                    formulation,
                    Material(1.0, nu, 1.0),
                    (HALF_MM, HALF_MM),
                    THICKNESS_MM,
                    (8, 8, layers),
                )
                found[formulation, nu, layers] = force / reference - 1.0
    return found


@pytest.mark.slow
def test_the_reference_has_converged():
    pytest.importorskip("skfem")
    for nu in NUS:
        fine, coarse = (mixed_force(nu, HALF_MM, THICKNESS_MM, n) for n in (4, 3))
        assert fine == pytest.approx(coarse, rel=4e-3)


@pytest.mark.parametrize("nu", NUS)
def test_one_bonded_layer_is_the_constrained_modulus_whatever_the_element(error, nu):
    """No node is free, so no element can help: the layer cannot bulge."""
    material = Material(1.0, nu, 1.0)
    expected = (material.lame_lambda_mpa + 2 * material.shear_modulus_mpa) * 0.01 * HALF_MM**2
    for formulation in FORMULATIONS:
        half = (HALF_MM, HALF_MM)
        force = press_force(formulation, material, half, THICKNESS_MM, (8, 8, 1))
        assert force == pytest.approx(expected, rel=1e-10)
    assert error["bbar", nu, 1] > {0.3: 0.1, 0.45: 1.0, 0.49: 6.0, 0.499: 60, 0.4999: 600}[nu]


def test_full_integration_locks_in_proportion_to_the_bulk_modulus(error):
    for layers in LAYERS:
        ratio = error["full", 0.4999, layers] / error["full", 0.499, layers]
        assert 9.0 < ratio < 10.5
    assert error["full", 0.4999, 8] > 5.0
    assert error["full", 0.49, 4] > 0.3
    assert abs(error["full", 0.3, 4]) < 0.02


@pytest.mark.parametrize(
    ("formulation", "limits"),
    [("bbar", {2: 0.22, 4: 0.07, 8: 0.035}), ("incompatible", {2: 0.35, 4: 0.10, 8: 0.045})],
)
def test_the_others_are_cured_from_two_layers_on_at_any_ratio(error, formulation, limits):
    for layers, limit in limits.items():
        errors = [error[formulation, nu, layers] for nu in NUS]
        assert max(np.abs(errors)) < limit
        # Saturates: ten times the bulk modulus changes nothing.
        assert abs(errors[-1] - errors[-2]) < 0.01


def test_more_layers_are_better_and_bbar_is_best(error):
    for nu in NUS:
        for formulation in FORMULATIONS:
            assert np.all(np.diff([error[formulation, nu, n] for n in LAYERS]) < 0.0)
        for layers in LAYERS[1:]:
            by_element = [error[f, nu, layers] for f in ("bbar", "incompatible", "full")]
            assert 0.0 < by_element[0] < by_element[1] < by_element[2]


@pytest.mark.parametrize(("nu", "limit"), [(0.499, 0.03), (0.4999, 0.06)])
@pytest.mark.parametrize("formulation", CURED)
def test_long_strip_against_lubrication_theory(formulation, nu, limit):
    """Closed form for a strip forty times as wide as thick, in plane strain."""
    material = Material(1.0, nu, 1.0)
    expected = strip_force_closed_form(material, 20.0, 1.0)
    depth = 0.25

    def error_of(element, layers):
        force = press_force(
            element, material, (20.0, depth), 1.0, (80, 1, layers), plane_strain=True
        )
        return force / depth / expected - 1.0

    assert abs(error_of(formulation, 4)) < limit
    assert abs(error_of(formulation, 8)) < 0.015
    assert error_of("full", 4) > 1.5 * error_of(formulation, 4)


@pytest.mark.slow
@pytest.mark.parametrize("formulation", CURED)
@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_refined_layers_reach_the_reference(formulation, nu):
    half = (HALF_MM, HALF_MM)
    force = press_force(formulation, Material(1.0, nu, 1.0), half, THICKNESS_MM, (18, 18, 12))
    assert force == pytest.approx(mixed_force(nu, HALF_MM, THICKNESS_MM, 5), rel=0.025)
