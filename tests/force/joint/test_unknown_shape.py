"""Forces of unknown objects from drawn pictures whose forces are known.

The truth is another discretisation, another renderer and given tractions; see `pressed_samples`.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from pressed_samples import (
    FRICTION,
    Pressed,
    calibration,
    lit_bundle,
    pressed,
    pressed_by,
    reference,
    round_patch,
    shaped,
)
from sensor_samples import sensor_bundle, sensor_grid
from shaded_frames import shaded

from gelslim_force.built_sensor import BuiltGel, built_gel
from gelslim_force.calibration.file import write_calibration
from gelslim_force.forces.finite_strain import FiniteStrainForce, HeldPad
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.off_design import OffDesign
from gelslim_force.joint.sensor_source import unknown_shape
from gelslim_force.joint.settings import ON_NODES, JointSettings
from gelslim_force.joint.strained_gel import StrainedGel
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.presses.gel_calibration import specified_gel
from gelslim_force.presses.gel_share import varied_bundles
from gelslim_force.sensor import SensorError, normal_source, open_sensor, unknown_source
from gelslim_force.settings import PipelineSettings
from ifem_export.compliance.compliance_change import ComplianceChange
from ifem_export.operators.solver import ConvergenceError

Array = NDArray[np.float64]
LINEAR_CAMERA = JointSettings(gamma=1.0)
LINEAR_GEL = PipelineSettings(gel="linear")
"""As the presses are drawn."""


def pipeline(sources: int = 2, gamma: float = 1.0) -> ForcePipeline:
    return made(sources, gamma)


@cache
def made(sources: int, gamma: float) -> ForcePipeline:
    source = unknown_shape(
        lit_bundle(sources),
        calibration(),
        reference().image,
        gel="linear",
        settings=replace(LINEAR_CAMERA, gamma=gamma),
    )
    return ForcePipeline(lit_bundle(sources), calibration(), LINEAR_GEL, source)


def with_gamma(estimator: JointEstimator, gamma: float) -> JointEstimator:
    """The estimator with another response of the camera."""
    view = copy(estimator.light)
    assert view is not None
    view.law = replace(view.law, gamma=gamma)
    return replace(estimator, light=view)


def processed(image: NDArray[np.uint8], sources: int = 2, gamma: float = 1.0) -> FrameResult:
    found = pipeline(sources, gamma)
    found.reset()
    return found.process(image)


@pytest.mark.parametrize("seed", [13, pytest.param(20, marks=pytest.mark.slow)])
def test_six_components_of_an_unknown_object(seed: int) -> None:
    truth = pressed(seed)
    found = processed(truth.image)
    assert found.normal_known
    assert not found.problems
    assert found.wrench is not None
    assert found.field is not None
    off = found.wrench.vector - truth.wrench
    assert abs(off[2]) < 0.1 * abs(truth.wrench[2])
    assert np.hypot(*off[:2]) < 0.01
    assert (np.abs(off) < 3 * found.wrench.standard_deviation).all()
    size = np.linalg.norm(truth.force_n)
    assert np.linalg.norm(found.field.force_n - truth.force_n) < 0.3 * size
    push = -found.field.force_n[:, 2]
    assert (push >= 0).all()
    assert (np.hypot(*found.field.force_n[:, :2].T) <= 1.2 * push + 1e-9).all()


def test_lost_markers_hide_no_depth_where_the_light_shows_the_gel() -> None:
    """Eight small specks cover markers only; under a patch of 2.4 mm a dent could hide."""
    clean, grid = pressed(13).image, sensor_grid().positions_mm
    places = calibration().camera.project(np.column_stack([grid, np.zeros(len(grid))]))
    row, column = np.indices(clean.shape[:2])
    free = np.flatnonzero((grid < -3).all(axis=1))
    sigma = []
    for specks, radius_px in (([], 0), (free[::4][:8], 8), (free[:1], 30)):
        image = clean.copy()
        for x, y in places[specks]:
            image[np.hypot(column - x, row - y) < radius_px] = 20
        found = processed(image)
        assert found.wrench is not None
        assert found.normal_known
        sigma.append(found.wrench.standard_deviation[2])
    assert sigma[1] == pytest.approx(sigma[0], rel=0.15)
    assert sigma[2] > 1.2 * sigma[0]


def test_the_next_frame_starts_from_the_last() -> None:
    truth = pressed(13)
    first = processed(truth.image)
    again = pipeline().process(truth.image)
    assert first.wrench is not None
    assert again.wrench is not None
    apart = np.abs(again.wrench.vector - first.wrench.vector)
    assert (apart < 0.5 * first.wrench.standard_deviation).all()


def test_a_finer_pressure_is_fitted_unless_it_is_not_wanted() -> None:
    sensor, camera, rest = lit_bundle(), calibration(), reference().image
    for asked in (False, True):
        made = unknown_source(sensor, camera, rest, PipelineSettings(finer_pressure=asked))
        assert (made.estimator.pressure is not None) == asked
    nodes = replace(ON_NODES, gamma=1.0)
    source = unknown_shape(sensor, camera, rest, gel="linear", settings=nodes)
    truth = pressed(13)
    finer = processed(truth.image)
    plain = ForcePipeline(sensor, camera, LINEAR_GEL, source).process(truth.image)
    assert finer.wrench is not None
    assert plain.wrench is not None
    off = np.abs(finer.wrench.vector - truth.wrench)
    assert (off < 3 * finer.wrench.standard_deviation).all()
    assert abs(finer.wrench.force_n[2] - plain.wrench.force_n[2]) > 1e-4


def test_forces_change_with_poissons_ratio_as_their_derivative_says() -> None:
    """The same picture of a wide contact, explained by a gel of another ratio."""
    truth = pressed_by(round_patch((0.5, -0.5), 3.6, 0.02, (0.2, 0.1)), 1, noise=0.0)
    gel = specified_gel(replace(lit_bundle(), tolerances={"poissons_ratio": 0.02}))
    assert gel is not None
    (_, _, _), (_, varied, step) = varied_bundles(lit_bundle(), gel)
    source = pipeline().normal
    assert isinstance(source, UnknownShape)
    designed = source.estimator
    view, to_markers = designed.markers, designed.nodes_to_markers
    gel_change = ComplianceChange.of(lit_bundle(), [(varied, step)])
    designed = replace(designed, off_design=OffDesign(gel_change, to_markers, designed.by_height))
    camera, rest = calibration(), reference().image
    other = unknown_shape(varied, camera, rest, gel="linear", settings=LINEAR_CAMERA).estimator
    places_px = view.camera.project(view.rest_mm + to_markers @ truth.moved_mm)
    found, changed = (e.estimate(e.frame(truth.image, places_px, 0.005)) for e in (designed, other))
    assert found is not None
    assert found.by_gel is not None
    assert changed is not None
    opened = normal_source(BuiltGel(lit_bundle(), camera, None, ((varied, step),)), rest)
    assert isinstance(opened, UnknownShape)
    for made_for, known in ((source, True), (opened, False)):
        assert made_for.estimator.off_design is not None
        assert (made_for.estimator.off_design.gel is None) == known
    change = (changed.force_n - found.force_n).sum(axis=0) / step
    assert np.linalg.norm(change - found.by_gel[0, :3]) < 0.15 * np.linalg.norm(change)
    assert abs(change[0] - found.by_gel[0, 0]) < 0.15 * abs(change[0])


def test_no_contact_is_no_force() -> None:
    found = processed(shaded(camera=calibration().camera, seed=9).image)
    assert found.wrench is not None
    assert not found.problems
    assert found.wrench.force_n[2] == 0
    unseen_n = LINEAR_CAMERA.unseen_force * lit_bundle().material.youngs_modulus_mpa
    assert found.wrench.standard_deviation[2] == pytest.approx(unseen_n, rel=0.1)
    assert (np.abs(found.wrench.force_n) <= 4 * found.wrench.standard_deviation[:3] + 1e-12).all()


@pytest.mark.slow
def test_a_press_that_grows_and_fades() -> None:
    """Each frame starts from the last; what is too faint to see is within its deviation."""
    for seed in (13, 21):
        pipeline().reset()
        for number, share in enumerate((0.1, 0.2, 0.4, 0.7, 1.0, 0.7, 0.3, 0.0)):
            truth = pressed(seed, share=share, frame=number)
            found = pipeline().process(truth.image)
            assert found.wrench is not None
            if found.normal_known:
                off = found.wrench.force_n - truth.wrench[:3]
                assert (np.abs(off) < 3.5 * found.wrench.standard_deviation[:3]).all(), share
            else:
                assert share <= 0.2


@pytest.mark.slow
def test_rest_is_no_force_in_any_frame() -> None:
    for seed in range(40):
        found = processed(shaded(camera=calibration().camera, seed=900 + seed, noise=2.5).image)
        assert not found.normal_known or found.wrench.force_n[2] == 0  # type: ignore[union-attr]


@pytest.mark.slow
def test_a_gain_off_by_a_fifth_costs_little() -> None:
    """The camera's exponent is assumed 1.2 times too large, so that the light seems too strong."""
    errors, gains = [], []
    for seed in range(30, 42):
        truth = pressed(seed)
        found = processed(truth.image, gamma=1.2)
        assert found.wrench is not None
        errors.append(abs(found.wrench.force_n[2] / truth.wrench[2] - 1))
        gains.append(found.extra["normal"]["gain"])
    assert np.median(errors) < 0.06
    assert np.median(gains) > 1.02


