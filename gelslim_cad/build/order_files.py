"""The unit of the order of assembly: its proof, pictures of its steps and of the finger."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gelslim_cad.build.fingerprint import combined
from gelslim_cad.build.manifest import json_bytes
from gelslim_cad.build.work import Files, PackedPart, Unit, Written
from gelslim_cad.geometry.overlay import Overlay
from gelslim_cad.geometry.part import Part

if TYPE_CHECKING:
    from gelslim_cad.assembly.order import Step

ASSEMBLY_JSON = "assembly.json"
SECTION_MM = 0.013
"""Position of the sections: off the mid-plane, so that none runs along a face."""
FINGER_PICTURES = {
    "whole": "printed_dots",
    "exploded": "printed_dots",
    "section": "camera_view",
    "section_across": "",
}
"""Pictures of the whole finger, with the name of the overlay that each shows."""


def order_unit(
    parts: tuple[PackedPart, ...],
    name: str,
    steps: Sequence[Step],
    tail_x_mm: float,
    overlays: Sequence[Overlay],
) -> Unit:
    """The unit, whose files are kept one by one: most pictures show no overlay.

    Args:
        parts: The parts of the finger.
        name: Its name.
        steps: The order of its assembly.
        tail_x_mm: Where cable and wires have left the finger, see `bodies`.
        overlays: What pictures show beside the parts.

    Returns:
        The unit for `write_order`.
    """
    order = (("name", name), ("steps", tuple(steps)), ("tail_x_mm", tail_x_mm))
    shown = {overlay.name: overlay.packed() for overlay in overlays}
    bare = Unit("order", "order", parts, order).key()
    keys = {ASSEMBLY_JSON: bare}
    keys |= {step_picture(number, step.key): bare for number, step in enumerate(steps, start=1)}
    for kind, overlay in FINGER_PICTURES.items():
        seen = repr(shown.get(overlay)) if overlay else ""
        keys[finger_picture(kind)] = combined(bare, seen)
    options = (*order, *shown.items())
    return Unit("order", "order", parts, options, cost=50, file_keys=tuple(keys.items()))


def write_order(
    parts: Sequence[Part],
    name: str,
    steps: Sequence[Step],
    tail_x_mm: float,
    camera_view: tuple[Any, ...] | None = None,
    printed_dots: tuple[Any, ...] | None = None,
    known: Mapping[str, bytes] | None = None,
) -> Written:
    """The order of assembly, proved, and pictures of its steps and of the finger.

    Dots and view are overlays as `Overlay.packed` gives them; what is None is not drawn. Files
    that are `known` are not made again. There are no pictures where VTK cannot draw.

    Raises AssemblyBlockedError where a step is blocked.
    """
    from gelslim_cad.assembly.bodies import bodies, part_meshes
    from gelslim_cad.assembly.proof import prove
    from gelslim_cad.assembly.record import assembly_record, read_steps
    from gelslim_cad.assembly.scenes import step_scene
    from gelslim_cad.pictures.finger_pictures import Shown, picture_set
    from gelslim_cad.pictures.shaded_mesh import shaded_mesh
    from gelslim_cad.pictures.step_pictures import picture_steps
    from gelslim_cad.pictures.window import PictureError, offscreen_window

    known = known or {}
    meshes = part_meshes(parts)
    if ASSEMBLY_JSON in known:
        data = known[ASSEMBLY_JSON]
    else:
        proven = prove(steps, bodies(meshes, tail_x_mm))
        data = json_bytes(assembly_record(name, proven))
    files: Files = {ASSEMBLY_JSON: (data, "order of assembly with ways, fasteners and drivers")}
    of_steps = {
        step_picture(number, step.key): step
        for number, step in enumerate(read_steps(json.loads(data)), start=1)
    }
    colours = {part.name: part.colour for part in parts}
    shaded = {part: shaded_mesh(*mesh) for part, mesh in meshes.items()}
    shown = [Shown(shaded[p.name], p.colour, p.explode_mm) for p in parts]
    explode = {part.name: part.explode_mm for part in parts}
    view, dots = (
        None if packed is None else _drawn(Overlay.unpacked(packed), explode)
        for packed in (camera_view, printed_dots)
    )
    left = [path for path in of_steps if path not in known]
    kinds = [kind for kind in FINGER_PICTURES if finger_picture(kind) not in known]
    try:
        with offscreen_window() as window:
            drawn = picture_steps(
                window, [step_scene(of_steps[path], shaded, colours) for path in left]
            )
            whole = picture_set(window, shown, SECTION_MM, dots, view, kinds)
    except PictureError as error:
        return Written(files, note=str(error))
    pictures = {**known, **dict(zip(left, drawn, strict=True))}
    pictures |= {finger_picture(kind): png for kind, png in whole.items()}
    files |= {path: (pictures[path], "picture of a step of the assembly") for path in of_steps}
    for kind in FINGER_PICTURES:
        path = finger_picture(kind)
        files[path] = (pictures[path], "picture")
    return Written(files)


def step_picture(number: int, key: str) -> str:
    """Path of the picture of a step."""
    return f"pictures/assembly/{number:02d}_{key}.png"


def finger_picture(kind: str) -> str:
    """Path of a picture of the whole finger."""
    return f"pictures/{kind}.png"


def _drawn(overlay: Overlay, explode: dict[str, tuple[float, float, float]]) -> Any:
    """An overlay as the pictures take it."""
    shift = explode.get(overlay.with_part, (0.0, 0.0, 0.0))
    return overlay.name, overlay.vertices_mm, overlay.faces, overlay.colour, shift
