"""Scores of runs, against errors and deviations that are drawn."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from gelslim_force.outputs.wrench_csv import AXES, NUMBERS, header
from gelslim_force.scoring.force_labels import ForceLabels, LabelError
from gelslim_force.scoring.run_score import axis_score, score_run
from gelslim_force.scoring.score_figure import score_figure

COUNT = 400


def test_scores_are_those_of_the_drawn_errors() -> None:
    rng = np.random.default_rng(4)
    label = rng.uniform(-3, -0.5, COUNT)
    sigma = np.full(COUNT, 0.1)
    found = 0.02 + 1.1 * label + rng.normal(0, 0.1, COUNT)
    found[:5] = np.nan
    score = axis_score("fz_n", found, sigma, label)
    error = (found - label)[5:]
    assert (score.frames, score.unknown) == (COUNT - 5, 5)
    assert score.slope == pytest.approx(1.1, abs=4 * 0.1 / np.sqrt(COUNT) / label.std())
    assert score.bias == pytest.approx(error.mean())
    assert score.rms == pytest.approx(np.sqrt((error**2).mean()))
    assert score.z_rms == pytest.approx(10 * score.rms)
    assert score.share == pytest.approx(np.median(np.abs(error / label[5:])))


def test_deviations_that_hold_are_seen_to_hold() -> None:
    rng = np.random.default_rng(5)
    label, sigma = rng.uniform(-1, 1, 4000), rng.uniform(0.01, 0.1, 4000)
    score = axis_score("fx_n", label + sigma * rng.normal(size=4000), sigma, label)
    assert score.z_rms == pytest.approx(1.0, abs=0.04)
    assert score.within_95 == pytest.approx(0.95, abs=0.015)


def test_what_few_frames_do_not_tell_is_not_a_number() -> None:
    score = axis_score("fx_n", np.array([0.1]), np.array([0.0]), np.array([0.1]))
    assert score.rms == 0.0
    assert np.isnan([score.share, score.slope, score.z_rms, score.within_95]).all()


def run_of(folder: Path, wrench: np.ndarray) -> Path:
    numbers = np.full((len(wrench), len(NUMBERS)), np.nan)
    numbers[:, NUMBERS.index("index")] = np.arange(len(wrench))
    numbers[:, NUMBERS.index("time_s")] = 0.1 * np.arange(len(wrench))
    for k, axis in enumerate(AXES):
        numbers[:, NUMBERS.index(axis)] = wrench[:, k]
        numbers[:, NUMBERS.index(f"sigma_{axis}")] = 0.05
    lines = [",".join(repr(float(v)) for v in row) + ",\n" for row in numbers]
    path = folder / "wrenches.csv"
    path.write_text(header() + "".join(lines))
    return path


def test_frames_are_found_by_number_and_by_time(tmp_path: Path) -> None:
    wrench = np.arange(60.0).reshape(10, 6)
    path = run_of(tmp_path, wrench)
    by_number = ForceLabels("frame", np.array([7.0, 2.0]), wrench[[7, 2]] - 0.5)
    score = score_run(path, by_number)
    assert (score.frames, score.labelled) == (10, 2)
    assert [axis.bias for axis in score.axes] == pytest.approx([0.5] * 6)
    assert score.warning
    by_time = ForceLabels("time_s", 0.1 * np.arange(10) + 0.05, wrench + 3.0)
    score = score_run(path, by_time)
    # Between two frames the labels are half a step of 6 further.
    assert score.labelled == 9
    assert [axis.rms for axis in score.axes] == pytest.approx([0.0] * 6, abs=1e-9)
    assert not score.warning


@pytest.mark.slow
def test_the_figure_has_a_plot_for_each_axis(tmp_path: Path) -> None:
    wrench = np.arange(60.0).reshape(10, 6)
    score = score_run(run_of(tmp_path, wrench), ForceLabels("frame", np.arange(10.0), wrench))
    picture = cv2.imdecode(np.frombuffer(score_figure(score), np.uint8), cv2.IMREAD_COLOR)
    thirds = np.array_split(picture, 3, axis=1)
    assert all((part < 128).any() for third in thirds for part in np.array_split(third, 2))


def test_labels_of_other_frames_are_refused(tmp_path: Path) -> None:
    path = run_of(tmp_path, np.zeros((4, 6)))
    for labels in (
        ForceLabels("frame", np.array([99.0]), np.zeros((1, 6))),
        ForceLabels("stamp_s", np.array([99.0, 100.0]), np.zeros((2, 6))),
        ForceLabels("picture", ("a.png",), np.zeros((1, 6))),
    ):
        with pytest.raises(LabelError):
            score_run(path, labels)
