"""The lattice of marker dots on the gel, shared by print, mesh and force pipeline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MarkerGridError
from ifem_export.markers.anchors import choose_anchor_sites
from ifem_export.markers.lattice_frame import LatticeFrame

Anchors = Literal["odd_sized", "omitted", "none"]
"""How anchors are marked: by a larger dot, by a site without a dot, or no anchors."""
REGULAR, ANCHOR_LARGE = 0, 1
"""Values of `MarkerGrid.kind`."""
LABELS = ("row", "column", "diameter_mm", "kind")
"""Arrays of `MarkerGrid` that a bundle keeps beside the places of the dots."""
_RIM_POINTS = 32
_LATTICE_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class MarkerGrid:
    """Dots on a lattice, by default a square one centred on the origin of the sensor frame.

    x points along the finger to the tip and increases with the row, y points across it and
    increases with the column. Markers are in row-major order, and the index of a marker is its
    id. The arrays are read-only copies.

    Attributes:
        positions_mm: (m, 2) dot centres in the sensor frame.
        row: (m,) lattice row, 0 at the smallest x.
        column: (m,) lattice column, 0 at the smallest y.
        diameter_mm: (m,) dot diameters.
        kind: (m,) `REGULAR` or `ANCHOR_LARGE`.
        pitch_mm: Distance of neighbouring rows and of neighbouring columns; their mean for a
            lattice that is not square.
        lattice_shape: (rows, columns) of the complete lattice, clipped dots included.
        omitted: (k, 2) sites (row, column) left without a dot as anchors; clipped sites are not
            listed.
        frame: Steps and middle of a lattice that is not square, turned or not centred; None for a
            square one on the origin.

    Raises:
        MarkerGridError: Arrays disagree in length, a marker is off its lattice site, a site is
            used twice, or dots overlap.
    """

    positions_mm: NDArray[np.float64]
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    diameter_mm: NDArray[np.float64]
    kind: NDArray[np.int64]
    pitch_mm: float
    lattice_shape: tuple[int, int]
    omitted: NDArray[np.int64]
    frame: LatticeFrame | None = None

    def __post_init__(self) -> None:
        shape = (int(self.lattice_shape[0]), int(self.lattice_shape[1]))
        object.__setattr__(self, "lattice_shape", shape)
        object.__setattr__(self, "pitch_mm", float(self.pitch_mm))
        if np.size(self.omitted) == 0:
            object.__setattr__(self, "omitted", np.zeros((0, 2)))
        for name in ("positions_mm", "diameter_mm"):
            object.__setattr__(self, name, _frozen(getattr(self, name), np.float64, name))
        for name in ("row", "column", "kind", "omitted"):
            object.__setattr__(self, name, _frozen(getattr(self, name), np.int64, name))
        _check_arrays(self)
        overlap = -self.smallest_gap_mm
        _require(
            overlap <= 1e-9,
            "pitch_mm",
            f"marker dots overlap by {overlap:.4g} mm: the pitch is {self.pitch_mm:g} mm and the "
            f"largest dot {self.diameter_mm.max():g} mm; use a larger pitch or smaller dots",
            self.pitch_mm,
        )

    def __len__(self) -> int:
        """Number of dots."""
        return len(self.row)

    @property
    def labels(self) -> dict[str, NDArray[Any]]:
        """What a bundle keeps of each dot beside its place: the arrays (m,) named in `LABELS`."""
        return {name: getattr(self, name) for name in LABELS}

    @property
    def anchor_sites(self) -> NDArray[np.int64]:
        """Sites (k, 2) of all anchors, large and omitted, in row-major order."""
        large = self.kind == ANCHOR_LARGE
        sites = np.vstack([np.column_stack([self.row, self.column])[large], self.omitted])
        return sites[np.lexsort((sites[:, 1], sites[:, 0]))]

    @property
    def index_map(self) -> NDArray[np.int64]:
        """Marker id (rows, columns) at each lattice site, -1 where there is no dot."""
        ids = np.full(self.lattice_shape, -1, dtype=np.int64)
        ids[self.row, self.column] = np.arange(len(self))
        return ids

    @property
    def smallest_gap_mm(self) -> float:
        """Smallest distance between the rims of two neighbouring dots; inf without neighbours."""
        size = np.full(self.lattice_shape, np.nan)
        size[self.row, self.column] = self.diameter_mm
        reach = [size[1:] + size[:-1], size[:, 1:] + size[:, :-1]]
        sums = np.concatenate([pair.ravel() for pair in reach])
        diagonal = np.concatenate(
            [(size[1:, 1:] + size[:-1, :-1]).ravel(), (size[1:, :-1] + size[:-1, 1:]).ravel()]
        )
        frame = self.frame or LatticeFrame.square(self.pitch_mm)
        pitch, across = min(frame.pitches_mm), min(frame.diagonals_mm)
        gaps = np.concatenate([pitch - sums / 2, across - diagonal / 2])
        gaps = gaps[np.isfinite(gaps)]
        return float(gaps.min()) if len(gaps) else float("inf")

    def sites_mm(self, sites: ArrayLike) -> NDArray[np.float64]:
        """Positions (k, 2) in the sensor frame of lattice sites (k, 2)."""
        whole = np.asarray(sites, dtype=np.int64)
        if self.frame is not None:
            return self.frame.places_mm(whole, self.lattice_shape)
        return _lattice_mm(whole, self.lattice_shape, self.pitch_mm)

    def clipped(self, contains: Callable[[NDArray[np.float64]], ArrayLike]) -> MarkerGrid:
        """The grid without the dots that cross an outline.

        Ids are renumbered; lattice indices stay. Omitted sites whose missing dot would cross the
        outline are dropped too, because no dot would be visible there anyway.

        Args:
            contains: Function from points (n, 2) in mm to (n,) booleans. It is called with 32
                points on the rim of each dot and with its centre.

        Returns:
            The clipped grid.

        Raises:
            MarkerGridError: No dot is left.
        """
        keep = _rims_inside(self.positions_mm, self.diameter_mm, contains)
        _require(
            keep.any(),
            "outline",
            f"none of the {len(self)} markers lies inside the outline; "
            "use a smaller marker pitch or dot, or a larger gel",
        )
        missing_mm = np.full(len(self.omitted), self.diameter_mm[keep].max())
        known = _rims_inside(self.sites_mm(self.omitted), missing_mm, contains)
        return MarkerGrid(
            positions_mm=self.positions_mm[keep],
            row=self.row[keep],
            column=self.column[keep],
            diameter_mm=self.diameter_mm[keep],
            kind=self.kind[keep],
            pitch_mm=self.pitch_mm,
            lattice_shape=self.lattice_shape,
            omitted=self.omitted[known],
            frame=self.frame,
        )


def build_marker_grid(
    rows: int,
    columns: int,
    pitch_mm: float,
    diameter_mm: float,
    anchors: Anchors = "odd_sized",
    anchor_scale: float = 1.5,
) -> MarkerGrid:
    """Make a complete lattice centred on the origin, with anchors.

    Args:
        rows: Number of rows along x.
        columns: Number of columns along y.
        pitch_mm: Distance of neighbouring rows and columns.
        diameter_mm: Diameter of a regular dot.
        anchors: "odd_sized" (larger dots), "omitted" (sites without a dot) or "none".
        anchor_scale: Diameter of an odd-sized anchor divided by that of a regular dot, > 1.

    Returns:
        The grid.

    Raises:
        MarkerGridError: A count, a length or the scale is out of range, dots would overlap, or a
            lattice with anchors has fewer than 5 rows or columns.
    """
    _check_request(rows, columns, pitch_mm, diameter_mm, anchors, anchor_scale)
    sites = np.argwhere(np.ones((rows, columns), dtype=bool))
    chosen = np.zeros((rows, columns), dtype=bool)
    if anchors != "none":
        chosen[tuple(choose_anchor_sites(rows, columns).T)] = True
    large = chosen if anchors == "odd_sized" else np.zeros_like(chosen)
    without_dot = chosen if anchors == "omitted" else np.zeros_like(chosen)
    sites = sites[~without_dot.ravel()]
    kind = large[tuple(sites.T)].astype(np.int64)
    return MarkerGrid(
        positions_mm=_lattice_mm(sites, (rows, columns), pitch_mm),
        row=sites[:, 0],
        column=sites[:, 1],
        diameter_mm=np.where(kind == ANCHOR_LARGE, diameter_mm * anchor_scale, diameter_mm),
        kind=kind,
        pitch_mm=pitch_mm,
        lattice_shape=(rows, columns),
        omitted=np.argwhere(without_dot),
    )


def _lattice_mm(
    sites: NDArray[np.int64], shape: tuple[int, int], pitch_mm: float
) -> NDArray[np.float64]:
    return (sites.reshape(-1, 2) - (np.array(shape) - 1) / 2) * pitch_mm


def _require(condition: Any, field: str, message: str, value: Any = None) -> None:
    if not condition:
        raise MarkerGridError(message, field=field, value=value)


def _frozen(values: ArrayLike, dtype: type, name: str) -> NDArray:
    array = np.array(values)
    whole = dtype is not np.int64 or not array.size or np.array_equal(array, np.rint(array))
    _require(whole, name, f"marker grid: {name} must hold whole numbers")
    array = array.astype(dtype)
    array.setflags(write=False)
    return array


def _rims_inside(
    centres_mm: NDArray[np.float64],
    diameter_mm: NDArray[np.float64],
    contains: Callable[[NDArray[np.float64]], ArrayLike],
) -> NDArray[np.bool_]:
    angle = np.linspace(0.0, 2.0 * np.pi, _RIM_POINTS, endpoint=False)
    disc = np.vstack([np.column_stack([np.cos(angle), np.sin(angle)]), [[0.0, 0.0]]]) / 2
    points = (centres_mm[:, None, :] + diameter_mm[:, None, None] * disc).reshape(-1, 2)
    inside = np.asarray(contains(points), dtype=bool)
    _require(
        inside.shape == (len(points),),
        "contains",
        f"contains must return one boolean per point, got shape {inside.shape} "
        f"for {len(points)} points",
    )
    return np.all(inside.reshape(-1, len(disc)), axis=1)


def _check_request(
    rows: int, columns: int, pitch_mm: float, diameter_mm: float, anchors: str, scale: float
) -> None:
    for name, count in (("rows", rows), ("columns", columns)):
        _require(
            not isinstance(count, bool) and isinstance(count, int | np.integer) and count >= 1,
            name,
            f"marker {name} = {count!r}: must be a whole number, at least 1",
            count,
        )
    for name, length in (("pitch_mm", pitch_mm), ("diameter_mm", diameter_mm)):
        _require(
            np.isfinite(length) and length > 0,
            name,
            f"marker {name} = {length!r}: must be a finite length > 0",
            length,
        )
    _require(
        anchors in get_args(Anchors),
        "anchors",
        f"marker anchors = {anchors!r}: must be 'odd_sized', 'omitted' or 'none'",
        anchors,
    )
    _require(
        anchors != "odd_sized" or (np.isfinite(scale) and scale > 1),
        "anchor_scale",
        f"marker anchor_scale = {scale!r}: must be > 1, or the anchors look like the "
        "other dots; 1.5 is usual",
        scale,
    )
    _require(
        diameter_mm <= pitch_mm,
        "diameter_mm",
        f"marker diameter_mm = {diameter_mm:g} exceeds pitch_mm = {pitch_mm:g}: the dots would "
        "overlap; use a larger pitch or smaller dots",
        diameter_mm,
    )


def _check_arrays(grid: MarkerGrid) -> None:
    count, (rows, columns) = len(grid.row), grid.lattice_shape
    shapes = {"positions_mm": (count, 2), "omitted": (len(grid.omitted), 2)}
    for name in ("positions_mm", "row", "column", "diameter_mm", "kind", "omitted"):
        shape, expected = getattr(grid, name).shape, shapes.get(name, (count,))
        _require(
            shape == expected, name, f"marker grid: {name} has shape {shape}, expected {expected}"
        )
    _require(count, "row", "marker grid: no markers; use a smaller pitch or a larger gel")
    _require(
        np.isfinite(grid.pitch_mm) and grid.pitch_mm > 0,
        "pitch_mm",
        f"marker grid: pitch_mm = {grid.pitch_mm}: must be a finite length > 0",
        grid.pitch_mm,
    )
    _require(
        np.all(np.isfinite(grid.diameter_mm) & (grid.diameter_mm > 0)),
        "diameter_mm",
        "marker grid: every diameter_mm must be a finite length > 0",
    )
    _require(
        np.isin(grid.kind, (REGULAR, ANCHOR_LARGE)).all(),
        "kind",
        "marker grid: kind must be 0 (regular) or 1 (large anchor)",
    )
    dots = np.column_stack([grid.row, grid.column])
    sites = np.vstack([dots, grid.omitted])
    _require(
        (sites >= 0).all() and (sites < (rows, columns)).all(),
        "sites",
        f"marker grid: a site lies outside the {rows} x {columns} lattice",
    )
    flat = sites[:, 0] * columns + sites[:, 1]
    _require(
        len(np.unique(flat)) == len(flat), "sites", "marker grid: a lattice site is used twice"
    )
    _require(
        (np.diff(flat[: len(dots)]) >= 0).all(),
        "row",
        "marker grid: markers must be in row-major order",
    )
    offset_mm = np.abs(grid.positions_mm - grid.sites_mm(dots))
    _require(
        np.all(offset_mm <= _LATTICE_TOLERANCE * grid.pitch_mm),
        "positions_mm",
        f"marker grid: a marker lies {offset_mm.max():.4g} mm off its lattice site; positions are "
        "(row, column) times the pitch, centred on the origin, or as the frame says",
        float(offset_mm.max()),
    )
