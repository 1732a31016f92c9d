"""Tracks of a run in pixels, collected frame by frame; written as a NumPy file and a table."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import disk_error
from gelslim_core.files.replaced_file import replacement
from gelslim_force.dot_tracking import DotsAtRest
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.tracking.tracks import MarkerStatus

COLUMNS = (
    "index", "time_s", "stamp_s", "sensor_s",
    "coverage", "tracked", "predicted", "lost", "rejected",
    "median_displacement_px", "largest_displacement_px", "problem",
)  # fmt: skip
_NO_TRACKS = 255
"""Status of all markers in a frame without tracks."""


class TrackRecord:
    """Collects f frames of n markers; positions have single precision, 1e-4 px or better."""

    def __init__(self, rest: DotsAtRest) -> None:
        self._rest = rest
        self._places: list[NDArray[np.float32]] = []
        self._status: list[NDArray[np.uint8]] = []
        self._index: list[int] = []
        self._times_s: list[tuple[float, float, float]] = []
        """By the three clocks of `FrameResult`; NaN where unknown."""
        self._problems: list[str] = []

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._index)

    def take(self, result: FrameResult) -> None:
        """Add the tracks or the problems of a frame."""
        count = len(self._rest.reference)
        tracks = result.tracks
        if tracks is None:
            self._places.append(np.full((count, 2), np.nan, dtype=np.float32))
            self._status.append(np.full(count, _NO_TRACKS, dtype=np.uint8))
        else:
            self._places.append(tracks.positions_px.astype(np.float32))
            self._status.append(tracks.status.astype(np.uint8))
        self._index.append(result.index)
        stamps = [np.nan if t is None else t for t in (result.stamp_s, result.sensor_s)]
        self._times_s.append((result.time_s, stamps[0], stamps[1]))
        self._problems.append("; ".join(result.problems))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the NumPy file.

        places_px and displacement_px (f, n, 2) float32, NaN where unknown; status (f, n) uint8,
        values of `MarkerStatus`, 255 where a frame has no tracks; coverage (f,); frame_index
        (f,); time_s, stamp_s and sensor_s (f,), NaN where unknown; sites (n, 2) row and column;
        rest_px (n, 2).
        """
        count, rest = len(self._rest.reference), self._rest.reference.positions_px
        places = np.array(self._places, dtype=np.float32).reshape(-1, count, 2)
        status = np.array(self._status, dtype=np.uint8).reshape(-1, count)
        times_s = np.array(self._times_s, dtype=np.float64).reshape(-1, 3)
        return {
            "places_px": places,
            "displacement_px": (places - rest).astype(np.float32),
            "status": status,
            "coverage": (status == int(MarkerStatus.TRACKED)).mean(axis=1),
            "frame_index": np.array(self._index, dtype=np.int64),
            "time_s": times_s[:, 0],
            "stamp_s": times_s[:, 1],
            "sensor_s": times_s[:, 2],
            "sites": self._rest.reference.sites,
            "rest_px": rest,
        }

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the compressed NumPy file (.npz) atomically. Raises OutputError."""
        target = Path(path)
        try:
            with replacement(target, parents=True) as stream:
                np.savez_compressed(stream, **self.arrays())  # type: ignore[arg-type]
        except OSError as error:
            raise disk_error(target, "writing the tracks", error) from error

    def table(self) -> bytes:
        """Return the CSV file: a header, then a line per frame."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(COLUMNS)
        for k, status in enumerate(self._status):
            moved, counts = self._moved(k), np.bincount(status, minlength=4)[:4].tolist()
            writer.writerow(
                [
                    self._index[k],
                    *(repr(float(t)) for t in self._times_s[k]),
                    f"{counts[0] / len(status):.4f}",
                    *counts,
                    f"{np.median(moved):.4f}" if len(moved) else "nan",
                    f"{moved.max():.4f}" if len(moved) else "nan",
                    self._problems[k],
                ]
            )
        return text.getvalue().encode("utf-8", "backslashreplace")

    def summary(self) -> dict[str, Any]:
        """Return a summary of the run as JSON values."""
        rest, settings = self._rest, self._rest.settings
        read = [k for k, s in enumerate(self._status) if s[0] != _NO_TRACKS]
        seen = [float((self._status[k] == int(MarkerStatus.TRACKED)).mean()) for k in read]
        peaks = [float(m.max()) for m in (self._moved(k) for k in read) if len(m)]
        return {
            "markers": len(rest.reference),
            "lattice_shape": list(rest.lattice_shape),
            "dots_found_at_rest": rest.found,
            "on_lattice": len(rest.reference) / rest.found,
            "pitch_px": rest.pitch_px,
            "lattice_residual_px": None if np.isnan(rest.residual_px) else rest.residual_px,
            "detector": {
                "smallest_diameter_px": settings.smallest_diameter_px,
                "largest_diameter_px": settings.largest_diameter_px,
                "least_contrast": settings.least_contrast,
                "shape": settings.shape,
            },
            "frames": len(self),
            "frames_without_tracks": len(self) - len(read),
            "coverage": {
                "median": float(np.median(seen)) if seen else None,
                "least": min(seen) if seen else None,
            },
            "largest_displacement_px": max(peaks) if peaks else None,
            "frame_coverage": [
                round(float((s == int(MarkerStatus.TRACKED)).mean()), 4) for s in self._status
            ],
            "problems": {
                str(self._index[k]): text for k, text in enumerate(self._problems) if text
            },
        }

    def _moved(self, k: int) -> NDArray[np.float64]:
        """Lengths in px of the displacements of the markers that were seen in the k-th frame."""
        seen = self._status[k] == int(MarkerStatus.TRACKED)
        return np.hypot(*(self._places[k][seen] - self._rest.reference.positions_px[seen]).T)
