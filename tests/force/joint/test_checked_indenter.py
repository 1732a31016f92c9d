"""Named indenters against what light and markers show of the shape that really presses."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from fault_frames import soft_glare
from lit_pipelines import checked, opened
from pressed_samples import Pressed, calibration, lit_bundle, reference
from pressed_shapes import Shape, ball, edge, pressed_shape, punch, rod, two_balls
from shaded_frames import shaded

from gelslim_force.contact.ball_model import BallModel, PadLayer
from gelslim_force.contact.indenter_source import IndenterSource
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.joint.checked_indenter import CheckedIndenter
from gelslim_force.joint.estimator import JointEstimator
from gelslim_force.joint.fit_state import FitState, JointForces
from gelslim_force.joint.unknown_shape import UnknownShape
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings

LARGEST_OFF = 0.25
BALL_MODEL = BallModel(cast("NormalModel", None), PadLayer(0.147, 0.3223, 2.0), 8.0)


@dataclass(frozen=True, eq=False)
class Trial:
    """One named indenter on one picture.

    Attributes:
        named: Its name.
        right: Whether it is the shape that presses.
        unchecked: Error of F_z by the named indenter alone, relative; NaN where it is unknown.
        refused: Whether the check refuses it.
    """

    named: str
    right: bool
    unchecked: float
    refused: bool


def first(chain: ForcePipeline, truth: Pressed) -> FrameResult:
    chain.reset()
    return chain.process(truth.image)


def trial(shape: Shape, truth: Pressed, name: str) -> Trial:
    alone, found = first(opened(name), truth), first(checked(name), truth)
    off = np.nan
    if alone.normal_known and alone.wrench is not None:
        off = alone.wrench.force_n[2] / truth.wrench[2] - 1
    return Trial(name, name == shape.named, off, not found.normal_known)


def random_press(rng: np.random.Generator, shape: Shape, seed: int) -> Pressed:
    place = tuple(rng.uniform(-4, 4, 2))
    return pressed_shape(shape, rng.uniform(0.15, 0.5), place, rng.uniform(0, 180), seed)


def trials(seed: int, count: int) -> list[Trial]:
    """Random presses of each kind of shape with right and wrong names."""
    rng, found = np.random.default_rng(seed), []
    for number in range(count):
        radius = float(np.round(rng.uniform(3, 9), 2))
        shapes = {
            ball(radius): (1.0, 0.65, 1.5),
            rod(radius / 2): (1.0, 1.6),
            rod(radius / 2, rng.uniform(5, 10)): (1.0, 1.6),
            punch(rng.uniform(1.5, 3.5)): (1.0,),
            edge(rng.uniform(5, 9)): (1.0,),
            two_balls(radius / 2, rng.uniform(3, 5)): (1.0,),
        }
        for kind, (shape, scales) in enumerate(shapes.items()):
            truth = random_press(rng, shape, 100 * number + kind)
            cylinder = kind in (1, 2)
            size = radius / 2 if cylinder or kind == 5 else radius
            names = [f"{'cylinder' if cylinder else 'sphere'}:{s * size:g}" for s in scales]
            names += [] if cylinder else [f"cylinder:{radius / 2:g}"]
            found += [trial(shape, truth, name) for name in names]
    return found


@pytest.mark.slow
def test_wrong_shapes_are_refused_and_right_ones_are_not() -> None:
    """Balls of other radii, rods for balls, rods with ends, punches, edges and pairs of balls.

    A rod across the whole gel may be refused under its right name too: where most of the picture
    has changed, its patch is not found and its force by name is off by half and more.
    """
    found = trials(3, 4)
    wrong = [t for t in found if not t.right and abs(t.unchecked) > LARGEST_OFF]
    passed = [t for t in wrong if not t.refused]
    right = [t for t in found if t.right and abs(t.unchecked) <= LARGEST_OFF]
    lost = [t for t in right if t.refused]
    assert len(wrong) >= 30
    assert not passed
    assert len(right) >= 4
    assert not lost


@pytest.mark.slow
def test_the_reason_names_both_forces() -> None:
    truth = pressed_shape(ball(6.0), 0.35, (1.0, -1.0), 0.0, 3)
    right, wrong = first(checked("sphere:6"), truth), first(checked("sphere:3.5"), truth)
    assert right.normal_known
    assert right.wrench is not None
    assert right.wrench.force_n[2] == pytest.approx(truth.wrench[2], rel=0.15)
    assert not wrong.normal_known
    assert wrong.wrench is not None
    assert np.isnan(wrong.wrench.force_n[2])
    assert np.isfinite(wrong.wrench.force_n[:2]).all()
    assert "another shape or size" in wrong.problems[-1]


@pytest.mark.slow
def test_the_verdict_holds_between_comparisons_and_goes_with_the_contact() -> None:
    truth = pressed_shape(ball(6.0), 0.35, (1.0, -1.0), 0.0, 3)
    chain = checked("sphere:3.5")
    chain.reset()
    assert not any(chain.process(truth.image).normal_known for _ in range(13))
    still = shaded(camera=calibration().camera, seed=9, noise=2.5).image
    assert chain.process(still).normal_known
    assert not chain.process(truth.image).normal_known


def solutions_of(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Counts, one for each frame that the test begins, of the solutions of the witness."""
    counts, solution = [0], JointEstimator.solution

    def counted(*given: Any) -> FitState:
        counts[-1] += 1
        return solution(*given)

    monkeypatch.setattr(JointEstimator, "solution", counted)
    return counts


