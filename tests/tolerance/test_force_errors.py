"""Errors of the forces against closed forms and against a pad assembled with every figure off."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tolerance_samples import drawn, exact, spec

from gelslim_cad.dimensions import derive
from gelslim_cad.tolerance.causes import causes, no_errors
from gelslim_cad.tolerance.force import exponents, force_errors, patch_forces, picture_scale_log


def test_the_force_is_proportional_to_youngs_modulus() -> None:
    """Read with the nominal modulus, the force of a gel stiffer by e is 1 / (1 + e) of the true."""
    d = derive(exact("gelslim2", material__gel__youngs_modulus_tolerance_ratio=0.1))
    (cause,) = (c for c in causes(d) if c.spread > 0)
    e = {**no_errors(d, 500), **drawn({cause.name: ("normal", cause.spread)}, 500, seed=1)}
    expected = 100 * (1 / (1 + e["modulus_percent"] / 100) - 1)
    for found in force_errors(d, e, "as_built"):
        assert found.deviation_percent == pytest.approx(expected.std(), rel=1e-9)
        assert found.most_percent == pytest.approx(np.quantile(np.abs(expected), 0.95), rel=1e-9)
        assert found.causes["Young's modulus"] == pytest.approx(expected.std(), rel=1e-9)
        assert max(v for k, v in found.causes.items() if k != "Young's modulus") < 1e-9


@pytest.mark.parametrize("poisson", [0.0, pytest.param(0.3223, marks=pytest.mark.slow), 0.45])
def test_exponents_of_a_bonded_layer(poisson: float) -> None:
    """Shear G w l / h; pressing (λ + 2 G) w l / h, as long as the bump is wide for the layer."""
    found = exponents(derive(spec("gelslim2", material__gel__poissons_ratio=poisson,
                                  design__gel__thickness_mm=0.8)))  # fmt: skip
    shear, normal = found["shear"], found["normal"]
    assert (shear.thickness, shear.lateral) == pytest.approx((-1, 2), abs=0.01)
    nu = max(poisson, 0.004)
    assert shear.poisson == pytest.approx(-1 / (1 + nu), abs=0.01)
    modulus = -1 / (1 - nu) - 1 / (1 + nu) + 2 / (1 - 2 * nu)
    assert normal.poisson == pytest.approx(modulus, abs=0.15 * abs(modulus) + 0.05)
    assert (normal.thickness, normal.lateral) == pytest.approx((-1, 2), abs=0.15)


def test_powers_multiply_to_the_force_of_a_pad_with_every_figure_off() -> None:
    d = derive(spec("gelslim2"))
    rest: tuple[Any, ...] = (4, "bbar")
    nominal = patch_forces(2.0, 0.3223, 1.0, *rest)
    off = patch_forces(2.0 * 1.05, 0.3223 + 0.02, 1.01, *rest)
    for way, power in exponents(d).items():
        factor = 1.05**power.thickness * np.exp(0.02 * power.poisson) * 1.01**power.lateral
        assert off[way] / nominal[way] == pytest.approx(factor, rel=0.01)


def test_a_print_that_is_too_large_is_read_too_small_after_calibration() -> None:
    """It is the ruler of displacements, and the gel between its markers is larger than nominal."""
    d = derive(exact("gelslim2", tolerance__marker_scale_percent=1.0))
    e = {**no_errors(d, 3), "print_percent": np.array([-1.0, 0.0, 1.0])}
    power = exponents(d)["shear"].lateral
    for found in force_errors(d, e, "as_built"):
        if found.component == "shear":
            total = power + 1 if found.calibrated else power
            expected = 100 * (np.array([0.99, 1.0, 1.01]) ** -total - 1)
            assert found.deviation_percent == pytest.approx(expected.std(), rel=1e-6)


def test_only_a_finger_that_is_not_calibrated_minds_a_longer_lens() -> None:
    d = derive(exact("gelslim2", tolerance__focal_length_percent=2.0))
    e = {**no_errors(d, 2), "focal_percent": np.array([-2.0, 2.0])}
    scale = picture_scale_log(d, e, "as_built")
    # The image distance v = f s / (s - f) rises a little faster than the focal length.
    f, s = d["camera.focal_length_mm"], d["view.focus_mm"]
    v = [f * k * s / (s - f * k) for k in (0.98, 1.02)]
    assert scale == pytest.approx(np.log(np.array(v) / (f * s / (s - f))), rel=0.02)
    errors = {
        (x.component, x.calibrated): x.deviation_percent for x in force_errors(d, e, "as_built")
    }
    assert errors["shear", True] == errors["normal", True] == 0
    assert errors["shear", False] == pytest.approx(100 * np.exp(scale).std(), rel=1e-6)