def test_a_law_that_fails_gives_a_reason_and_no_force(monkeypatch: pytest.MonkeyPatch) -> None:
    class Failing:
        def held(self, displacement_mm: Array, near: HeldPad | None) -> HeldPad:
            raise ConvergenceError("no balance")

    source = pipeline().normal
    assert isinstance(source, UnknownShape)
    gel = StrainedGel(cast(FiniteStrainForce, Failing()), lambda force_n: force_n, 0.0)
    linear = source.estimator
    strained = replace(linear, strained=gel)
    monkeypatch.setattr(source, "estimator", strained)
    found = processed(pressed(13).image)
    assert not found.normal_known
    assert "no balance" in found.problems
    assert found.wrench is not None
    assert np.isnan(found.wrench.force_n[2])
    assert np.isfinite(found.wrench.force_n[:2]).all()
    monkeypatch.setattr(source, "without_strain", linear)
    instead = processed(pressed(13).image)
    assert instead.normal_known
    assert instead.field is not None
    assert instead.field.by_linear_law
    monkeypatch.undo()
    expected = processed(pressed(13).image)
    assert instead.wrench is not None
    assert expected.wrench is not None
    np.testing.assert_array_equal(instead.wrench.vector, expected.wrench.vector)


@dataclass
class Errors:
    """Errors over many frames; forces below 0.2 N do not count in the relative ones."""

    normal: list[float] = field(default_factory=list)
    shear: list[float] = field(default_factory=list)
    shear_n: list[float] = field(default_factory=list)
    centre_mm: list[float] = field(default_factory=list)
    distribution: list[float] = field(default_factory=list)
    scores: list[Array] = field(default_factory=list)

    def add(self, found: FrameResult, truth: Pressed) -> None:
        assert found.normal_known, found.problems
        assert found.wrench is not None
        assert found.field is not None
        off = found.wrench.vector - truth.wrench
        self.scores.append(off / found.wrench.standard_deviation)
        self.shear_n.append(float(np.hypot(*off[:2])))
        push, points = -truth.force_n[:, 2], found.field.points_mm[:, :2]
        away = found.field.centre_of_pressure_mm - push @ points / push.sum()
        self.centre_mm.append(float(np.hypot(*away)))
        size = np.linalg.norm(truth.force_n)
        self.distribution.append(float(np.linalg.norm(found.field.force_n - truth.force_n) / size))
        if abs(truth.wrench[2]) >= 0.2:
            self.normal.append(off[2] / truth.wrench[2])
            self.shear.append(float(np.hypot(*off[:2]) / abs(truth.wrench[2])))

    @property
    def spread(self) -> Array:
        return np.asarray(np.sqrt(np.mean(np.square(self.scores), axis=0)))


