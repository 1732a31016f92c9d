"""The whole chain on frames with known forces, and on frames that are broken."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from sensor_samples import NORMAL_N, SHEAR_N, frame, press, sensor_bundle, stream
from synthetic import Look

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.contact.patch import ContactPatch
from gelslim_force.forces.estimator import ForceSettings
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.settings import PipelineSettings


@pytest.fixture(scope="module")
def calibration():
    return calibrate(sensor_bundle(), frame(0.0).image)


@pytest.fixture(scope="module")
def frames():
    return stream(8)


def pipeline(calibration, **settings) -> ForcePipeline:
    """The frames are drawn on a linear gel."""
    return ForcePipeline(
        sensor_bundle(), calibration, PipelineSettings(**{"gel": "linear", **settings})
    )


def last(chain: ForcePipeline, frames, normal: bool = True):
    steps = np.linspace(0, 1, len(frames))
    result = None
    for share, seen in zip(steps, frames, strict=True):
        w = share * press().nodes_mm[:, 2] if normal else None
        result = chain.process(seen.image, normal_mm=w)
    return result


def test_resultant_of_a_known_press(calibration, frames) -> None:
    result = last(pipeline(calibration), frames)
    assert result.problems == ()
    assert result.coverage == 1.0
    assert result.normal_known
    assert result.wrench.force_n == pytest.approx([*SHEAR_N, -NORMAL_N], abs=0.03)
    sigma = result.wrench.standard_deviation
    assert (sigma[:3] < 0.005).all()
    assert result.field.centre_of_pressure_mm == pytest.approx([1.0, -1.0], abs=0.15)
    assert result.field.slip_margin == pytest.approx(1 - np.hypot(*SHEAR_N), abs=0.03)


def test_a_depth_off_by_its_stated_deviation_is_within_that_of_the_force(calibration, frames):
    """An error of the depth by a tenth enters all components, and the deviation holds it."""
    w = press().nodes_mm[:, 2]
    truth = np.array([*SHEAR_N, -NORMAL_N])

    def scores(sigma_mm):
        chain = pipeline(calibration)
        last(chain, frames[:-1])
        found = chain.process(frames[-1].image, normal_mm=1.1 * w, normal_sigma_mm=sigma_mm).wrench
        return np.abs((found.force_n - truth) / found.standard_deviation[:3])

    assert scores(0.0)[2] > 10
    assert 0.5 < scores(0.1 * np.abs(w))[2] < 1.5
    assert scores(0.1 * np.abs(w)).max() < 3
    for bad in (-0.1, np.nan, np.zeros(3)):
        with pytest.raises(ValueError, match="deviation"):
            pipeline(calibration).process(frames[0].image, normal_mm=w, normal_sigma_mm=bad)


def test_exact_compensation_beats_the_papers(calibration, frames) -> None:
    markers, force = {}, {}
    for model in ("none", "printed", "exact"):
        result = last(pipeline(calibration, compensation=model), frames)
        off = (result.marker_displacement_mm - press().markers_mm)[:, :2]
        markers[model] = float(np.sqrt((off**2).mean()))
        force[model] = float(np.hypot(*(result.wrench.force_n[:2] - SHEAR_N)))
    assert markers["exact"] < markers["printed"] < 0.1 * markers["none"]
    assert force["exact"] < 0.02 < force["none"]


def test_four_layers_beat_the_papers_one(calibration, frames) -> None:
    truth = press().force_n
    off = {}
    for rung in ("paper", "factor"):
        chain = pipeline(calibration, rung=rung, force=ForceSettings(method="direct"))
        found = last(chain, frames).field.force_n
        off[rung] = np.linalg.norm(found - truth) / np.linalg.norm(truth)
    assert off["factor"] < 0.6 * off["paper"]


def test_without_normal_source_the_normal_force_is_unknown(calibration, frames) -> None:
    result = last(pipeline(calibration), frames, normal=False)
    assert not result.normal_known
    assert np.isnan(result.wrench.vector).tolist() == [False, False, True, True, True, False]
    off = np.abs(result.wrench.force_n[:2] - SHEAR_N)
    assert (off < 3 * result.wrench.standard_deviation[:2]).all()


def test_rest_gives_no_force(calibration) -> None:
    chain = pipeline(calibration)
    result = chain.process(frame(0.0, Look(noise=2.0, seed=77)).image)
    assert np.isfinite(result.field.force_n[:, :2]).all()
    assert np.abs(result.wrench.force_n[:2]).max() < 0.01
    assert result.field.contact.mean() < 0.01


def test_scatter_of_the_wrench_is_within_its_covariance(calibration) -> None:
    """The covariance counts errors that do not scatter: the reference's own, and the motion of
    markers round the contact that may be drift."""
    chain = pipeline(calibration)
    still = [frame(0.5, Look(noise=4.0, seed=300 + k)) for k in range(24)]
    found, sigma = [], []
    w = 0.5 * press().nodes_mm[:, 2]
    for seen in still:
        result = chain.process(seen.image, normal_mm=w)
        found.append(result.wrench.vector)
        sigma.append(result.wrench.standard_deviation)
    ratio = np.std(found, axis=0, ddof=1) / np.median(sigma, axis=0)
    assert ((ratio > 0.05) & (ratio < 1.3)).all(), ratio


@pytest.mark.parametrize("missing", [0.05, 0.5])
def test_missing_markers_are_lost_not_the_frame(calibration, missing) -> None:
    chain = pipeline(calibration)
    w = 0.6 * press().nodes_mm[:, 2]
    result = chain.process(frame(0.6, Look(noise=2.0, missing=missing, seed=9)).image, normal_mm=w)
    assert result.coverage == pytest.approx(1 - missing, abs=0.08)
    allowed = 0.03 if missing < 0.1 else 0.1
    assert result.wrench.force_n == pytest.approx([0.18, -0.12, -0.6], abs=allowed)


def test_broken_frames_are_flagged_and_the_stream_goes_on(calibration, frames) -> None:
    chain = pipeline(calibration)
    chain.process(frames[0].image)
    black = np.zeros_like(frames[0].image)
    for bad in (
        black,
        frames[0].image[:100],
        frames[0].image.astype(float),
        np.zeros((480, 640, 4), np.uint8),
        None,
    ):
        result = chain.process(bad)
        assert result.problems
        assert result.wrench is None
        assert result.field is None
    w = press().nodes_mm[:, 2]
    after = chain.process(frames[-1].image, normal_mm=w)
    assert after.index == 6
    assert after.wrench.force_n == pytest.approx([*SHEAR_N, -NORMAL_N], abs=0.03)


def test_unreadable_frames_are_counted(calibration) -> None:
    chain = pipeline(calibration)
    result = chain.unreadable("frame 0 is cut short", time_s=2.5)
    assert (result.index, result.time_s) == (0, 2.5)
    assert result.problems == ("frame 0 is cut short",)
    assert chain.process(frame(0.0).image).index == 1


def test_same_frames_give_the_same_bits(calibration, frames) -> None:
    first = last(pipeline(calibration), frames).field.force_n
    again = pipeline(calibration)
    last(again, frames)
    again.reset()
    assert last(again, frames).field.force_n.tobytes() == first.tobytes()


def test_neo_hookean_reads_more_normal_force_in_a_press(calibration, frames) -> None:
    """The frames come from a linear gel, so the nonlinear law asks for more force than truth."""
    result = last(pipeline(calibration, gel="neo_hookean"), frames)
    assert -1.4 < result.wrench.force_n[2] < -1.04


def test_stage_times_are_reported(calibration, frames) -> None:
    result = last(pipeline(calibration), frames)
    assert {"track", "displace", "interpolate", "force", "wrench"} <= set(result.stage_ms)


def test_wrong_bundle_is_refused(calibration) -> None:
    other = replace(sensor_bundle(), mesh=sensor_bundle().mesh)
    moved = replace(other.markers, positions_mm=np.asarray(other.markers.positions_mm) + 0.1)
    with pytest.raises(ValueError, match="geometry"):
        ForcePipeline(replace(other, markers=moved), calibration)


def test_importing_the_pipeline_loads_no_cad_and_no_vtk() -> None:
    code = (
        "import sys, gelslim_force.pipeline;"
        "bad = {'OCP', 'cadquery', 'vtk', 'vtkmodules', 'pyvista', 'cv2', 'matplotlib',"
        " 'gelslim_cad'} & set(sys.modules); sys.exit(', '.join(bad) or None)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class WrongPatch:
    """A source that takes a tenth of the pad for a deep contact."""

    def __init__(self, points_mm: np.ndarray, depth_mm: float) -> None:
        x, y = points_mm[:, 0] + 5.0, points_mm[:, 1]
        self._touched = np.hypot(x, y) < 3.0
        self._w = np.where(self._touched, -depth_mm, 0.0)

    def look(self, image, markers_px):
        return ContactPatch("disc", np.array([-5.0, 0.0]), 3.0)

    def motion(self, seen, lateral_mm=None):
        return NormalReading(self._w, 0 * self._w, self._touched, seen)


def test_a_patch_that_the_markers_contradict_gives_no_normal_force(calibration, frames) -> None:
    """The misfit does not show it: compensating for the false depth invents a motion to fit."""
    normal = WrongPatch(sensor_bundle().mesh.surface_mm, depth_mm=1.5)
    chain = ForcePipeline(sensor_bundle(), calibration, normal=normal)
    result = last(chain, frames, normal=False)
    assert result.field.misfit == 0.0
    assert not result.normal_known
    assert result.problems
    assert np.isnan(result.wrench.force_n[2])
    np.testing.assert_allclose(result.wrench.force_n[:2], SHEAR_N, atol=0.12)
