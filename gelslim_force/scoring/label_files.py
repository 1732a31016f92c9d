"""Labels of folders and of public data sets, as `ForceLabels`.

Besides the table of `gelslim_force.scoring.force_labels` are known:

- a folder of pictures with such a table in `forces.csv`; without a column that says when a line was
  measured, the lines belong to the pictures in order,
- a folder of samples `*.npy` as of FEATS (E. Helmut et al., arXiv 2411.03315): each a dictionary
  with the picture `gs_img`, the total forces `f_x`, `f_y`, `f_z` in N, and their distributions
  `grid_x`, `grid_y`, `grid_z`, whose sums the totals are,
- a table as of FeelAnyForce (A.-H. Shahidzadeh et al., arXiv 2410.02048): a column `tactile` with
  the path of the picture, and `FT` with six numbers, of which the first three are the force in N.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.files.csv_table import Row, number_of, read_csv_table
from gelslim_force.frames.frame import FrameSourceError
from gelslim_force.frames.picture import pictures_of
from gelslim_force.frames.sample_file import SampleError, is_sample, read_sample
from gelslim_force.outputs.wrench_csv import AXES
from gelslim_force.scoring.force_labels import KEYS, ForceLabels, Key, LabelError, read_labels

Array = NDArray[np.float64]
TABLE = "forces.csv"
"""Table of labels in a folder of pictures."""
TOTALS = ("f_x", "f_y", "f_z")
GRIDS = ("grid_x", "grid_y", "grid_z")
_TACTILE = {"tactile", "ft"}
_FORM = "give a table of labels, or a folder with " + TABLE + " or with samples"
_SAME = 0.02
"""Largest difference of a total from the sum of its grid, as a part of the largest total."""


def read_label_files(path: str | os.PathLike[str], key: Key | None = None) -> ForceLabels:
    """Read labels of any known layout.

    Args:
        path: A table, or a folder.
        key: What finds the frame of a label, where a table leaves the choice.

    Returns:
        The labels in their own axes.

    Raises:
        LabelError: The labels cannot be read, or have no such key.
    """
    place = Path(path)
    if not place.is_dir():
        head, rows = read_csv_table(place, _FORM, LabelError)
        return (
            _tactile_labels(place, rows, key) if set(head) >= _TACTILE else read_labels(path, key)
        )
    table = place / TABLE
    if table.is_file():
        return _folder_labels(place, table, key)
    if key not in (None, "picture"):
        raise LabelError(f"{place}: samples are found by picture, not by {key}")
    return _sample_labels(place)


def _folder_labels(folder: Path, table: Path, key: Key | None) -> ForceLabels:
    """Labels of the table in a folder of pictures."""
    head, rows = read_csv_table(table, _FORM, LabelError)
    named = [name for name in KEYS if name in head]
    given = [name for name in AXES if name in head]
    if named or not given:
        return read_labels(table, key)
    try:
        names = tuple(file.name for file in pictures_of(folder))
    except FrameSourceError as error:
        raise LabelError(str(error)) from error
    if key not in (None, "picture") or len(names) != len(rows):
        raise LabelError(
            f"{table}: it has {len(rows)} lines and no column {', '.join(KEYS)}, the folder has "
            f"{len(names)} pictures: without such a column each picture needs a line"
        )
    wrench = np.full((len(rows), 6), np.nan)
    for k, (where, row) in enumerate(rows):
        for axis in given:
            wrench[k, AXES.index(axis)] = number_of(where, row, axis, LabelError)
    return ForceLabels("picture", names, wrench)


def _sample_labels(folder: Path) -> ForceLabels:
    """Labels of the samples in a folder."""
    try:
        files = [file for file in pictures_of(folder) if is_sample(file)]
    except FrameSourceError as error:
        raise LabelError(f"{folder}: it has neither {TABLE} nor samples ({error})") from error
    if not files:
        raise LabelError(
            f"{folder}: it has neither {TABLE} nor samples .npy with {', '.join(TOTALS)}"
        )
    wrench = np.full((len(files), 6), np.nan)
    for k, file in enumerate(files):
        try:
            wrench[k, :3] = _totals(read_sample(file))
        except (SampleError, OSError) as error:
            raise LabelError(f"{file}: {error}") from error
    return ForceLabels("picture", tuple(file.name for file in files), wrench)


def _totals(sample: Mapping[str, Any]) -> Array:
    """Force (3,) of a sample, checked against its distribution. Raises SampleError."""
    lacking = [name for name in TOTALS if name not in sample]
    if lacking:
        raise SampleError(f"it has no {', '.join(lacking)}")
    try:
        force = np.array([float(np.asarray(sample[name]).reshape(())) for name in TOTALS])
    except (TypeError, ValueError) as error:
        raise SampleError(f"{', '.join(TOTALS)} must be numbers in N") from error
    if not np.isfinite(force).all():
        raise SampleError(f"{', '.join(TOTALS)} must be finite")
    if all(name in sample for name in GRIDS):
        sums = np.array([np.sum(np.asarray(sample[name], dtype=float)) for name in GRIDS])
        if not np.abs(sums - force).max() <= _SAME * max(float(np.abs(force).max()), 1e-3):
            raise SampleError(
                f"its forces {np.round(force, 4).tolist()} are not the sums of its grids "
                f"{np.round(sums, 4).tolist()}: were they scaled for training?"
            )
    return force


def _tactile_labels(place: Path, rows: list[tuple[str, Row]], key: Key | None) -> ForceLabels:
    """Labels of a table of pictures and forces; torques, whose unit is not stated, are NaN.

    Lines without a force are left out.
    """
    if key not in (None, "picture"):
        raise LabelError(f"{place}: its labels are found by picture, not by {key}")
    found: dict[str, list[float]] = {}
    for where, row in rows:
        if not row["ft"]:
            continue
        name = row["tactile"].replace("\\", "/").rpartition("/")[2]
        if not name or name in found:
            raise LabelError(f"{where}: tactile {row['tactile']!r} is missing or a picture twice")
        try:
            values = [float(part) for part in row["ft"].strip("[]").replace(",", " ").split()]
        except ValueError:
            values = []
        if len(values) != 6 or not np.isfinite(values).all():
            raise LabelError(f"{where}: FT = {row['ft']!r}: must be six numbers, the force first")
        found[name] = values[:3]
    if not found:
        raise LabelError(f"{place}: it has no line with a force")
    wrench = np.full((len(found), 6), np.nan)
    wrench[:, :3] = np.array(list(found.values()))
    return ForceLabels("picture", tuple(found), wrench)