@pytest.mark.slow
def test_random_tractions_with_three_lights() -> None:
    errors = Errors()
    for seed in range(60):
        truth = pressed(seed)
        errors.add(processed(truth.image, 3), truth)
    assert np.median(np.abs(errors.normal)) < 0.03
    assert np.percentile(np.abs(errors.normal), 95) < 0.08
    assert np.median(errors.distribution) < 0.18
    assert np.median(errors.shear_n) < 0.002
    assert (errors.spread < 1.3).all()


@pytest.mark.slow
def test_two_hundred_random_objects() -> None:
    """Patches, discs, rods, rings, tilted faces, textures and contacts at the edge.

    Each is also seen with a gain of the light that is drawn within 20 %.
    """
    source = pipeline().normal
    assert isinstance(source, UnknownShape)
    rng = np.random.default_rng(6)
    errors, other_light = Errors(), Errors()
    for seed in range(200):
        truth = pressed(seed) if seed < 100 else shaped(seed)
        errors.add(processed(truth.image), truth)
        estimator = with_gamma(source.estimator, float(np.exp(rng.normal(0, 0.2))))
        drawn = UnknownShape(estimator, source.reference)
        other_light.add(pipeline().with_normal(drawn).process(truth.image), truth)
    assert np.median(np.abs(errors.normal)) < 0.03
    assert np.percentile(np.abs(errors.normal), 95) < 0.10
    assert abs(np.median(errors.normal)) < 0.02
    assert np.median(errors.shear) < 0.03
    assert np.median(errors.shear_n) < 0.002
    assert np.median(errors.centre_mm) < 0.1
    assert np.median(errors.distribution) < 0.2
    assert (errors.spread < 1.3).all()
    assert np.median(np.abs(other_light.normal)) < 0.06
    assert np.percentile(np.abs(other_light.normal), 95) < 0.15