@pytest.mark.slow
def test_the_comparison_every_ten_frames_is_spread_over_several(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It ends alike as one that is made at once, of the frame with which it began."""
    truth = pressed_shape(ball(6.0), 0.35, (1.0, -1.0), 0.0, 3)
    chain, counts = checked("sphere:6"), solutions_of(monkeypatch)
    source = chain.normal
    assert isinstance(source, CheckedIndenter)
    judged: list[tuple[float, Any]] = []
    compared = source._compared

    def noted(reading: NormalReading, found: Any) -> Any:
        judged.append((reading.push_n, found))
        return compared(reading, found)

    monkeypatch.setattr(source, "_compared", noted)
    chain.reset()
    for _ in range(25):
        assert chain.process(truth.image).normal_known
        counts.append(0)
    assert counts[0] >= 2
    assert max(counts[1:]) <= 2
    busy = np.flatnonzero(counts)
    assert busy[0] == 0
    assert set(busy[1:]) <= {10, 11, 12, 20, 21, 22}
    assert len(busy) > 2
    forces = [found.force_n[:, 2].sum() for _, found in judged]
    np.testing.assert_allclose(forces, forces[0], rtol=0.02)


@pytest.mark.slow
def test_a_patch_that_grows_is_judged_within_a_few_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A ball of half the radius follows: the search for its patch comes before the comparison."""
    right = pressed_shape(ball(6.0), 0.2, (1.0, -1.0), 0.0, 3)
    wrong = pressed_shape(ball(3.0), 0.6, (1.0, -1.0), 0.0, 4)
    chain, counts = checked("sphere:6"), solutions_of(monkeypatch)
    source = chain.normal
    assert isinstance(source, CheckedIndenter)
    chain.reset()
    assert chain.process(right.image).normal_known
    known, searched = [], []
    for _ in range(9):
        counts.append(0)
        known.append(chain.process(wrong.image).normal_known)
        searched.append(source.named.finder.searched)
    busy = np.flatnonzero(counts[1:])
    assert max(counts[1:]) <= 2
    assert not any(searched[frame] for frame in busy)
    # The verdict of the ball before holds until the comparison ends.
    assert known == [frame < busy[-1] for frame in range(9)]
    assert 0 < busy[0] < busy[-1] < 7


@pytest.mark.slow
def test_a_refusal_does_not_outlive_the_patch_that_it_is_of() -> None:
    """A press may have three frames; the named ball is known in the first that fits."""
    wrong = pressed_shape(ball(3.0), 0.3, (1.0, -1.0), 0.0, 4)
    right = pressed_shape(ball(6.0), 0.35, (1.0, -1.0), 0.0, 3)
    chain = checked("sphere:6")
    chain.reset()
    refused = chain.process(wrong.image)
    assert not refused.normal_known
    assert re.search(r"force of -\d+\.\d+ ± 0\.\d*[1-9]\d* N", refused.problems[-1])
    assert chain.process(right.image).normal_known


@pytest.mark.parametrize("searched", [True, False])
def test_a_comparison_does_not_wait_for_ever(searched: bool) -> None:
    source = CheckedIndenter(
        cast("IndenterSource", SimpleNamespace(finder=SimpleNamespace(searched=searched))),
        cast("UnknownShape", SimpleNamespace(reset=lambda: None)),
    )
    waits = [source._gives_way() for _ in range(8)]
    assert waits == [searched and number % 4 < 3 for number in range(8)]


@pytest.mark.parametrize(
    ("push_n", "push_sigma_n", "model", "refused"),
    [
        (0.19, 0.012, None, False),
        (0.19, 0.001, None, True),
        (0.31, 0.015, None, False),
        (0.12, 0.1, None, True),
        (0.185, 0.012, None, False),
        (0.185, 0.012, BALL_MODEL, True),
    ],
)
def test_the_size_of_the_patch_is_known_as_well_as_it_says(
    push_n: float, push_sigma_n: float, model: BallModel | None, refused: bool
) -> None:
    """A force that could be any confirms nothing, though it does not contradict.

    The model of a ball is more exact than those of other shapes.
    """
    source = CheckedIndenter(
        cast("IndenterSource", SimpleNamespace(model=model)),
        cast("UnknownShape", SimpleNamespace(reset=lambda: None, most_gain=0.3)),
    )
    reading = replace(NormalReading.given(1, [-0.1], 0.0), push_n=push_n, push_sigma_n=push_sigma_n)
    seen = SimpleNamespace(
        gain=1.0,
        unexplained=0.0,
        force_n=np.array([[0.0, 0.0, -0.24]]),
        covariance=np.diag([0.0, 0.0, 0.005**2]),
    )
    verdict = source._compared(reading, cast("JointForces", seen))
    assert bool(verdict.problem) is refused


@pytest.mark.slow
def test_three_solutions_give_the_force_of_five() -> None:
    rng = np.random.default_rng(5)
    for number, shape in enumerate((ball(5.0), rod(2.5), punch(2.2), two_balls(2.4, 4.0))):
        truth, chain = random_press(rng, shape, number), checked("sphere:6")
        source = chain.normal
        assert isinstance(source, CheckedIndenter)
        chain.reset()
        _, tracked = chain._followed(truth.image)
        few = source.witness
        whole = replace(few.estimator, settings=replace(few.estimator.settings, rounds=(2, 1)))
        forces = []
        for estimator in (few.estimator, whole):
            witness = UnknownShape(estimator, few.reference, few.unseen_mm)
            found = witness.look(truth.image, tracked.tracks.positions_px)
            assert isinstance(found, JointForces)
            forces.append(float(found.force_n[:, 2].sum()))
        assert forces[0] == pytest.approx(forces[1], rel=0.02)


@pytest.mark.slow
def test_a_reflection_is_no_ball() -> None:
    """It read as up to -0.3 N, five standard deviations."""
    still = shaded(camera=calibration().camera, seed=77, noise=2.5).image
    chain = checked("sphere:6")
    for seed in range(20):
        chain.reset()
        result = chain.process(soft_glare(still, np.random.default_rng([3, seed])))
        if result.wrench is not None and result.normal_known:
            sigma = np.maximum(result.wrench.standard_deviation[:3], 1e-9)
            assert (np.abs(result.wrench.force_n) < 4 * sigma).all(), seed


@pytest.mark.slow
def test_the_check_is_the_default_and_can_be_left_out() -> None:
    given = {"calibration": calibration(), "reference": reference().image, "indenter": "sphere:6"}
    assert isinstance(open_sensor(lit_bundle(), **given).normal, CheckedIndenter)
    bare = PipelineSettings(check_indenter=False)
    assert not isinstance(open_sensor(lit_bundle(), **given, settings=bare).normal, CheckedIndenter)
