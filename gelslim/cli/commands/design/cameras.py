"""`gelslim cameras`: the library of cameras, and one of them with all figures and sources."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import console, given, indented, print_json, say, table
from gelslim.cli.options import AsJson

if TYPE_CHECKING:
    from gelslim_cad.spec.camera_library import LibraryCamera


def cameras(
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help="A camera of the library.", show_default=False)
    ] = "",
    as_json: AsJson = False,
) -> int:
    """List the cameras of the library, or show one with all figures, sources and modes.

    `gelslim new MINE --camera NAME` writes a spec with one of them, and `camera.model: NAME` takes
    its figures into any spec.
    """
    from gelslim_cad.spec.camera import camera_names
    from gelslim_cad.spec.camera_library import library_camera

    if name:
        camera = library_camera(name)
        if as_json:
            print_json({"name": name, **_record(camera)})
        else:
            _show(camera)
        return 0
    rows = {n: _row(library_camera(n)) for n in camera_names()}
    if as_json:
        print_json([{"name": n, **row} for n, row in rows.items()])
    else:
        _list(rows)
    return 0


def _row(camera: LibraryCamera) -> dict[str, Any]:
    """What the list tells of a camera, in its first mode."""
    fields = camera.fields()
    return {
        "sensor": camera.sensor,
        "image_px": [fields["image_width_px"], fields["image_height_px"]],
        "focal_length_mm": fields["focal_length_mm"],
        "f_number": fields["f_number"],
        "field_of_view_deg": _view(camera, fields["mode"]),
        "module_mm": [fields[f"module_{side}_mm"] for side in ("width", "height", "depth")],
        "picture": fields["picture"],
        "frame_rate_hz": fields["frame_rate_hz"],
        "shutter": camera.shutter,
        "summary": camera.summary,
    }


def _view(camera: LibraryCamera, mode: str) -> list[float]:
    """Field of view of a mode in degrees, across and along, by sensor and focal length."""
    crop_px = next(m.crop_px for m in camera.modes if m.name == mode)
    found = camera.implied_fov_deg(crop_px)
    return [found["horizontal_deg"], found["vertical_deg"]]


def _list(rows: dict[str, dict[str, Any]]) -> None:
    shown = table(padding=(0, 1, 0, 0))
    for head in ("camera", "sensor"):
        shown.add_column(head, no_wrap=True)
    shown.add_column("kind")
    for head in ("image px", "f mm", "N", "view °", "module mm", "1/s"):
        shown.add_column(head, justify="right", no_wrap=True)
    for name, row in rows.items():
        shown.add_row(
            name,
            row["sensor"].split()[-1],
            f"{row['picture']} {row['shutter']}",
            _times(row["image_px"]),
            f"{row['focal_length_mm']:.3g}",
            f"{row['f_number']:g}",
            _times(round(v) for v in row["field_of_view_deg"]),
            _times(row["module_mm"]),
            f"{row['frame_rate_hz']:.0f}",
        )
    console().print(shown)
    say("Image, view and rate are those of the first mode, the view that of a distant object.")


def _times(values: Any) -> str:
    return "×".join(f"{v:g}" for v in values)


def _show(camera: LibraryCamera) -> None:
    say(str(camera.camera["name"]), style="bold")
    say(camera.summary)
    heads = ("image px", "of the sensor px", "binning", "view °", "1/s")
    modes = table("mode", figures=heads, padding=(0, 2, 0, 0))
    for mode in camera.modes:
        modes.add_row(
            mode.name,
            _times(mode.image_px),
            _times(mode.crop_px),
            f"{mode.binning:g}",
            _times(round(v, 1) for v in _view(camera, mode.name)),
            f"{mode.frame_rate_hz:g}",
        )
    print()
    console().print(modes)
    print()
    figures = table("figure", "value", "source", padding=(0, 2, 0, 0))
    for path, value in camera.figures.items():
        if path != "modes":
            source = camera.source(path)
            mark = f"[{1 + camera.sources.index(source)}]"
            figures.add_row(path, _value(value), mark + (" assumed" if source.assumed else ""))
    console().print(figures)
    print()
    for number, source in enumerate(camera.sources, 1):
        assumed = "assumed: " if source.assumed else ""
        modes_too = " (the modes)" if "modes" in source.gives else ""
        console().print(indented(f"[{number}] {assumed}{source.text}{modes_too}", 0))


def _value(value: Any) -> str:
    if hasattr(value, "model_dump"):
        given_of = value.model_dump(exclude_defaults=True)
        return ", ".join(f"{name}: {given(v)}" for name, v in given_of.items())
    return _times(value) if isinstance(value, tuple) else given(value)


def _record(camera: LibraryCamera) -> dict[str, Any]:
    content = camera.model_dump(exclude={"format", "modes", "sources", "camera"})
    return {
        **content,
        "camera": camera.camera,
        "modes": [
            {**mode.model_dump(), "field_of_view_deg": _view(camera, mode.name)}
            for mode in camera.modes
        ],
        "sources": [source.model_dump() for source in camera.sources],
    }
