"""Content of a report, as plain values, so that writing it needs no CAD."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gelslim_cad.checks.rule import Check, Status


Scalar = float | int | str | bool | None
"""A value as shown: number, text, yes/no, or nothing."""


@dataclass(frozen=True)
class DimensionRow:
    """One dependent dimension with the formula and the inputs it was computed from."""

    name: str
    value: Scalar
    unit: str
    formula: str
    inputs: tuple[tuple[str, Scalar], ...]
    source: str
    group: str


@dataclass(frozen=True)
class Picture:
    """A PNG, or, where `png` is empty, the `problem` that kept it from being made."""

    title: str
    caption: str
    png: bytes
    problem: str = ""


@dataclass(frozen=True)
class CameraView:
    """Markers as the camera sees them; pixel (0, 0) is the image's upper left corner.

    `marker_axes_px` holds the full length of the two axes of each dot's ellipse,
    `marker_angle_deg` the direction of the first one from +u towards +v, `blur_px` the diameter
    of the blur circle, `outline_px` the closed outline of the gel, `anchors` the indices of the
    markers which differ from the lattice.
    """

    image_width_px: float
    image_height_px: float
    markers_px: tuple[tuple[float, float], ...]
    marker_axes_px: tuple[tuple[float, float], ...]
    marker_angle_deg: tuple[float, ...]
    blur_px: tuple[float, ...]
    outline_px: tuple[tuple[float, float], ...]
    anchors: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        """Refuse arrays of unequal length and values that cannot be drawn.

        Raises:
            ValueError: naming the field that is wrong.
        """
        count = len(self.markers_px)
        for name in ("marker_axes_px", "marker_angle_deg", "blur_px"):
            length = len(getattr(self, name))
            if length != count:
                raise ValueError(f"camera view: {name} has {length} entries for {count} markers")
        if not (self.image_width_px > 0 and self.image_height_px > 0):
            raise ValueError("camera view: image width and height must be > 0 px")
        for name in (
            "markers_px",
            "marker_axes_px",
            "marker_angle_deg",
            "blur_px",
            "outline_px",
        ):
            if not all(math.isfinite(number) for number in _flat(getattr(self, name))):
                raise ValueError(f"camera view: {name} holds a value that is not finite")
        if any(not 0 <= index < count for index in self.anchors):
            raise ValueError(f"camera view: an anchor index lies outside 0..{count - 1}")

    @classmethod
    def from_arrays(
        cls,
        image_size_px: tuple[float, float],
        markers_px: Any,
        marker_axes_px: Any,
        marker_angle_deg: Any,
        blur_px: Any,
        outline_px: Any,
        anchors: Iterable[int] = (),
    ) -> CameraView:
        """Take numpy arrays (or nested sequences) of shape (n, 2), (n, 2), (n,), (n,), (m, 2)."""
        return cls(
            float(image_size_px[0]),
            float(image_size_px[1]),
            _pairs(markers_px),
            _pairs(marker_axes_px),
            tuple(float(angle) for angle in marker_angle_deg),
            tuple(float(blur) for blur in blur_px),
            _pairs(outline_px),
            frozenset(int(index) for index in anchors),
        )


@dataclass(frozen=True)
class FileRow:
    """A file beside the report: `path` relative to it, with forward slashes."""

    path: str
    size_bytes: int
    sha256: str
    purpose: str = ""

    def __post_init__(self) -> None:
        """Refuse a path that leaves the report's folder.

        Raises:
            ValueError: for an absolute path, a drive, or a `..` step.
        """
        steps = self.path.split("/")
        if not self.path or "\\" in self.path or ":" in self.path or {"", ".", ".."} & set(steps):
            raise ValueError(f"file list: {self.path!r} is not a plain relative path")


@dataclass(frozen=True)
class BomLine:
    """One line of the bill of materials."""

    name: str
    quantity: int
    material: str
    process: str
    mass_g: float | None = None
    note: str = ""
    tooling: bool = False


@dataclass(frozen=True)
class Note:
    """A short remark under a heading of its own, e.g. on the light guide."""

    title: str
    text: str


@dataclass(frozen=True)
class ReportData:
    """Everything `render_report` shows for one finger."""

    name: str
    spec_text: str
    spec_hash: str
    headline: tuple[tuple[str, str], ...] = ()
    summary: str = ""
    dimensions: tuple[DimensionRow, ...] = ()
    rules: tuple[Check, ...] = ()
    binding: tuple[str, ...] = ()
    glb: bytes = b""
    pictures: tuple[Picture, ...] = ()
    camera_view: CameraView | None = None
    files: tuple[FileRow, ...] = ()
    bom: tuple[BomLine, ...] = ()
    notes: tuple[Note, ...] = ()
    light: tuple[Picture, ...] = ()
    """Pictures of the light, each as wide as the page."""
    light_notes: tuple[Note, ...] = ()
    projection: tuple[Picture, ...] = ()
    """Pictures of the projection, shown below the camera's view, with notes."""
    projection_notes: tuple[Note, ...] = ()
    versions: tuple[tuple[str, str], ...] = field(default=())

    @property
    def counts(self) -> dict[Status, int]:
        """How many rules pass, warn and fail."""
        statuses = [rule.status for rule in self.rules]
        return {
            "pass": statuses.count("pass"),
            "warn": statuses.count("warn"),
            "fail": statuses.count("fail"),
        }


def _pairs(array: Any) -> tuple[tuple[float, float], ...]:
    return tuple((float(u), float(v)) for u, v in array)


def _flat(values: Sequence[Any]) -> list[float]:
    return [number for item in values for number in (item if isinstance(item, tuple) else (item,))]
