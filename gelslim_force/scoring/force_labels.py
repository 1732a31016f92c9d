"""Forces measured otherwise, such as by a force-torque sensor, from a CSV file.

The first line names the columns: `frame`, `picture`, `stamp_s` or `time_s` says when a line was
measured, and `fx_n`, `fy_n`, `fz_n`, `tx_nmm`, `ty_nmm`, `tz_nmm`, as many as are known, what. An
empty value is unknown; other columns are not read.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import GelslimError
from gelslim_core.files.csv_table import Row, number_of, read_csv_table
from gelslim_force.outputs.wrench_csv import AXES

Array = NDArray[np.float64]
Key = Literal["frame", "picture", "stamp_s", "time_s"]
KEYS: tuple[Key, ...] = get_args(Key)
_FORM = "the first line must name frame, picture, stamp_s or time_s, and some of " + ", ".join(AXES)
_USUAL_GAP = 1.5
"""Largest gap between labels over the usual one across which they are interpolated."""


class LabelError(GelslimError, ValueError):
    """Labels that cannot be used."""


@dataclass(frozen=True, eq=False)
class ForceLabels:
    """Labels in the frame of the gel.

    Attributes:
        key: What says when a label was measured.
        at: (n,) the key's values; numbers, or names of pictures.
        wrench: (n, 6) force on the gel in N, torque about the origin in N mm; NaN where unknown.
    """

    key: Key
    at: NDArray[np.float64] | tuple[str, ...]
    wrench: Array

    def turned(self, axes: SignedAxes, origin_mm: Array | None = None) -> ForceLabels:
        """The labels of a sensor with other axes, whose torques are about another point.

        Args:
            axes: Its axes.
            origin_mm: (3,) that point in the frame of the gel; the origin if None.
        """
        force, torque = (axes.turned(part) for part in (self.wrench[:, :3], self.wrench[:, 3:]))
        if origin_mm is not None:
            torque = torque + np.cross(origin_mm, force)
        return ForceLabels(self.key, self.at, np.hstack([force, torque]))

    def of_frames(self, frames: Array) -> Array:
        """(m, 6) labels of frames by the numbers (m,) that `frame` means; NaN without one."""
        found = np.full((len(frames), 6), np.nan)
        row = {float(number): k for k, number in enumerate(self.at)}
        for k, frame in enumerate(frames.tolist()):
            if frame in row:
                found[k] = self.wrench[row[frame]]
        return found

    def of_pictures(self, names: tuple[str, ...]) -> Array:
        """(m, 6) labels of pictures by their names (m,); NaN without one."""
        row = {name: k for k, name in enumerate(self.at)}
        found = np.full((len(names), 6), np.nan)
        for k, name in enumerate(names):
            if name in row:
                found[k] = self.wrench[row[name]]
        return found

    def of_times(self, times_s: Array, delay_s: float = 0.0) -> Array:
        """(m, 6) labels at times (m,), linear between neighbours that are not far apart.

        Args:
            times_s: Times of the frames, by the clock of the labels.
            delay_s: Time by which the labels' clock is late.
        """
        at = np.asarray(self.at, dtype=float) - delay_s
        found = np.full((len(times_s), 6), np.nan)
        order = np.argsort(at)
        at, wrench = at[order], self.wrench[order]
        if len(at) < 2:
            return found
        most = _USUAL_GAP * float(np.median(np.diff(at)))
        later = np.clip(np.searchsorted(at, times_s), 1, len(at) - 1)
        gap = at[later] - at[later - 1]
        share = (times_s - at[later - 1]) / np.maximum(gap, 1e-12)
        # A frame that belongs to a label may be off by rounding.
        inside = (share > -1e-6) & (share < 1 + 1e-6) & (gap <= most)
        share = share[inside, None]
        before, after = wrench[later[inside] - 1], wrench[later[inside]]
        between = before + share * (after - before)
        found[inside] = np.where(share <= 1e-6, before, np.where(share >= 1 - 1e-6, after, between))
        return found


@dataclass(frozen=True)
class SignedAxes:
    """Which axis of the labels, with which sign, is each axis of the gel.

    Torques turn as forces do. A sensor that reports the force of the gel on the object has all
    three signs changed.

    Attributes:
        source: Number of the labels' axis, for x, y and z of the gel.
        sign: +1 or -1.
    """

    source: tuple[int, int, int] = (0, 1, 2)
    sign: tuple[int, int, int] = (1, 1, 1)

    @classmethod
    def parse(cls, text: str) -> SignedAxes:
        """From a text such as `-y,x,z`. Raises LabelError for another form."""
        parts = [part.strip().lower() for part in text.split(",")]
        names = [part.lstrip("+-") for part in parts]
        signs = [part[: len(part) - len(name)] for part, name in zip(parts, names, strict=True)]
        if sorted(names) != ["x", "y", "z"] or not set(signs) <= {"", "+", "-"}:
            raise LabelError(
                f"axes {text!r}: must name the labels' axes that are x, y and z of the gel, such "
                "as x,y,z or -y,x,z"
            )
        x, y, z = ("xyz".index(name) for name in names)
        by_x, by_y, by_z = (-1 if sign == "-" else 1 for sign in signs)
        return cls((x, y, z), (by_x, by_y, by_z))

    def turned(self, vectors: Array) -> Array:
        """Vectors (n, 3) of the labels along the axes of the gel."""
        return np.asarray(vectors[:, self.source] * np.array(self.sign, dtype=float))


def read_labels(path: str | os.PathLike[str], key: Key | None = None) -> ForceLabels:
    """Read a table of labels.

    Args:
        path: CSV file as described in the module, separated by commas, semicolons or tabs.
        key: Column that says when a line was measured; by default the first there is of frame,
            picture, stamp_s and time_s.

    Returns:
        The labels in the order of the file, in their own axes.

    Raises:
        LabelError: The file cannot be read, a column is missing, a value is no number, or two
            lines are of the same frame. The message names the file and the line.
    """
    place = Path(path)
    head, rows = read_csv_table(place, _FORM, LabelError)
    keys = [name for name in KEYS if name in head]
    if not keys or not set(AXES) & set(head):
        raise LabelError(f"{place}, line 1: columns {', '.join(head)}: {_FORM}")
    if key is not None and key not in keys:
        raise LabelError(f"{place}, line 1: no column {key}; there is {', '.join(keys)}")
    chosen = key or keys[0]
    wrench = np.full((len(rows), 6), np.nan)
    found: dict[str | float, str] = {}
    for k, (where, row) in enumerate(rows):
        at = _key(where, row, chosen)
        if at in found:
            raise LabelError(f"{where}: {chosen} {row[chosen]} is in {found[at]} too")
        found[at] = where
        for axis in set(AXES) & set(head):
            wrench[k, AXES.index(axis)] = number_of(where, row, axis, LabelError)
    if not rows:
        raise LabelError(f"{place}: it has no line of labels; {_FORM}")
    names = tuple(map(str, found))
    return ForceLabels(
        chosen, names if chosen == "picture" else np.array(list(found), float), wrench
    )


def _key(where: str, row: Row, key: Key) -> str | float:
    if key == "picture":
        value: str | float = row[key]
        known = bool(value)
    else:
        value = number_of(where, row, key, LabelError)
        known = bool(np.isfinite(value))
    if not known:
        raise LabelError(f"{where}: {key} is missing")
    return value
