"""A run as a recording for the Rerun viewer: picture, markers, deformed gel, forces over time.

Entities: `camera/picture`, `camera/markers` and `camera/motion` in pixels; `gel/surface`,
`gel/force` and `gel/resultant` in mm, in the frame of the gel, and `gel/finger` if its model is
given; `wrench/...` in N and N mm with the limits of 1.96 standard deviations; `problems`.
Timelines: `frame`, `time` since the first frame and, where frames are stamped, `stamp`.
"""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from gelslim_core import optional_library
from gelslim_core.errors import OutputError, disk_error
from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.forces.wrench import Wrench
from gelslim_force.outputs.canvas import encoded
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

Array = NDArray[np.float64]
NODE_MM_PER_N, SUM_MM_PER_N = 50.0, 4.0
"""Lengths of the arrows at the nodes, and of their sum."""
WIDTH_95 = 1.96
_GLASS = (255, 255, 255, 40)
"""The finger is seen through, or its gel would hide the dent."""
_EYE_MM = (12.0, -26.0, 30.0)
"""From the side and above, with the tip to the right."""
_QUALITY = 85
_PARTS = ("fx_n", "fy_n", "fz_n", "tx_nmm", "ty_nmm", "tz_nmm")
_NAMES = ("Fx, N", "Fy, N", "Fz, N", "Tx, N mm", "Ty, N mm", "Tz, N mm")
_LINE, _LIMIT = (31, 90, 150), (155, 184, 214)
_STATUS = {
    MarkerStatus.TRACKED: (60, 180, 90),
    MarkerStatus.PREDICTED: (240, 180, 40),
    MarkerStatus.LOST: (220, 60, 50),
    MarkerStatus.REJECTED: (160, 80, 200),
}
_FROM_GLTF = np.array([[1e3, 0, 0], [0, 0, -1e3], [0, 1e3, 0]])
"""From metres with y upwards, as in the models of fingers, to the frame of the gel in mm."""


