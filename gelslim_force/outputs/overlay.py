"""A frame with its results drawn over it: displacement in yellow, force in red, as in the paper.

Yellow arrows show the motion of the markers in the picture, red arrows the tangential traction on
the gel, and the red shade the pressure. The column at the right shows the wrench and the scales.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import Delaunay, QhullError

from gelslim_core import optional_library
from gelslim_core.errors import disk_error
from gelslim_core.files.replaced_file import replace_file
from gelslim_force.forces.frame_result import ForceField, FrameResult
from gelslim_force.outputs.arrow_scale import ArrowScale
from gelslim_force.outputs.canvas import Canvas, Image, arrow, encoded, enlarged
from gelslim_force.outputs.legend import (
    LEAST_HEIGHT_PX,
    RED,
    SHADE,
    WHITE,
    WIDTH_PX,
    YELLOW,
    legend,
    shade_share,
    status_mark,
)
from gelslim_force.tracking.tracks import MarkerStatus, Tracks

_DARK = (18, 20, 22)
_BRIGHTNESS, _COLOUR_SHARE = 0.8, 0.6
"""What is kept of the brightness and colour of a frame, so that the arrows stand out."""
_SHADES = np.array([shade_share(k / 255.0) for k in range(256)])
Array = NDArray[np.float64]
Projection = Callable[[Array], Array]
"""From points (n, 3) in mm to positions (n, 2) in px, such as `VirtualCamera.project`."""
_COARSE = 4
_STEP_MM = 0.05
_CELL_MM = 1.1
"""Side of the square whose nodes share one force arrow."""


class Overlay:
    """Draws the frames of a run at one size.

    Attributes:
        zoom: Enlargement of the frames.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        project: Projection | None = None,
        reference_px: NDArray[np.float64] | None = None,
    ) -> None:
        """Prepare to draw frames of one sensor.

        Args:
            shape: (h, w) of the frames.
            project: The camera's projection; without it no forces are drawn in the picture.
            reference_px: (m, 2) positions of the markers at rest, where lost markers are drawn.
                Without it a marker is drawn once it has been seen.
        """
        self._shape, self._project = shape, project
        self.zoom = int(np.clip(-(-LEAST_HEIGHT_PX // shape[0]), 1, 8))
        self._rest = None if reference_px is None else np.array(reference_px, dtype=float)
        self._view: SurfaceView | None = None

    @property
    def size_px(self) -> tuple[int, int]:
        """(h, w) of the pictures drawn."""
        height, width = self._shape[0] * self.zoom, self._shape[1] * self.zoom
        return max(height, LEAST_HEIGHT_PX), width + WIDTH_PX

    def draw(
        self, image: NDArray[np.uint8] | None, result: FrameResult, scale: ArrowScale
    ) -> Image:
        """Draw a frame and its result.

        Args:
            image: RGB (h, w, 3) or grey (h, w). Without one, or with one of another size, the
                picture stays dark.
            result: What is drawn over it.
            scale: How long the arrows are.

        Returns:
            An RGB picture of `size_px`.

        Raises:
            MissingLibraryError: OpenCV is not installed.
        """
        field = result.field if self._project is not None else None
        view = None if field is None else self._view_of(field)
        ground = self._ground(image)
        if field is not None and view is not None:
            ground = _shaded(ground, view, field, scale)
        large = enlarged(np.rint(ground).astype(np.uint8), self.zoom)
        canvas = Canvas(large)
        if field is not None and view is not None:
            self._draw_forces(canvas, view, field, scale)
        if result.tracks is not None:
            self._draw_markers(canvas, result.tracks, scale)
        if field is not None and view is not None:
            self._draw_centre(canvas, view.position_px(field.centre_of_pressure_mm))
        return self._with_column(canvas.picture(), result, scale)

    def _ground(self, image: NDArray[np.uint8] | None) -> NDArray[np.float32]:
        """The frame, darker and with less colour."""
        if image is None or image.shape[:2] != self._shape:
            return np.full((*self._shape, 3), 30, dtype=np.float32)
        colour = image.reshape(*self._shape, -1).astype(np.float32)
        if colour.shape[2] != 3:
            colour = np.repeat(colour[:, :, :1], 3, axis=2)
        grey = colour.mean(axis=2, keepdims=True)
        return np.asarray((grey + _COLOUR_SHARE * (colour - grey)) * _BRIGHTNESS)

    def _view_of(self, field: ForceField) -> SurfaceView:
        view = self._view
        same = view is not None and np.array_equal(view.points_mm, field.points_mm)
        if view is None or not same:
            assert self._project is not None
            view = SurfaceView(field.points_mm, self._project, self._shape)
            self._view = view
        return view

    def _at(self, position: NDArray[np.float64]) -> tuple[float, float]:
        """Position in the enlarged picture."""
        x, y = (position + 0.5) * self.zoom - 0.5
        return float(x), float(y)

    def _pen(self) -> float:
        """Width of the shaft of an arrow."""
        return max(1.0, self._shape[0] * self.zoom / 420.0)

    def _arrow(
        self,
        canvas: Canvas,
        position: NDArray[np.float64],
        length: NDArray[np.float64],
        colour: tuple[int, int, int],
    ) -> None:
        start, end, pen = self._at(position), self._at(position + length), self._pen()
        arrow(canvas, start, end, colour, pen, _DARK)

    def _draw_forces(
        self, canvas: Canvas, view: SurfaceView, field: ForceField, scale: ArrowScale
    ) -> None:
        lengths = view.arrows_px(field.traction_mpa, scale.traction_mm_per_mpa)
        drawn = np.isfinite(lengths).all(axis=1) & (np.hypot(*lengths.T) * self.zoom > 3)
        for k in np.flatnonzero(drawn):
            self._arrow(canvas, view.cells_px[k], lengths[k], RED)

    def _draw_markers(self, canvas: Canvas, tracks: Tracks, scale: ArrowScale) -> None:
        rest = self._rest_of(tracks)
        moved = np.where(tracks.known[:, None], tracks.displacement_px, np.nan)
        size = 0.8 * self._pen() + 0.4
        for k, position in enumerate(rest):
            status = MarkerStatus(int(tracks.status[k]))
            if not np.isfinite(position).all():
                continue
            if status == MarkerStatus.TRACKED and np.isfinite(moved[k]).all():
                self._arrow(canvas, position, scale.motion_gain * moved[k], YELLOW)
            status_mark(canvas, *self._at(position), status, size)

    def _rest_of(self, tracks: Tracks) -> NDArray[np.float64]:
        """Positions at rest (m, 2), kept for the markers that are lost in this frame."""
        now = tracks.positions_px - tracks.displacement_px
        if self._rest is None or len(self._rest) != len(tracks):
            self._rest = np.full((len(tracks), 2), np.nan)
        new = np.isnan(self._rest).any(axis=1) & np.isfinite(now).all(axis=1)
        self._rest[new] = now[new]
        return self._rest

    def _draw_centre(self, canvas: Canvas, position: NDArray[np.float64]) -> None:
        """Draw cross hairs at the centre of pressure."""
        if not np.isfinite(position).all():
            return
        (x, y), size = self._at(position), 5 * self._pen()
        for colour, width in ((_DARK, self._pen() + 2), (WHITE, self._pen())):
            canvas.ring((x, y), size, colour, width)
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                near, far = 0.6 * size, 1.7 * size
                canvas.line(
                    (x + near * dx, y + near * dy), (x + far * dx, y + far * dy), colour, width
                )

    def _with_column(self, picture: Image, result: FrameResult, scale: ArrowScale) -> Image:
        per_mm = None
        if self._view is not None:
            per_mm = float(np.sqrt(np.abs(np.median(np.linalg.det(self._view.px_per_mm)))))
        height, width = self.size_px
        out = np.full((height, width, 3), 12, dtype=np.uint8)
        out[: picture.shape[0], : picture.shape[1]] = picture
        out[:, picture.shape[1] :] = legend(result, scale, height, self.zoom, per_mm)
        return out


def write_overlay(path: str | os.PathLike[str], picture: Image) -> None:
    """Write a picture as PNG or JPEG, as its suffix says. Raises OutputError."""
    data = encoded(picture, Path(path).suffix)
    try:
        replace_file(path, data)
    except OSError as error:
        raise disk_error(path, "writing the picture", error) from error


def _shaded(
    ground: NDArray[np.float32], view: SurfaceView, field: ForceField, scale: ArrowScale
) -> NDArray[np.float32]:
    """Blend red over the picture, the more the higher the pressure; none where it is unknown."""
    pressure = np.maximum(-field.traction_mpa[:, 2], 0.0)
    if not np.isfinite(pressure).all() or not pressure.any():
        return ground
    share = np.clip(view.spread(pressure) / scale.pressure_mpa, 0, 1)
    rows = np.flatnonzero(share.any(axis=1))
    if not len(rows):
        return ground
    part = slice(rows[0], rows[-1] + 1)
    mix = _SHADES[(255 * share[part]).astype(int)][:, :, None].astype(np.float32)
    ground[part] = ground[part] * (1 - mix) + np.array(SHADE, dtype=np.float32) * mix
    return ground


class SurfaceView:
    """Nodes in the picture: averaged in cells for arrows, interpolated to pixels for shades.

    The camera's projection is evaluated once, so that a frame needs only a few matrix products.
    """

    def __init__(self, points_mm: Array, project: Projection, shape: tuple[int, int]) -> None:
        """Project the nodes into a picture of `shape` (h, w)."""
        self.points_mm = points_mm
        self._project = project
        self.shape = shape
        self._gather, centres = _cells(points_mm, _CELL_MM)
        self.cells_px = project(centres)
        """(k, 2) positions at which the arrows start."""
        steps = [np.array([_STEP_MM, 0, 0]), np.array([0, _STEP_MM, 0])]
        columns = [(project(centres + s) - project(centres - s)) / (2 * _STEP_MM) for s in steps]
        self.px_per_mm = np.stack(columns, axis=-1)
        """(k, 2, 2) Jacobian of the projection along the gel at each cell."""
        self._spread = _spreading(project(points_mm), shape)

    def arrows_px(self, traction_mpa: Array, mm_per_mpa: float) -> Array:
        """Return the arrows (k, 2) of the mean tangential traction in each cell."""
        mean = self._gather @ traction_mpa[:, :2]
        return np.einsum("kij,kj->ki", self.px_per_mm, mean * mm_per_mpa)

    def spread(self, values: Array) -> Array:
        """Interpolate values (c,) at the nodes linearly to a picture (h, w), 0 outside the pad."""
        height, width = _coarse(self.shape)
        coarse = (self._spread @ values).reshape(height, width)
        cv = optional_library.load("cv2", "drawing pictures")
        size = (width * _COARSE, height * _COARSE)
        large = cv.resize(coarse, size, interpolation=cv.INTER_LINEAR)
        return np.asarray(large[: self.shape[0], : self.shape[1]])

    def position_px(self, point_mm: Array) -> Array:
        """Return the position (2,) of a point (2,) on the surface; NaN for NaN."""
        if not np.isfinite(point_mm).all():
            return np.full(2, np.nan)
        return np.asarray(self._project(np.array([[point_mm[0], point_mm[1], 0.0]]))[0])


def _cells(points_mm: Array, cell_mm: float) -> tuple[sparse.csr_array, Array]:
    """Matrix (k, c) that averages over the nodes of a cell, and the centroids (k, 3)."""
    box = np.floor(points_mm[:, :2] / cell_mm + 0.5).astype(np.int64)
    _, cell = np.unique(box, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    share = 1.0 / np.bincount(cell)[cell]
    gather = sparse.csr_array((share, (cell, np.arange(len(cell)))))
    return gather, np.asarray(gather @ points_mm)


def _coarse(shape: tuple[int, int]) -> tuple[int, int]:
    return -(-shape[0] // _COARSE), -(-shape[1] // _COARSE)


def _spreading(nodes_px: Array, shape: tuple[int, int]) -> sparse.csr_array:
    """Barycentric weights (coarse pixels, c) of the nodes' triangles in the picture."""
    height, width = _coarse(shape)
    rows, columns = np.mgrid[:height, :width]
    middle = (_COARSE - 1) / 2
    pixels = np.column_stack([columns.ravel(), rows.ravel()]) * _COARSE + middle
    size = (height * width, len(nodes_px))
    try:
        net = Delaunay(nodes_px)
    except (QhullError, ValueError):  # too few nodes, or all on one line: there is no area
        return sparse.csr_array(size)
    triangle = net.find_simplex(pixels)
    inside = np.flatnonzero(triangle >= 0)
    frame = net.transform[triangle[inside]]
    two = np.einsum("kij,kj->ki", frame[:, :2], pixels[inside] - frame[:, 2])
    weights = np.column_stack([two, 1 - two.sum(axis=1)])
    corners = net.simplices[triangle[inside]]
    return sparse.csr_array((weights.ravel(), (np.repeat(inside, 3), corners.ravel())), shape=size)
