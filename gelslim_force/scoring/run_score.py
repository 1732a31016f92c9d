"""How far the forces of a run are from those measured otherwise, and whether its σ holds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_core.errors import OutputError
from gelslim_force.frames.frame import FrameSourceError
from gelslim_force.frames.picture import pictures_of
from gelslim_force.outputs.recorded_run import RecordedRun, read_run
from gelslim_force.outputs.run_recorder import WRENCHES
from gelslim_force.outputs.wrench_csv import AXES, WrenchTable, read_wrenches
from gelslim_force.scoring.force_labels import ForceLabels, LabelError

Array = NDArray[np.float64]
LEAST_FORCE_N, LEAST_TORQUE_NMM = 0.2, 2.0
"""Sizes of a label from which its relative error counts."""
WIDTH_95 = 1.96
_FEWEST_FOR_SLOPE = 3


@dataclass(frozen=True)
class AxisScore:
    """Errors along one axis, found minus label; NaN where too few frames tell.

    Attributes:
        axis: Column of the table of wrenches, such as `fx_n`.
        frames: Frames with a label and a value.
        unknown: Frames with a label and without a value.
        rms: Root mean square error in N or N mm.
        median: Median of the error's size.
        most: Its 95th percentile.
        bias: Mean error.
        share: Median of the error's size over that of the label, where the label is large.
        slope: Of the values over the labels, by least squares with an offset.
        z_rms: Root mean square of the error over the standard deviation that the run states.
        within_95: Share of the frames within 1.96 of these.
    """

    axis: str
    frames: int
    unknown: int
    rms: float
    median: float
    most: float
    bias: float
    share: float
    slope: float
    z_rms: float
    within_95: float


@dataclass(frozen=True, eq=False)
class RunScore:
    """Scores of a run.

    Attributes:
        frames: Frames of the run.
        labelled: Frames of them with a label of at least one axis.
        axes: Of the axes that have labels.
        force_share: Median of |error| / |label| of the force, where all of it is known and large.
        median_ms: Median time of a frame, NaN if it was not recorded.
        most_ms: Its 95th percentile.
        warning: Why few frames have a label; empty if at least half of them do.
        found: (n, 6) wrenches of the labelled frames.
        sigma: (n, 6) their standard deviations.
        label: (n, 6) their labels.
    """

    frames: int
    labelled: int
    axes: tuple[AxisScore, ...]
    force_share: float
    median_ms: float
    most_ms: float
    warning: str
    found: Array
    sigma: Array
    label: Array

    def record(self) -> dict[str, Any]:
        """The scores as plain values."""
        return {
            "frames": self.frames,
            "labelled": self.labelled,
            "axes": [asdict(axis) for axis in self.axes],
            "force_share": self.force_share,
            "median_ms": self.median_ms,
            "most_ms": self.most_ms,
            "warning": self.warning,
        }


def score_run(place: str | os.PathLike[str], labels: ForceLabels, delay_s: float = 0.0) -> RunScore:
    """Compare a run with labels.

    Args:
        place: Folder of a run, or its `wrenches.csv` alone.
        labels: The labels in the frame of the gel.
        delay_s: Time by which the labels' clock is late, for labels by time.

    Returns:
        The scores.

    Raises:
        OutputError: There is no run.
        LabelError: No frame has a label.
    """
    path = Path(place)
    run = None if path.is_file() else read_run(path)
    table = read_wrenches(path) if run is None else run.wrenches
    label = _of_frames(labels, table, run, delay_s)
    has = np.isfinite(label).any(axis=1)
    if not has.any():
        raise LabelError(_NONE[labels.key].format(run=path, span=_span(table, labels)))
    found, sigma, label = table.wrench[has], table.sigma[has], label[has]
    times = _times_ms({} if run is None else run.stage_ms)
    return RunScore(
        frames=len(table),
        labelled=int(has.sum()),
        axes=tuple(
            axis_score(axis, found[:, k], sigma[:, k], label[:, k])
            for k, axis in enumerate(AXES)
            if np.isfinite(label[:, k]).any()
        ),
        force_share=_force_share(found[:, :3], label[:, :3]),
        median_ms=float(np.median(times)) if len(times) else float("nan"),
        most_ms=float(np.percentile(times, 95)) if len(times) else float("nan"),
        warning="" if 2 * has.sum() >= len(table) else _few(table, labels, int(has.sum())),
        found=found,
        sigma=sigma,
        label=label,
    )


def axis_score(axis: str, found: Array, sigma: Array, label: Array) -> AxisScore:
    """Errors of values (n,) with standard deviations (n,) against labels (n,)."""
    both = np.isfinite(found) & np.isfinite(label)
    error, true = (found - label)[both], label[both]
    size = np.abs(error)
    large = np.abs(true) >= (LEAST_FORCE_N if axis.endswith("_n") else LEAST_TORQUE_NMM)
    told = sigma[both] > 0
    z = error[told] / sigma[both][told]
    varied = len(true) >= _FEWEST_FOR_SLOPE and np.ptp(true) > 0
    nan = float("nan")
    return AxisScore(
        axis=axis,
        frames=int(both.sum()),
        unknown=int((np.isfinite(label) & ~np.isfinite(found)).sum()),
        rms=float(np.sqrt(np.mean(error**2))) if len(error) else nan,
        median=float(np.median(size)) if len(error) else nan,
        most=float(np.percentile(size, 95)) if len(error) else nan,
        bias=float(error.mean()) if len(error) else nan,
        share=float(np.median(size[large] / np.abs(true[large]))) if large.any() else nan,
        slope=float(np.polyfit(true, found[both], 1)[0]) if varied else nan,
        z_rms=float(np.sqrt(np.mean(z**2))) if len(z) else nan,
        within_95=float(np.mean(np.abs(z) <= WIDTH_95)) if len(z) else nan,
    )


_NONE: Mapping[str, str] = {
    "frame": "{run}: no frame has a label; {span}",
    "picture": "{run}: no picture has a label; the names must be those of the folder of the run",
    "stamp_s": "{run}: no frame has a label at its time; {span}; --delay-s moves the labels",
    "time_s": "{run}: no frame has a label at its time; {span}; --delay-s moves the labels, and "
    "`gelslim force --rate` gives pictures their times",
}


def _of_frames(
    labels: ForceLabels, table: WrenchTable, run: RecordedRun | None, delay_s: float
) -> Array:
    if labels.key == "frame":
        return labels.of_frames(table["index"])
    if labels.key == "picture":
        return labels.of_pictures(_pictures(table, run))
    return labels.of_times(table[labels.key], delay_s)


def _pictures(table: WrenchTable, run: RecordedRun | None) -> tuple[str, ...]:
    """Names of the pictures (n,) of a run, from the folder that it was made of."""
    if run is None:
        raise LabelError(f"{WRENCHES} alone does not tell the names of pictures: give its folder")
    source = str(run.manifest.get("settings", {}).get("frames", ""))
    try:
        names = [picture.name for picture in pictures_of(Path(source))]
    except FrameSourceError as error:
        raise LabelError(
            f"{run.folder}: its pictures {source!r} cannot be listed: give labels by frame"
        ) from error
    index = table["index"].astype(int)
    if len(index) and index.max() >= len(names):
        raise OutputError(
            f"{run.folder}: the run has frame {index.max()} and {source} has {len(names)} pictures "
            "now: give labels by frame"
        )
    return tuple(names[k] for k in index)


def _few(table: WrenchTable, labels: ForceLabels, labelled: int) -> str:
    why = "" if labels.key == "picture" else f": {_span(table, labels)}"
    return f"only {labelled} of {len(table)} frames have a label{why}"


def _span(table: WrenchTable, labels: ForceLabels) -> str:
    key = "index" if labels.key == "frame" else labels.key
    of_run, of_labels = table[key], np.asarray(labels.at, dtype=float)
    if not np.isfinite(of_run).any():
        return f"the run has no {labels.key}"
    return (
        f"the run has {labels.key} {np.nanmin(of_run):.6g} to {np.nanmax(of_run):.6g}, the labels "
        f"{of_labels.min():.6g} to {of_labels.max():.6g}"
    )


def _times_ms(stage_ms: Mapping[int, Mapping[str, float]]) -> Array:
    return np.array([sum(stages.values()) for stages in stage_ms.values()], dtype=float)


def _force_share(found: Array, label: Array) -> float:
    error, size = (np.linalg.norm(v, axis=1) for v in (found - label, label))
    large = (size >= LEAST_FORCE_N) & np.isfinite(error)
    return float(np.median(error[large] / size[large])) if large.any() else float("nan")