class RerunLog(AbstractContextManager["RerunLog"]):
    """Writes frames to a recording, which gets its name when it is whole."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        rest_px: Array,
        finger: str | os.PathLike[str] | None = None,
    ) -> None:
        """Start a recording.

        Args:
            path: The file to write; its name ends in .rrd. An earlier one is replaced.
            rest_px: (n, 2) markers at rest.
            finger: Model of the finger, .glb, to be shown around the gel.

        Raises:
            OutputError: The file cannot be made.
            MissingLibraryError: rerun-sdk is not installed.
        """
        self._rr = optional_library.load("rerun", "a recording for the Rerun viewer")
        self.path = Path(path)
        if self.path.suffix.lower() != ".rrd":
            raise OutputError(f"{self.path}: the name of such a recording must end in .rrd")
        self._rest_px = np.asarray(rest_px, dtype=float)
        self._part = self.path.with_name(self.path.name + ".part")
        self._triangles: NDArray[np.int64] | None = None
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._part.write_bytes(b"")
        except OSError as error:
            raise disk_error(self.path, "starting the recording", error) from error
        self._stream: Any = self._rr.RecordingStream("gelslim")
        self._stream.save(self._part, default_blueprint=self._layout())
        self._name_lines()
        if finger is not None:
            self._show_finger(Path(finger))

    def take(self, image: NDArray[np.uint8] | None, result: FrameResult) -> None:
        """Add a frame. Raises OutputError if the recording is finished."""
        if self._stream is None:
            raise OutputError(f"{self.path}: the recording is already finished")
        stream, rr = self._stream, self._rr
        stream.set_time("frame", sequence=result.index)
        if np.isfinite(result.time_s):
            stream.set_time("time", duration=float(result.time_s))
        if result.stamp_s is not None:
            stream.set_time("stamp", timestamp=float(result.stamp_s))
        if image is not None:
            picture = rr.EncodedImage(
                contents=encoded(image, ".jpg", _QUALITY), media_type="image/jpeg"
            )
            stream.log("camera/picture", picture)
        self._log_markers(result.tracks)
        self._log_field(result.field)
        self._log_wrench(result.wrench, result.field)
        for problem in result.problems:
            stream.log("problems", rr.TextLog(problem, level="WARN"))

    def finish(self) -> None:
        """Write the rest and give the file its name; a second call does nothing.

        Raises:
            OutputError: The disk refuses it.
        """
        if self._stream is None:
            return
        self._stream.flush()
        self._stream.disconnect()
        self._stream = None
        try:
            os.replace(self._part, self.path)
        except OSError as error:
            raise disk_error(self.path, "finishing the recording", error) from error

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the recording; what was recorded before an error is kept too."""
        self.finish()

    def _log_markers(self, tracks: Tracks | None) -> None:
        rr = self._rr
        if tracks is None:
            for name in ("markers", "motion"):
                self._stream.log(f"camera/{name}", rr.Clear(recursive=False))
            return
        colours = np.array([_STATUS[MarkerStatus(s)] for s in tracks.status.tolist()])
        known = np.isfinite(tracks.positions_px).all(axis=1)
        seen = known & tracks.tracked
        places = tracks.positions_px
        self._stream.log(
            "camera/markers",
            rr.Points2D(places[known], colors=colours[known], radii=rr.Radius.ui_points(2.0)),
        )
        self._stream.log(
            "camera/motion",
            rr.Arrows2D(
                origins=self._rest_px[seen],
                vectors=(places - self._rest_px)[seen],
                colors=[(255, 255, 255)],
            ),
        )

    def _log_field(self, field: ForceField | None) -> None:
        rr = self._rr
        if field is None:
            self._stream.log("gel/force", rr.Clear(recursive=False))
            return
        if self._triangles is None:
            self._triangles = Delaunay(field.points_mm[:, :2]).simplices
        places = field.points_mm + np.nan_to_num(field.displacement_mm)
        self._stream.log(
            "gel/surface",
            rr.Mesh3D(
                vertex_positions=places,
                triangle_indices=self._triangles,
                vertex_colors=_depth_colours(field.displacement_mm[:, 2]),
            ),
        )
        loaded = np.linalg.norm(np.nan_to_num(field.force_n), axis=1) > 0
        self._stream.log(
            "gel/force",
            rr.Arrows3D(
                origins=places[loaded],
                vectors=NODE_MM_PER_N * np.nan_to_num(field.force_n)[loaded],
                colors=[_LINE],
            ),
        )

    def _log_wrench(self, wrench: Wrench | None, field: ForceField | None) -> None:
        rr = self._rr
        if wrench is None:
            self._stream.log("gel/resultant", rr.Clear(recursive=False))
            return
        sigma = wrench.standard_deviation
        for name, value, spread in zip(_PARTS, wrench.vector, sigma, strict=True):
            if np.isfinite(value):
                off = WIDTH_95 * np.nan_to_num(spread)
                self._stream.log(f"wrench/{name}", rr.Scalars([value, value - off, value + off]))
        centre = np.full(2, np.nan) if field is None else field.centre_of_pressure_mm
        if np.isfinite([*centre, *wrench.force_n]).all():
            self._stream.log(
                "gel/resultant",
                rr.Arrows3D(
                    origins=[[*centre, 0.0]],
                    vectors=[SUM_MM_PER_N * wrench.force_n],
                    colors=[(200, 50, 40)],
                ),
            )
        else:
            self._stream.log("gel/resultant", rr.Clear(recursive=False))

    def _name_lines(self) -> None:
        rr = self._rr
        for part, name in zip(_PARTS, _NAMES, strict=True):
            lines = rr.SeriesLines(
                colors=[_LINE, _LIMIT, _LIMIT],
                widths=[2.0, 1.0, 1.0],
                names=[name, "- 1.96 σ", "+ 1.96 σ"],
            )
            self._stream.log(f"wrench/{part}", lines, static=True)

    def _show_finger(self, model: Path) -> None:
        rr = self._rr
        self._stream.log("gel/finger", rr.Transform3D(mat3x3=_FROM_GLTF), static=True)
        self._stream.log(
            "gel/finger/model", rr.Asset3D(path=model, albedo_factor=_GLASS), static=True
        )

    def _layout(self) -> Any:
        """Picture and gel on the left, forces over time on the right."""
        blueprint = optional_library.load("rerun.blueprint", "a recording for the Rerun viewer")
        plots = [
            blueprint.TimeSeriesView(
                origin=f"wrench/{part}", name=name, plot_legend=blueprint.PlotLegend(visible=False)
            )
            for part, name in zip(_PARTS, _NAMES, strict=True)
        ]
        eye = blueprint.EyeControls3D(position=_EYE_MM, look_target=(0, 0, 0), eye_up=(0, 0, 1))
        seen = blueprint.Vertical(
            blueprint.Spatial2DView(origin="camera", name="camera"),
            blueprint.Spatial3DView(
                origin="gel", name="gel, mm", line_grid=False, eye_controls=eye
            ),
        )
        told = blueprint.Vertical(
            *plots[:3],
            blueprint.Horizontal(*plots[3:]),
            blueprint.TextLogView(origin="problems", name="problems"),
        )
        return blueprint.Blueprint(blueprint.Horizontal(seen, told), collapse_panels=True)


def _depth_colours(rise_mm: Array) -> NDArray[np.uint8]:
    """(c, 3) from light grey at rest to blue where the gel is pressed in deepest."""
    depth = -np.nan_to_num(rise_mm)
    share = np.clip(depth / max(float(depth.max(initial=0.0)), 1e-3), 0.0, 1.0)[:, None]
    return np.asarray((1 - share) * [225, 225, 225] + share * [70, 130, 200]).astype(np.uint8)
