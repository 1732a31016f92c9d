"""A gel as built: its file, the sensor that it makes, and what it adds to the covariance."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ball_presses import ball_bundle, ball_calibration
from pad_samples import hertz_like, small_bundle

from gelslim_force.contact.indenter import Sphere
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.forces.wrench import Wrench, WrenchNoise
from gelslim_force.presses.gel_calibration import (
    GelCalibration,
    designed_thickness_mm,
    gel_calibration_record,
    read_gel_calibration,
    specified_gel,
    write_gel_calibration,
)
from gelslim_force.presses.gel_share import GelShare, varied_bundles
from gelslim_force.presses.press_error import PressError
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.bundle.check import check_bundle
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.surface_operator import SurfaceOperator

COVARIANCE = np.array([[4e-4, 1e-4, 0], [1e-4, 1e-4, 0], [0, 0, 2.5e-5]])


def built(bundle: Bundle, *, thickness: float = 1.1, **other: Any) -> GelCalibration:
    values: dict[str, Any] = {
        "geometry_hash": bundle.geometry_hash,
        "youngs_modulus_mpa": 0.2,
        "thickness_mm": thickness * designed_thickness_mm(bundle),
        "poissons_ratio": 0.34,
        "covariance": COVARIANCE,
        "design": {"youngs_modulus_mpa": 0.147, "thickness_mm": 2.0, "poissons_ratio": 0.3223},
        "ball_mm": 12.0,
        "presses": ({"picture": "a.png", "load_n": 0.5},),
        "diagnosis": ("One line.",),
        "warnings": ("look here",),
        "gel": {"law": "linear", "presses": {"linear": 1}},
    }
    return GelCalibration(**{**values, **other})


def exact(bundle: Bundle) -> SurfaceOperator:
    return bundle.surface_operator("factor")


def test_a_file_keeps_everything(tmp_path: Path) -> None:
    gel = built(small_bundle())
    write_gel_calibration(gel, tmp_path / "gel.json")
    again = read_gel_calibration(tmp_path / "gel.json")
    assert gel_calibration_record(again) == gel_calibration_record(gel)
    assert again.gel == gel.gel
    assert again.standard_deviation == pytest.approx([0.2 * 0.02, 2.2 * 0.01, 0.005])


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"format": "other/1"}, "format"),
        ({"covariance": [[1.0]]}, "3 x 3"),
        ({"covariance": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "positive"),
        ({"thickness_mm": -2.0}, "thickness_mm"),
        ({"poissons_ratio": 0.5}, "poissons_ratio"),
        ({"parameters": ["x"]}, "parameters"),
        ({"design": 3}, "gel calibration"),
        ({"youngs_modulus_mpa": None}, "gel calibration"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, changed: dict[str, Any], words: str) -> None:
    record = {**gel_calibration_record(built(small_bundle())), **changed}
    (tmp_path / "gel.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(PressError, match=words) as refused:
        read_gel_calibration(tmp_path / "gel.json")
    assert refused.value.reason == "file"
    assert "gel.json" in str(refused.value)


def test_missing_files_and_fields_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PressError, match="calibrate-gel"):
        read_gel_calibration(tmp_path / "none.json")
    record = gel_calibration_record(built(small_bundle()))
    del record["covariance"]
    (tmp_path / "gel.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(PressError, match="covariance is missing"):
        read_gel_calibration(tmp_path / "gel.json")
    (tmp_path / "gel.json").write_bytes(b"\xff{")
    with pytest.raises(PressError, match="gel calibration"):
        read_gel_calibration(tmp_path / "gel.json")


def test_the_sensor_is_that_of_a_true_rebuild() -> None:
    """Mesh, element and operator of a pad that was meshed with the built thickness."""
    bundle = small_bundle()
    made = built(bundle).varied(bundle)
    outline = RoundedRectangle(length_mm=12.0, width_mm=10.0, corner_radius_mm=1.0)
    mesh, _ = build_pad_mesh(outline, 2.2, cells=(24, 24, 4))
    rebuilt = build_bundle(mesh, Material(0.2, 0.34, 1000.0), "bbar", with_stiffness=False)
    np.testing.assert_allclose(made.mesh.nodes_mm, mesh.nodes_mm, atol=1e-12)
    np.testing.assert_allclose(made.element_matrix, rebuilt.element_matrix, rtol=1e-9)
    check_bundle(made)
    push = hertz_like(np.asarray(mesh.surface_mm), 1.0, (0.2, 0.1))
    moved = exact(made).displacement(push)
    np.testing.assert_allclose(moved, exact(rebuilt).displacement(push), atol=1e-9)
    assert made.markers is bundle.markers
    assert replace(made).geometry_hash != bundle.geometry_hash
    with pytest.raises(MeshError, match="ratio"):
        bundle.with_gel(bundle.material, 0.0)


def test_a_calibration_of_another_sensor_is_refused() -> None:
    bundle, calibration = ball_bundle(), ball_calibration()
    made, moved = built(bundle).applied(bundle, calibration)
    moved.require_bundle(made)
    with pytest.raises(PressError, match="belongs"):
        built(small_bundle()).applied(bundle, calibration)
    with pytest.raises(PressError, match="times"):
        built(bundle, thickness=2.5).applied(bundle, calibration)


@pytest.mark.parametrize("ratio_varies", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_the_share_of_the_gel_is_that_of_true_rebuilds(ratio_varies: bool) -> None:
    """The derivatives of a wrench, from pads rebuilt one standard deviation to either side."""
    bundle = small_bundle(2)
    covariance = COVARIANCE * np.diag([1.0, 1.0, float(ratio_varies)])
    gel = built(bundle, covariance=covariance)
    points = np.asarray(bundle.mesh.surface_mm)
    motion = exact(gel.varied(bundle)).displacement(hertz_like(points, 1.0, (0.2, -0.1)))

    def wrench_of(*change: float) -> Wrench:
        young = 0.2 * np.exp(change[0])
        sensor = replace(gel, youngs_modulus_mpa=young).varied(bundle, *change[1:])
        force = exact(sensor).force(motion)
        return WrenchNoise(points, np.zeros((6, len(points), 3))).wrench(force, np.zeros((6, 6)))

    steps = np.diag(np.sqrt(np.diag(COVARIANCE)))[: 2 + ratio_varies]
    slopes = np.array(
        [(wrench_of(*s).vector - wrench_of(*-s).vector) / (2 * s.max()) for s in steps]
    )
    expected = slopes.T @ covariance[: len(steps), : len(steps)] @ slopes
    share = replace(GelShare.of(bundle, gel, "neo_hookean"), thickness_mm=np.inf)
    found = share.added(wrench_of(0.0, 0.0, 0.0), motion)
    np.testing.assert_allclose(found.covariance, expected, atol=0.02 * expected.max())
    assert found.covariance[2, 2] == pytest.approx(expected[2, 2], rel=0.02)


def test_a_gel_as_specified_has_the_tolerances_of_its_maker() -> None:
    """Force is proportional to the modulus, and for a given motion to one over the thickness."""
    bundle = small_bundle(2)
    assert specified_gel(bundle) is None
    young, thickness = bundle.material.youngs_modulus_mpa, designed_thickness_mm(bundle)
    known = {"youngs_modulus_mpa": 0.1 * young, "thickness_mm": 0.05 * thickness}
    gel = specified_gel(replace(bundle, tolerances=known))
    assert gel is not None
    np.testing.assert_allclose(gel.standard_deviation, [0.1 * young, 0.05 * thickness, 0.0])
    points = np.asarray(bundle.mesh.surface_mm)
    motion = exact(bundle).displacement(hertz_like(points, 0.1, (0.02, -0.01)))
    wrench = WrenchNoise(points, np.zeros((6, len(points), 3))).wrench(
        exact(bundle).force(motion), np.zeros((6, 6))
    )
    for law, by_linear_law, known in (
        ("auto", False, 0.15),
        ("auto", True, 1),
        ("linear", False, 1),
    ):
        share = GelShare.of(bundle, gel, law)
        found = share.added(wrench, motion, by_linear_law=by_linear_law)
        depth = -motion[:, 2].min() / thickness
        left_out = known * np.interp(depth, [0, 0.1, 0.2], [0, 0.03, 0.11])
        sigma = np.sqrt(0.1**2 + 0.05**2 + left_out**2)
        assert 0.02 < depth < 0.2
        assert found.standard_deviation[2] == pytest.approx(sigma * abs(wrench.vector[2]), rel=0.02)


def test_an_indenter_tells_how_its_motion_depends_on_the_gel() -> None:
    bundle = small_bundle(2)
    gel = built(bundle)
    points = np.asarray(bundle.mesh.surface_mm)
    patch = ContactPatch("disc", np.array([0.3, -0.2]), 2.2)

    def model(sensor: Bundle) -> NormalModel:
        return NormalModel(exact(sensor), points)

    varied = tuple((model(more), step) for _, more, step in varied_bundles(bundle, gel))
    source = IndenterSource(None, model(gel.varied(bundle)), Sphere(6.0), varied=varied)  # type: ignore[arg-type]
    found = source.motion(patch)
    assert found.by_gel_mm is not None
    assert found.by_gel_mm.shape == (2, len(points))
    for row, change in zip(found.by_gel_mm, ((0.01, 0.0), (0.0, 0.001)), strict=True):
        ends = [
            model(gel.varied(bundle, *(sign * np.array(change)))).motion(patch, Sphere(6.0)).w_mm
            for sign in (-1, 1)
        ]
        slope = (ends[1] - ends[0]) / (2 * sum(change))
        np.testing.assert_allclose(row, slope, atol=0.06 * np.abs(slope).max())
    plain = replace(source, varied=()).motion(patch)
    assert plain.by_gel_mm is None


def test_an_unknown_normal_motion_stays_unknown() -> None:
    bundle = small_bundle(2)
    gel = built(bundle)
    share = GelShare.of(bundle, gel, "neo_hookean")
    motion = np.zeros((len(bundle.mesh.surface), 3))
    motion[:, 0], motion[:, 2] = 0.01, np.nan
    covariance = np.full((6, 6), np.nan)
    covariance[np.ix_([0, 1, 5], [0, 1, 5])] = np.eye(3) * 1e-8
    wrench = Wrench(np.array([0.5, 0.0, np.nan]), np.array([np.nan, np.nan, 0.1]), covariance)
    found = share.added(wrench, motion)
    assert np.isnan(found.standard_deviation[[2, 3, 4]]).all()
    assert found.standard_deviation[0] > 0.4 * 0.02
