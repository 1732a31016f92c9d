"""The adjoint fields of a stored bundle: what they give, old bundles, damaged ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import reseal

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.bundle.check import check_adjoint
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.elements.material import Material
from ifem_export.errors import BundleError, IfemError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

E_MPA = 0.147


@pytest.fixture(scope="module")
def made() -> Bundle:
    mesh, _ = build_pad_mesh(RoundedRectangle(8.0, 6.0, 1.0), 2.0, pitch_mm=(0.8, 0.7), layers=3)
    return build_bundle(mesh, Material(E_MPA, 0.45, 1020.0), "bbar", with_stiffness=False)


@pytest.fixture(scope="module")
def motion(made: Bundle) -> np.ndarray:
    return np.random.default_rng(2).normal(size=(len(made.mesh.surface), 3))


def exact(bundle: Bundle, u: np.ndarray) -> np.ndarray:
    force = bundle.surface_operator("factor").force(u)
    torque = np.cross(bundle.mesh.surface_mm, force).sum(axis=0)
    return np.concatenate([force.sum(axis=0), torque])


def test_a_bundle_stores_what_makes_a_wrench_a_product(made, motion, tmp_path: Path) -> None:
    write_bundle(tmp_path / "b", made)
    back = load_bundle(tmp_path / "b")
    assert back.stored_adjoint is not None
    assert np.tensordot(back.stored_adjoint, motion, 2) == pytest.approx(exact(made, motion))
    assert back.adjoint.wrench(motion) == pytest.approx(exact(made, motion), rel=1e-7)
    for rung, options in (("fft", {}), ("fft", {"lumped": 1}), ("pcg", {"rtol": 0.1})):
        force = back.surface_operator(rung, **options).force(motion)
        assert force.sum(axis=0) == pytest.approx(exact(made, motion)[:3], rel=1e-7)


@pytest.mark.parametrize("section", [None, {"version": 99}])
def test_a_bundle_without_them_or_with_others_computes_them(
    made, motion, tmp_path: Path, section
) -> None:
    write_bundle(tmp_path / "b", made)
    reseal(tmp_path / "b", lambda manifest: manifest.update(adjoint=section))
    old = load_bundle(tmp_path / "b")
    assert old.stored_adjoint is None
    assert old.adjoint.wrench(motion) == pytest.approx(exact(made, motion), rel=1e-7)


def test_fields_of_another_material_are_not_used(made, motion) -> None:
    stored = made.with_adjoint()
    stiffer = stored.with_gel(replace(made.material, youngs_modulus_mpa=2 * E_MPA))
    assert stiffer.stored_adjoint is None
    assert stiffer.adjoint.wrench(motion) == pytest.approx(2 * exact(made, motion), rel=1e-7)


def test_a_bundle_whose_element_is_of_another_mesh_or_gel_cannot_be_made(made) -> None:
    """A stretched mesh with the element of the old one gave shear forces 2 % off, silently."""
    with pytest.raises(IfemError) as caught:
        replace(made, mesh=made.mesh.stretched(1.025))
    assert caught.value.field == "element_matrix_n_per_mm"
    with pytest.raises(IfemError):
        replace(made, material=replace(made.material, poissons_ratio=0.4))


@pytest.mark.parametrize("damage", ["one force", "sign"])
def test_fields_that_no_stiffness_has_are_refused(made, damage: str) -> None:
    fields = np.array(made.with_adjoint().stored_adjoint)
    if damage == "sign":
        fields *= -1.0
    else:
        fields[0, 3, 2] += 0.1 * np.abs(fields).max()
    with pytest.raises(BundleError) as caught:
        check_adjoint(replace(made, stored_adjoint=fields))
    assert caught.value.file == "adjoint_fields.npy"
