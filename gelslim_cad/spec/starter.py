"""Texts of specs: a commented one to start from, and one with some values changed."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from gelslim_cad.spec.camera_library import lend_fields, library_camera
from gelslim_cad.spec.gripper_library import library_gripper
from gelslim_cad.spec.spec import Spec
from gelslim_core.yaml.document import RefusedScalarError, resolve
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.fields import Field, children, range_text
from gelslim_core.yaml.reader import load_bytes
from gelslim_core.yaml.suggest import one_of

SPY_CAMERA: dict[str, Any] = {
    "camera.name": "Raspberry Pi spy camera (OV5647)",
    "camera.image_width_px": 640,
    "camera.image_height_px": 480,
    "camera.sensor_width_mm": 3.6288,
    "camera.sensor_height_mm": 2.7216,
    "camera.focal_length_mm": 3.6,
    "camera.f_number": 2.9,
}
"""2592 x 1944 pixels of 1.4 µm, read out as 640 x 480 over the whole sensor; f = 3.60 mm, f/2.9."""

MONO_LIGHT_NM = 525.0
"""Wavelength of both LED strips in a new spec with a mono camera: where its sensor sees most."""

_HEAD = """\
## A GelSlim-type tactile finger. All sizes in the unit that ends the name.
## What is not given takes its default, shown behind "# "; to change one, delete the "# "
## in front of it and of the blocks it lies in. Lines with "##" are remarks.
"""
_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_.\-/ ]*[A-Za-z0-9_.\-/]|[A-Za-z]")


def starter_text(
    name: str,
    gel_length_mm: float = 24.0,
    gel_width_mm: float = 22.0,
    camera: Mapping[str, Any] = SPY_CAMERA,
    model: str = "",
    gripper: str = "",
) -> str:
    """A complete spec called `name`: required fields filled in, all others as comments.

    `camera` gives values by dotted path, unless `model` names a camera of the library, whose
    figures are then the defaults. `gripper` names a gripper of the library. The text is read back
    before it is returned. Raises `InputError` where it would be refused, as for a `name` with
    spaces, and `CameraLibraryError` or `GripperLibraryError` for an unknown model or gripper.
    """
    defaults: dict[str, Any] = {}
    if model:
        camera = {"camera.model": model}
        defaults = {f"camera.{n}": v for n, v in library_camera(model).fields().items()}
        if defaults["camera.picture"] == "mono":
            camera = {**camera, "design.leds.one_wavelength_nm": MONO_LIGHT_NM}
    if gripper:
        library_gripper(gripper)
        camera = {**camera, "design.mount.gripper": gripper}
    values = {
        "format": Spec.model_fields["format"].annotation.__args__[0],  # type: ignore[union-attr]
        "name": name,
        "design.gel.length_mm": gel_length_mm,
        "design.gel.width_mm": gel_width_mm,
        # As bought, a sheet differs by more than any pre-compression of the shims.
        "tolerance.acrylic": "measured",
        **camera,
    }
    text = _HEAD + "\n".join(_block(Spec, "", values, defaults, 0)) + "\n"
    try:
        load_bytes("gelslim new", text.encode(), Spec, lend_fields)
    except InputError as error:
        problems = tuple(replace(problem, line=None, column=None) for problem in error.problems)
        raise InputError(problems) from None
    return text


def require_name(name: str) -> None:
    """Raise `InputError` for a name that no finger may have."""
    starter_text(name)


def _block(
    model: type[BaseModel],
    path: str,
    values: Mapping[str, Any],
    defaults: Mapping[str, Any],
    depth: int,
) -> Iterator[str]:
    for field in children(model, path):
        here = f"{path}.{field.name}" if path else field.name
        if field.models:
            yield from _below(model, replace(field, path=here), values, defaults, depth)
        else:
            default = defaults.get(here, field.default)
            yield _line(replace(field, path=here, default=default), values, depth)


def _below(
    model: type[BaseModel],
    field: Field,
    values: Mapping[str, Any],
    defaults: Mapping[str, Any],
    depth: int,
) -> Iterator[str]:
    inside = list(_block(model, field.path, values, defaults, depth + 1))
    head = f"{'  ' * depth}{field.name}:"
    if depth == 0:
        yield ""
    if not any(given.startswith(f"{field.path}.") for given in values):
        # The marks stand in the column of the block, so that deleting them keeps the indentation.
        inside = [_commented(_uncommented(line), depth) for line in inside]
        head = _commented(head, depth)
    yield f"{head}  # {field.description}" if field.description else head
    yield from inside


def _line(field: Field, values: Mapping[str, Any], depth: int) -> str:
    value = values.get(field.path, field.default)
    limits = range_text(field, field.unit) or (
        one_of(field.choices) if len(field.choices) > 1 else ""
    )
    remark = field.description + (f" ({limits})" if limits else "")
    text = f"{'  ' * depth}{field.name}: {_yaml(value)}" + (f"  # {remark}" if remark else "")
    return text if field.path in values else _commented(text, depth)


def _commented(line: str, depth: int) -> str:
    indent = "  " * depth
    return f"{indent}# {line[len(indent) :]}"


def _uncommented(line: str) -> str:
    return re.sub(r"^( *)# ", r"\1", line)


def _yaml(value: Any) -> str:
    """`value` as YAML that reads back as the very same."""
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) and _is_text(value) else json.dumps(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(_yaml(item) for item in value)}]"
    return json.dumps(value)


def _is_text(value: str) -> bool:
    try:
        return isinstance(resolve(value), str)
    except RefusedScalarError:
        return False


def spec_text(text: str, values: Mapping[str, Any]) -> str:
    """The YAML `text` with the fields at dotted paths set, its comments and order kept.

    Blocks that the text lacks are added.
    """
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    content = yaml.load(text)
    for path, value in values.items():
        *blocks, last = path.split(".")
        inner = content
        for name in blocks:
            if inner.get(name) is None:
                inner[name] = {}
            inner = inner[name]
        inner[last] = value
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()
