"""Labels of folders and of the layouts of public data sets, on small files made here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gelslim_force.scoring.force_labels import LabelError
from gelslim_force.scoring.label_files import read_label_files

PICTURE = np.full((24, 32, 3), 90, dtype=np.uint8)


def sample(force: tuple[float, float, float], **changes: Any) -> dict[str, Any]:
    """A sample with the force spread over some cells of its grids."""
    share = np.random.default_rng(3).dirichlet(np.ones(24 * 32)).reshape(24, 32)
    grids = {f"grid_{axis}": share * f for axis, f in zip("xyz", force, strict=True)}
    totals = {f"f_{axis}": np.float64(f) for axis, f in zip("xyz", force, strict=True)}
    return {"gs_img": PICTURE, **grids, **totals, **changes}


def write_samples(folder: Path, *samples: dict[str, Any]) -> Path:
    for k, one in enumerate(samples):
        np.save(folder / f"ball_{k + 1}.npy", one, allow_pickle=True)
    return folder


def test_samples_have_their_total_forces(tmp_path: Path) -> None:
    forces = [(0.1, -0.2, -1.5), (0.0, 0.0, -0.4)]
    labels = read_label_files(write_samples(tmp_path, *map(sample, forces)))
    assert labels.key == "picture"
    assert labels.at == ("ball_1.npy", "ball_2.npy")
    np.testing.assert_allclose(labels.wrench[:, :3], forces)
    assert np.isnan(labels.wrench[:, 3:]).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"f_z": np.float64(-0.7)},
        {"f_x": "much"},
        {"f_y": np.float64(np.nan)},
        {"f_x": np.ones(3)},
    ],
)
def test_samples_whose_forces_cannot_be_right_are_refused(
    tmp_path: Path, wrong: dict[str, Any]
) -> None:
    write_samples(tmp_path, sample((0.1, -0.2, -1.5), **wrong))
    with pytest.raises(LabelError) as refused:
        read_label_files(tmp_path)
    assert "ball_1.npy" in str(refused.value)


def test_samples_without_forces_and_folders_without_labels_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LabelError):
        read_label_files(tmp_path)
    np.save(tmp_path / "plain.npy", PICTURE)
    with pytest.raises(LabelError):
        read_label_files(tmp_path)
    np.save(tmp_path / "a.npy", {"gs_img": PICTURE}, allow_pickle=True)
    with pytest.raises(LabelError):
        read_label_files(tmp_path)


def test_samples_are_found_by_picture_alone(tmp_path: Path) -> None:
    write_samples(tmp_path, sample((0.1, -0.2, -1.5)))
    assert read_label_files(tmp_path, "picture").key == "picture"
    with pytest.raises(LabelError):
        read_label_files(tmp_path, "time_s")


def test_a_table_of_pictures_and_forces(tmp_path: Path) -> None:
    table = tmp_path / "set.csv"
    table.write_text(
        "tactile,depth,FT\n"
        "records/ball/tactile/174.png,records/ball/depth/174.npy,0.5 -0.25 -3.0 0.1 0.2 0.3\n"
        "records/ball/tactile/175.png,records/ball/depth/175.npy,\n"
        'records/ball/tactile/176.png,records/ball/depth/176.npy,"[0.0, 1.0, -2.0, 0, 0, 0]"\n'
    )
    labels = read_label_files(table)
    assert labels.at == ("174.png", "176.png")
    np.testing.assert_array_equal(labels.wrench[:, :3], [[0.5, -0.25, -3.0], [0.0, 1.0, -2.0]])
    assert np.isnan(labels.wrench[:, 3:]).all()


@pytest.mark.parametrize(
    "line", ["a/1.png,1 2 3", "a/1.png,1 2 three 4 5 6", "a/,1 2 3 4 5 6", "a/1.png,1 2 inf 4 5 6"]
)
def test_lines_that_cannot_be_read_are_named(tmp_path: Path, line: str) -> None:
    table = tmp_path / "set.csv"
    table.write_text(f"tactile,FT\nb/0.png,1 2 3 4 5 6\n{line}\n")
    with pytest.raises(LabelError) as refused:
        read_label_files(table)
    assert "line 3" in str(refused.value)


def test_a_picture_has_one_line(tmp_path: Path) -> None:
    table = tmp_path / "set.csv"
    table.write_text("tactile,FT\na/0.png,1 2 3 4 5 6\nb/0.png,1 2 3 4 5 6\n")
    with pytest.raises(LabelError):
        read_label_files(table)


def test_a_folder_with_a_table(tmp_path: Path) -> None:
    for k in (1, 2, 10):
        np.save(tmp_path / f"frame{k}.npy", PICTURE)
    table = tmp_path / "forces.csv"
    table.write_text("fx_n,fz_n\n1,-1\n2,-2\n10,-10\n")
    labels = read_label_files(tmp_path)
    assert labels.at == ("frame1.npy", "frame2.npy", "frame10.npy")
    np.testing.assert_array_equal(labels.wrench[:, 0], [1, 2, 10])
    table.write_text("frame,fz_n\n1,-1\n2,-2\n")
    assert read_label_files(tmp_path).key == "frame"
    table.write_text("fx_n,fz_n\n1,-1\n2,-2\n")
    with pytest.raises(LabelError):
        read_label_files(tmp_path)


def test_other_tables_are_read_as_before(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text("time_s,fz_n\n0.5,-1\n")
    labels = read_label_files(table)
    assert labels.key == "time_s"
    np.testing.assert_array_equal(labels.wrench[:, 2], [-1.0])
