"""A skin as calibrated: its file, its sensor, its share of the covariance, and hidden skins."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ball_presses import (
    THICKNESS_MM,
    YOUNG_MPA,
    Built,
    ball_bundle,
    ball_calibration,
    ball_picture,
    rest_picture,
)
from numpy.typing import NDArray
from pad_samples import hertz_like, small_bundle
from weighed_presses import LOADS_N, calibrated, presses

from gelslim_force.contact.indenter import Sphere
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_force.forces.wrench import WrenchNoise
from gelslim_force.presses.calibrate_gel import calibrate_gel
from gelslim_force.presses.gel_calibration import (
    PARAMETERS,
    GelCalibration,
    designed_thickness_mm,
    gel_calibration_record,
    read_gel_calibration,
    write_gel_calibration,
)
from gelslim_force.presses.gel_report import gel_report_html
from gelslim_force.presses.gel_share import GelShare, varied_bundles, varied_covariance
from gelslim_force.presses.press_error import PressError
from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.membrane import membrane_stiffness
from ifem_export.elements.skin import Membrane, Skin

Array = NDArray[np.float64]
E_MPA = 0.2
COVARIANCE = np.array(
    [[4e-4, 1e-4, 0, 2e-5], [1e-4, 1e-4, 0, 0], [0, 0, 0, 0], [2e-5, 0, 0, 3.6e-5]]
)
COATED = Skin(Membrane(0.02, 0.45), Membrane(0.04, 0.3), 0.7)


def built(bundle: Bundle, skin: float = 0.06) -> GelCalibration:
    thickness = designed_thickness_mm(bundle)
    design = {
        "youngs_modulus_mpa": 0.147, "thickness_mm": 2.0, "poissons_ratio": 0.3223,
        "skin_n_per_mm": 0.0,
    }  # fmt: skip
    return GelCalibration(
        bundle.geometry_hash, E_MPA, 1.1 * thickness, 0.34, COVARIANCE, design, 12.0,
        ({"picture": "a.png", "load_n": 0.5},), skin_n_per_mm=skin,
    )  # fmt: skip


def test_a_file_keeps_the_skin(tmp_path: Path) -> None:
    gel = built(small_bundle(2))
    write_gel_calibration(gel, tmp_path / "gel.json")
    again = read_gel_calibration(tmp_path / "gel.json")
    assert gel_calibration_record(again) == gel_calibration_record(gel)
    assert again.standard_deviation == pytest.approx([0.004, 0.022, 0.0, 0.006])
    assert again.parameters == PARAMETERS
    for changed in ({"skin_n_per_mm": -0.1}, {"parameters": PARAMETERS[:3]},
                    {"covariance": np.eye(3).tolist()}):  # fmt: skip
        record = {**gel_calibration_record(gel), **changed}
        (tmp_path / "bad.json").write_text(json.dumps(record), encoding="utf-8")
        with pytest.raises(PressError) as refused:
            read_gel_calibration(tmp_path / "bad.json")
        assert refused.value.reason == "file"


@pytest.mark.parametrize("skin", [None, COATED])
def test_the_sensor_has_the_skin_as_built(skin: Skin | None) -> None:
    bundle = replace(small_bundle(2), skin=skin)
    made = built(bundle).varied(bundle)
    assert made.skin is not None
    assert made.skin.stiffness_n_per_mm == pytest.approx(0.06)
    assert made.skin.friction == (None if skin is None else 0.7)
    assert len(made.membranes) == (1 if skin is None else 2)
    assert built(bundle, 0.0).varied(bundle).membranes == ()
    designed = replace(built(bundle), skin_n_per_mm=None, covariance=COVARIANCE[:3, :3])
    assert designed.varied(bundle).skin == skin


def test_a_motion_depends_on_the_skin_over_the_modulus() -> None:
    """Draws of modulus and skin, of ln E and of the ratio N/E at the modulus that was found."""
    gel = built(small_bundle(2))
    drawn = np.random.default_rng(3).multivariate_normal(np.zeros(4), COVARIANCE, 200_000)
    young = E_MPA * np.exp(drawn[:, 0])
    skin = E_MPA * ((0.06 + drawn[:, 3]) / young)
    expected = np.cov(np.array([drawn[:, 0], drawn[:, 1], skin]))
    found = varied_covariance(gel, 2)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-6)
    assert varied_covariance(gel, 0) == pytest.approx(4e-4)


@pytest.mark.slow
def test_the_share_of_the_skin_is_that_of_true_rebuilds() -> None:
    """A ball's patch and a shear of the surface; modulus, thickness and skin vary together.

    The skin is the least known here: of a known ball it changes the normal force very little.
    """
    bundle = small_bundle(2)
    known = np.diag([0.1, 0.1, 1.0, 50.0])
    covariance = known @ COVARIANCE @ known
    gel, points = replace(built(bundle), covariance=covariance), np.asarray(bundle.mesh.surface_mm)
    patch = ContactPatch("disc", np.array([0.3, -0.2]), 2.2)
    made = gel.varied(bundle)
    aside = made.surface_operator("factor").displacement(hertz_like(points, 0.0, (0.2, 0.1)))

    def model(sensor: Bundle) -> NormalModel:
        return NormalModel(PipelineSettings().compliance(sensor), points)

    def wrench_of(young: float = 0.0, thickness: float = 0.0, skin: float = 0.0) -> Array:
        sensor = replace(gel, youngs_modulus_mpa=0.2 * np.exp(young))
        changed = sensor.varied(bundle, thickness, 0.0, skin)
        motion = np.column_stack([aside[:, :2], model(changed).motion(patch, Sphere(6.0)).w_mm])
        return changed.adjoint.wrench(motion)

    steps = (("young", 0.02), ("thickness", 0.02), ("skin", 0.006))
    slopes = np.array([(wrench_of(**{n: s}) - wrench_of(**{n: -s})) / (2 * s) for n, s in steps])
    used = [0, 1, 3]
    expected = slopes.T @ covariance[np.ix_(used, used)] @ slopes
    varied = tuple((model(more), step) for _, more, step in varied_bundles(bundle, gel))
    source = IndenterSource(None, model(made), Sphere(6.0), varied=varied)  # type: ignore[arg-type]
    reading = source.motion(patch)
    motion = np.column_stack([aside[:, :2], reading.w_mm])
    wrench = WrenchNoise(points, np.zeros((6, len(points), 3))).wrench(
        made.surface_operator("factor").force(motion), np.zeros((6, 6))
    )
    share = replace(GelShare.of(bundle, gel), thickness_mm=np.inf)  # without that of the law
    found = share.added(wrench, motion, reading)
    np.testing.assert_allclose(found.covariance, expected, atol=0.1 * expected.max())
    assert covariance[3, 3] * slopes[2, 2] ** 2 > 0.3 * expected[2, 2]


def test_the_pipeline_takes_the_skin_of_a_bundle() -> None:
    """All operators that a pipeline is made of, against the bare ones."""
    bundle = replace(small_bundle(2), skin=COATED)
    settings, points = PipelineSettings(), np.asarray(bundle.mesh.surface_mm)
    push = hertz_like(points, 1.0, (0.2, 0.1))
    edge = settings.edge(bundle)
    assert edge is not None
    exact = bundle.surface_operator("factor").displacement(push)
    bare = replace(bundle, skin=None).surface_operator("factor").displacement(push)
    size = np.abs(exact).max()
    assert np.abs(exact - bare).max() > 0.02 * size
    np.testing.assert_allclose(edge.displacement(push), exact, atol=1e-6 * size)
    np.testing.assert_allclose(edge.force(exact), push, atol=1e-6)
    # The infinite pad has no edge: of it, the change by the skin in the middle is compared.
    quick = [settings.compliance(replace(bundle, skin=skin)).displacement(push)
             for skin in (COATED, None)]  # fmt: skip
    middle = np.hypot(*points[:, :2].T) < 3.5
    change = (exact - bare)[middle]
    close = 0.1 * np.abs(change).max()
    np.testing.assert_allclose((quick[0] - quick[1])[middle], change, atol=close)


def test_large_strain_in_a_skin() -> None:
    """Small motions cost what the linear operator says; the membranes add to large ones."""
    pad = replace(small_bundle(2), skin=COATED)
    law = FiniteStrainForce(pad, tolerance=1e-8, inner_rtol=1e-9, membranes=pad.membranes)
    x, y = np.asarray(pad.mesh.surface_mm)[:, :2].T
    shape = np.column_stack([x, -y, 0 * x]) * np.exp(-(x**2 + y**2) / 4)[:, None]
    small = 1e-6 * shape
    linear = pad.surface_operator("factor").force(small)
    np.testing.assert_allclose(law.force(small), linear, atol=1e-4 * np.abs(linear).max())
    bare = FiniteStrainForce(pad, tolerance=1e-8, inner_rtol=1e-9).force(0.05 * shape)
    own = membrane_stiffness(pad.mesh, pad.membranes) @ (0.05 * shape).ravel()
    np.testing.assert_allclose(law.force(0.05 * shape) - bare, own.reshape(-1, 3), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("poissons_ratio", [0.3223, 0.48])
def test_a_hidden_skin_is_told_found_and_enters_the_forces(poissons_ratio: float) -> None:
    """Without being asked the presses contradict a bare gel, whose stiffness is far off."""
    truth = Built(1.1, 0.97, poissons_ratio, sticking=True, skin_n_per_mm=0.05)
    unasked = calibrated(truth, 1, LOADS_N)
    told = [line for line in unasked.warnings if "--fit-skin" in line]
    assert len(told) == 1
    # Tangential forces go as modulus over thickness.
    shear = unasked.youngs_modulus_mpa / unasked.thickness_mm
    assert shear > 1.05 * truth.young * YOUNG_MPA / (truth.thickness * THICKNESS_MM)
    found = calibrated(truth, 1, LOADS_N, fit_skin=True)
    assert not [line for line in found.warnings if "skin" in line]
    assert found.skin_n_per_mm == pytest.approx(0.05, rel=0.15)
    assert found.youngs_modulus_mpa == pytest.approx(truth.young * YOUNG_MPA, rel=0.03)
    assert found.thickness_mm == pytest.approx(truth.thickness * THICKNESS_MM, rel=0.015)
    assert "membrane" in gel_report_html(found)
    picture = ball_picture(truth, 0.4, np.array([1.0, -2.0]), 999)
    forces = []
    for gel in (None, found):
        sensor = open_sensor(
            ball_bundle(poissons_ratio), reference=rest_picture(),
            calibration=ball_calibration(), indenter="unknown", gel_calibration=gel,
            settings=PipelineSettings(gel="linear"),
        )  # fmt: skip
        wrench = sensor.process(picture).wrench
        assert wrench is not None
        forces.append((float(wrench.force_n[2]), float(wrench.standard_deviation[2])))
    (before, _), (after, sigma) = forces
    # A bare gel is far off, or refused: its contact explains half the change of the light.
    assert np.isnan(before) or abs(before + 0.4) > 0.08
    assert abs(after + 0.4) < min(0.025, 2 * sigma)


@pytest.mark.slow
@pytest.mark.parametrize("skinned", [False, True])
def test_random_sensors_have_the_skin_that_they_have(skinned: bool) -> None:
    """Half of them stick; skins of 0.02 to 1 N/mm, from thin paint to a knit, or none."""
    scores, off = [], []
    for seed in range(8):
        rng = np.random.default_rng([13, seed, skinned])
        truth = Built(
            rng.uniform(0.7, 1.3), round(rng.uniform(0.92, 1.08), 3), (0.48, 0.3223)[seed % 2],
            (6.0, 4.0, 8.0)[seed % 3], sticking=seed % 4 > 1,
            skin_n_per_mm=float(np.exp(rng.uniform(np.log(0.02), 0.0))) if skinned else 0.0,
        )  # fmt: skip
        loads = LOADS_N * truth.young * truth.ball_mm / 6 * rng.uniform(0.7, 1.1)
        found = calibrated(truth, 60 + seed, loads, fit_skin=True)
        assert found.skin_n_per_mm is not None
        own = np.array([
            found.youngs_modulus_mpa / (YOUNG_MPA * truth.young) - 1,
            found.thickness_mm / (THICKNESS_MM * truth.thickness) - 1,
            found.skin_n_per_mm - truth.skin_n_per_mm,
        ])  # fmt: skip
        off.append(own)
        scores.append(own / np.sqrt(np.diag(found.covariance)[[0, 1, 3]]))
    assert (np.abs(off).max(axis=0)[:2] < [0.05, 0.025]).all()
    assert (np.sqrt(np.mean(np.square(scores), axis=0)) < 1.2).all()
    assert np.mean(np.abs(scores) < 1.96) >= 0.9
    if not skinned:
        assert np.max(np.array(off)[:, 2]) < 0.01


@pytest.mark.slow
def test_a_bare_gel_is_not_given_a_skin() -> None:
    """Unasked: no warning, and what a fit would give contains zero."""
    found = calibrated(Built(0.9, 1.04, 0.3223, sticking=True), 7, LOADS_N)
    assert not [line for line in found.warnings if "skin" in line]
    assert found.skin_n_per_mm is None
    assert found.covariance.shape == (3, 3)


@pytest.mark.slow
def test_the_skin_of_the_design_is_believed_and_contradicted() -> None:
    """A design in a coat of 0.05 N/mm: with that coat all is found, a bare gel contradicts it."""
    designed = replace(ball_bundle(0.48), skin=Skin(Membrane(0.05)))
    for skin, told in ((0.05, 0), (0.0, 1)):
        truth = Built(1.15, 0.96, skin_n_per_mm=skin)
        pictures, loads = presses(truth, 5, LOADS_N)
        found = calibrate_gel(
            designed, ball_calibration(), rest_picture(), pictures, loads, 2 * truth.ball_mm
        )
        assert len([line for line in found.warnings if "--fit-skin" in line]) == told
        if not told:
            assert found.youngs_modulus_mpa == pytest.approx(1.15 * YOUNG_MPA, rel=0.03)
            assert found.thickness_mm == pytest.approx(0.96 * THICKNESS_MM, rel=0.015)
