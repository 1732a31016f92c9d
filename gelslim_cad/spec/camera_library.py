"""The library of cameras: a data file each, every figure with its source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from gelslim_cad.spec.camera import FOV_TOLERANCE, LIBRARY, Camera, camera_names
from gelslim_cad.spec.limits import above
from gelslim_cad.spec.source import Source
from gelslim_core.errors import GelslimError
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.document import Document
from gelslim_core.yaml.errors import FieldError
from gelslim_core.yaml.reader import read_model
from gelslim_core.yaml.suggest import suggest_choice

Pixels = Annotated[int, Field(ge=1, le=20000)]
PORTRAIT = "portrait"
Figure = float | int | str
TURNED = {
    f"{what}_{side}": f"{what}_{other}"
    for what, unit in (("image", "px"), ("sensor", "mm"), ("module", "mm"))
    for side, other in (("width_" + unit, "height_" + unit), ("height_" + unit, "width_" + unit))
}
"""Fields of a camera in portrait, with those in landscape whose values they take."""
ABOUT = ("format", "summary", "sources")
"""Fields of a library file that are no figures of the camera."""


class CameraLibraryError(GelslimError, ValueError):
    """The library has no camera of that name."""


class Mode(Block):
    """A mode of the sensor: the picture, the part of the sensor that it shows, and its rate."""

    name: str = Field(min_length=1, max_length=40, description="Name, for `camera.mode`")
    image_px: tuple[Pixels, Pixels] = Field(description="Width and height of the picture")
    crop_px: tuple[Pixels, Pixels] = Field(
        description="Width and height of the part of the sensor that it shows, in the sensor's "
        "pixels; larger than the picture where pixels are binned or skipped"
    )
    frame_rate_hz: float = above(0, 5000, "Highest frame rate")

    @property
    def binning(self) -> float:
        """Pixels of the sensor along one pixel of the picture."""
        return self.crop_px[0] / self.image_px[0]


class FieldOfView(Block):
    """Field of view of the whole sensor as the sheet states it."""

    horizontal_deg: float | None = above(0, 180, "Across the width", default=None)
    vertical_deg: float | None = above(0, 180, "Across the height", default=None)
    diagonal_deg: float | None = above(0, 180, "Across the diagonal", default=None)
    at_mm: float | None = above(
        0, 1e6, "Distance at which it holds; infinity when left out", default=None
    )
    deviation: str = Field(
        default="", description="Why it differs from sensor and focal length, where it does"
    )


class LibraryCamera(Block):
    """A camera of the library. Each of its figures has one source, or is marked as assumed.

    Attributes:
        format: Format of the file, `gelslim-camera/1`.
        summary: One sentence.
        sensor: Maker and type of the sensor.
        shutter: Kind of shutter.
        pixel_um: Side of a pixel in µm.
        sensor_px: Width and height of the sensor in pixels.
        field_of_view: That of the whole sensor in the sheet.
        thread_pitch_mm: How far one turn moves the lens in mm.
        connector: Cable and connector.
        modes: The modes; the first is used where a spec names none.
        camera: Fields of a spec's camera that are the same in all modes.
        sources: Where the figures come from.
    """

    format: Literal["gelslim-camera/1"]
    summary: str
    sensor: str
    shutter: Literal["global", "rolling"]
    pixel_um: float = above(0, 50, "Side of a pixel")
    sensor_px: tuple[Pixels, Pixels]
    field_of_view: FieldOfView | None = None
    thread_pitch_mm: float | None = above(0, 5, "Pitch of the lens's thread", default=None)
    connector: str = ""
    modes: tuple[Mode, ...] = Field(min_length=1)
    camera: dict[str, Figure]
    sources: tuple[Source, ...]

    @property
    def figures(self) -> dict[str, Any]:
        """Every figure that the file gives, by its dotted path."""
        own = {n: getattr(self, n) for n in type(self).model_fields if n not in (*ABOUT, "camera")}
        given = {name: value for name, value in own.items() if value not in (None, "")}
        return given | {f"camera.{n}": v for n, v in self.camera.items() if n != "name"}

    def source(self, figure: str) -> Source:
        """The source of one of `figures`. Raises KeyError for another name."""
        for source in self.sources:
            if figure in source.gives:
                return source
        raise KeyError(figure)

    def fields(self, mode: str | None = None, portrait: bool = False) -> dict[str, Any]:
        """Fields of a spec's camera in a mode, the first by default, `model` excepted.

        In `portrait` the module is turned by 90°, so that what was its width is its height. Raises
        `FieldError` for a mode that the camera does not have.
        """
        by_name = {m.name: m for m in self.modes}
        if mode is not None and mode not in by_name:
            told = suggest_choice(mode, tuple(by_name))
            raise FieldError("mode", "is no mode of this camera of the library", told)
        chosen = self.modes[0] if mode is None else by_name[mode]
        width, height = (round(count * self.pixel_um / 1000, 9) for count in chosen.crop_px)
        fields = {
            **self.camera,
            "mode": chosen.name,
            "image_width_px": chosen.image_px[0],
            "image_height_px": chosen.image_px[1],
            "sensor_width_mm": width,
            "sensor_height_mm": height,
            "frame_rate_hz": chosen.frame_rate_hz,
        }
        turned = {name: fields[other] for name, other in TURNED.items() if other in fields}
        return fields | turned if portrait else fields

    def implied_fov_deg(self, part_px: tuple[int, int] | None = None) -> dict[str, float]:
        """Field of view of the sensor, or a part of it, by its sides and f, for a thin lens."""
        f, view = float(self.camera["focal_length_mm"]), self.field_of_view
        at = None if view is None else view.at_mm
        image_mm = f if at is None else f * at / (at - f)
        sides = [count * self.pixel_um / 1000 for count in part_px or self.sensor_px]
        named = ("horizontal_deg", "vertical_deg", "diagonal_deg")
        return {
            name: math.degrees(2 * math.atan(side / 2 / image_mm))
            for name, side in zip(named, (*sides, math.hypot(*sides)), strict=True)
        }

    @model_validator(mode="after")
    def _whole(self) -> LibraryCamera:
        stated = [figure for source in self.sources for figure in source.gives]
        if sorted(stated) != sorted(self.figures):
            wrong = sorted(set(stated) ^ set(self.figures)) or "a figure is named twice"
            raise FieldError("sources", f"must name each figure once: {wrong}")
        for mode in self.modes:
            if any(c > s for c, s in zip(mode.crop_px, self.sensor_px, strict=True)):
                raise FieldError("modes", f"{mode.name} shows more than the sensor")
            try:
                Camera.model_validate({**self.fields(mode.name), "model": "itself"})
            except ValidationError as error:
                raise FieldError("camera", f"is not legal in mode {mode.name}: {error}") from None
        view = self.field_of_view or FieldOfView()
        apart = any(
            given is not None and abs(given - implied) > FOV_TOLERANCE * implied
            for name, implied in self.implied_fov_deg().items()
            for given in [getattr(view, name)]
        )
        if apart != bool(view.deviation):
            raise FieldError(
                "field_of_view", "differs from sensor and focal length where deviation says why"
            )
        return self


@cache
def library_camera(name: str) -> LibraryCamera:
    """A camera of the library.

    Args:
        name: One of `camera_names()`.

    Returns:
        The camera.

    Raises:
        CameraLibraryError: There is no camera of this name.
    """
    if name not in camera_names():
        told = suggest_choice(name, camera_names())
        raise CameraLibraryError(f"no camera of the library is called {name}; {told}")
    return read_model(LIBRARY / f"{name}.yaml", LibraryCamera).model


def completed(given: Any) -> Any:
    """The fields of a spec's camera, with those of the library that it leaves out.

    Anything but a mapping with a `model` is returned as it is. Raises `FieldError` for an unknown
    model or mode.
    """
    if not isinstance(given, Mapping) or given.get("model") is None:
        return given
    name, mode = given["model"], given.get("mode")
    if name not in camera_names():
        raise FieldError(
            "model", "is no camera of the library", suggest_choice(name, camera_names())
        )
    portrait = given.get("orientation") == PORTRAIT
    fields = library_camera(name).fields(mode if isinstance(mode, str) else None, portrait)
    if given.get("focusing", fields.get("focusing")) != "fixed":
        # A lens that is taken to be movable has no distance of its own.
        fields.pop("focus_distance_mm", None)
    return {**fields, **{n: v for n, v in given.items() if n != "mode" or v is not None}}


def own_fields(camera: Mapping[str, Any]) -> dict[str, Any]:
    """What a spec itself gives of a whole camera of the library, to keep it for another camera.

    A field with the value of the library or the default counts as left out. A camera without a
    model is exchanged as a whole, so that nothing of it is kept.
    """
    name = camera["model"]
    if name is None:
        return {}
    taken = library_camera(name).fields(camera["mode"], camera["orientation"] == PORTRAIT)
    defaults = {n: f.default for n, f in Camera.model_fields.items()}
    kept = {n: v for n, v in camera.items() if v != taken.get(n, defaults[n])}
    return kept | {"model": name}


def lend_fields(document: Document) -> None:
    """Give the camera of a spec's document the fields that the library lends it.

    They get the place of `camera.model`, so that a rule that one of them breaks names this line.
    """
    camera = document.data.get("camera")
    try:
        whole = completed(camera)
    except FieldError:
        return
    if camera is None or whole is camera:
        return
    for name, value in whole.items():
        if name not in camera or (name == "mode" and camera[name] is None):
            origin = f"the library's camera {camera['model']}"
            document.lend(("camera", name), value, origin, ("camera", "model"))
