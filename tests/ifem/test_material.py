import math

import pytest

from ifem_export.elements.material import Material
from ifem_export.errors import MaterialError


def test_lame_constants_satisfy_their_defining_relations():
    m = Material(0.147, 0.3223, 1070.0)
    lam, g = m.lame_lambda_mpa, m.shear_modulus_mpa
    # Inverse relations: E and ν from λ and G.
    assert g * (3 * lam + 2 * g) / (lam + g) == pytest.approx(0.147, rel=1e-14)
    assert lam / (2 * (lam + g)) == pytest.approx(0.3223, rel=1e-14)
    assert m.bulk_modulus_mpa == pytest.approx(lam + 2 * g / 3, rel=1e-14)
    assert (m.lame_lambda_mpa + 2 * m.shear_modulus_mpa) == pytest.approx(
        m.bulk_modulus_mpa + 4 * g / 3, rel=1e-14
    )


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ((0.0, 0.3, 1000.0), "youngs_modulus_mpa"),
        ((-1.0, 0.3, 1000.0), "youngs_modulus_mpa"),
        ((math.nan, 0.3, 1000.0), "youngs_modulus_mpa"),
        ((True, 0.3, 1000.0), "youngs_modulus_mpa"),
        ((0.147, 0.5, 1000.0), "poissons_ratio"),
        ((0.147, -1.0, 1000.0), "poissons_ratio"),
        ((0.147, math.inf, 1000.0), "poissons_ratio"),
        ((0.147, "0.3", 1000.0), "poissons_ratio"),
        ((0.147, 0.3, 0.0), "density_kg_m3"),
    ],
)
def test_constants_out_of_range_are_refused_by_name(values, field):
    with pytest.raises(MaterialError) as caught:
        Material(*values)
    assert caught.value.field == field


def test_auxetic_and_nearly_incompressible_are_allowed():
    assert Material(1.0, -0.5, 1.0).lame_lambda_mpa < 0.0
    assert Material(1.0, 0.4999, 1.0).bulk_modulus_mpa == pytest.approx(1666.67, rel=1e-4)