def test_the_shape_is_unknown_unless_it_is_given(tmp_path: Path) -> None:
    """A bundle with light and a calibration with its picture are enough for six components."""
    write_calibration(calibration(), tmp_path / "calibration.json")
    usual = open_sensor(lit_bundle(), calibration=tmp_path / "calibration.json")
    assert isinstance(usual.normal, UnknownShape)
    assert isinstance(open_sensor(lit_bundle(), reference=reference().image).normal, UnknownShape)
    bare = replace(calibration(), picture=None)
    for found in (
        open_sensor(lit_bundle(), calibration=calibration(), indenter="none"),
        open_sensor(lit_bundle(), calibration=bare),
        open_sensor(sensor_bundle(), calibration=calibration()),
    ):
        assert found.normal is None
    with pytest.raises(SensorError) as caught:
        open_sensor(lit_bundle(), calibration=bare, indenter="unknown")
    assert caught.value.argument == "reference"


@pytest.mark.slow
def test_deviations_hold_for_gels_and_lights_within_their_tolerances() -> None:
    """Modulus drawn within 10 % and gain of the light within 20 %: scores and coverage."""
    rng, tolerance = np.random.default_rng(4), 0.1
    known = {"youngs_modulus_mpa": tolerance * lit_bundle().material.youngs_modulus_mpa}
    bundle = replace(lit_bundle(), tolerances=known)
    share = built_gel(bundle, calibration(), None, PipelineSettings(gel="auto")).share
    assert share is not None
    source = pipeline().normal
    assert isinstance(source, UnknownShape)
    first = ForcePipeline(bundle, calibration(), LINEAR_GEL, source, share)
    scores, errors = [], []
    for seed in range(60):
        truth = pressed(seed)
        gamma = float(np.exp(rng.normal(0, 0.2)))
        estimator = with_gamma(source.estimator, gamma)
        drawn = UnknownShape(estimator, source.reference, source.unseen_mm)
        found = first.with_normal(drawn).process(truth.image).wrench
        assert found is not None
        errors.append(abs(found.force_n[2] / truth.wrench[2] - 1))
        for stiffer in np.exp(rng.normal(0, tolerance, 5)):
            scores.append((found.vector - stiffer * truth.wrench) / found.standard_deviation)
    spread = np.sqrt(np.mean(np.square(scores), axis=0))[:3]
    inside = (np.abs(scores) < 1.96).mean(axis=0)[:3]
    assert np.median(errors) < 0.04
    assert ((spread > 0.7) & (spread < 1.3)).all()
    assert ((inside > 0.9) & (inside < 0.99)).all()


def test_light_and_colour_are_needed() -> None:
    with pytest.raises(SensorError, match="no light"):
        open_sensor(sensor_bundle(), reference=reference().image, indenter="unknown")
    mono = replace(lit_bundle(), camera={**lit_bundle().camera, "picture": "mono"})
    with pytest.raises(SensorError, match="mono"):
        unknown_source(mono, calibration(), reference().image)
    with pytest.raises(SensorError, match="depth"):
        open_sensor(lit_bundle(), reference=reference().image, indenter="unknown", depth_mm=0.2)


def test_the_friction_of_the_samples_is_within_the_cone() -> None:
    assert JointSettings().friction > FRICTION
