"""Labels of forces: their file, their axes, and the frames they belong to."""

from pathlib import Path

import numpy as np
import pytest

from gelslim_force.scoring.force_labels import (
    ForceLabels,
    LabelError,
    SignedAxes,
    read_labels,
)


def written(folder: Path, text: str) -> Path:
    path = folder / "labels.csv"
    path.write_text(text)
    return path


def test_a_table_is_read_with_its_gaps(tmp_path: Path) -> None:
    labels = read_labels(written(tmp_path, "time_s;fz_n;FX_N;note\n0.5;-1.25;;a\n0.0;-1;0.5;b\n"))
    assert labels.key == "time_s"
    np.testing.assert_array_equal(labels.at, [0.5, 0.0])
    np.testing.assert_array_equal(labels.wrench[:, 2], [-1.25, -1.0])
    assert np.isnan(labels.wrench[0, 0])
    assert labels.wrench[1, 0] == 0.5
    assert np.isnan(labels.wrench[:, 3:]).all()


def test_the_key_is_chosen_where_there_are_several(tmp_path: Path) -> None:
    path = written(tmp_path, "time_s,frame,fz_n\n0.1,3,-1\n0.2,4,-2\n")
    assert read_labels(path).key == "frame"
    np.testing.assert_array_equal(read_labels(path, "time_s").at, [0.1, 0.2])
    with pytest.raises(LabelError):
        read_labels(path, "picture")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "frame,force\n1,2\n",
        "fz_n\n1\n",
        "frame,fz_n\n",
        "frame,fz_n\n1\n",
        "frame,fz_n\n,1\n",
        "frame,fz_n\n1,two\n",
        "frame,fz_n\n1,inf\n",
        "frame,fz_n\n1,2\n1,3\n",
        "picture,fz_n\na.png,2\na.png,3\n",
    ],
)
def test_impossible_tables_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(LabelError):
        read_labels(written(tmp_path, text))


def test_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LabelError):
        read_labels(tmp_path / "none.csv")


@pytest.mark.parametrize("text", ["x,y", "x,x,z", "x,y,w", "--x,y,z", "x y z", ""])
def test_impossible_axes_are_refused(text: str) -> None:
    with pytest.raises(LabelError):
        SignedAxes.parse(text)


def test_torques_about_another_point_in_other_axes() -> None:
    """A force of 3 N along the labels' x, which is our -y, at a point that is known."""
    force, at_mm, origin_mm = np.array([0.0, -3.0, 0.0]), np.array([4.0, 1, 2]), [0.0, 0, -30]
    about_sensor = np.cross(at_mm - origin_mm, force)
    axes = SignedAxes.parse("y,-x,z")
    # The labels' x is our -y, their y our x.
    of_labels = np.hstack([v[[1, 0, 2]] * [-1, 1, 1] for v in (force, about_sensor)])
    turned = ForceLabels("frame", np.zeros(1), of_labels[None]).turned(axes, np.array(origin_mm))
    np.testing.assert_allclose(turned.wrench[0], [*force, *np.cross(at_mm, force)], atol=1e-12)


def test_labels_between_frames_are_interpolated_and_gaps_are_not() -> None:
    at = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 1.1])
    wrench = np.zeros((6, 6))
    wrench[:, 2] = -at
    wrench[2, 0] = np.nan
    labels = ForceLabels("time_s", at[::-1].copy(), wrench[::-1].copy())
    times = np.array([0.05, 0.1, 0.15, 0.2, 0.6, 1.05, 1.2, -0.1])
    found = labels.of_times(times)
    expected = np.where([True, True, True, True, False, True, False, False], -times, np.nan)
    np.testing.assert_allclose(found[:, 2], expected)
    np.testing.assert_array_equal(np.isnan(found[:4, 0]), [False, False, True, True])
    late = ForceLabels("time_s", at + 0.04, wrench)
    np.testing.assert_allclose(late.of_times(times, delay_s=0.04)[:, 2], expected, atol=1e-9)
