"""Random legal specs from a seed, across the whole range that the models allow.

Three kinds are mixed. A plausible spec varies a design that can be built: a good share of them
reaches CAD. An edged spec is a plausible one with a few fields drawn anew from their whole legal
range, limits themselves included. A wild spec draws every field from its whole range, so most are
refused by the rules, and none may end in anything but a reason.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError

from gelslim_cad.spec import Spec
from gelslim_cad.spec.camera import camera_names
from gelslim_cad.spec.camera_library import library_camera

from .plausible import plausible, short
from .ranges import LEAVES, anywhere

Kind = Literal["plausible", "edged", "wild"]
KINDS: tuple[Kind, ...] = ("plausible", "edged", "wild")
SHARES = (0.5, 0.35, 0.15)
MOST_TRIES = 400
STIFF_GEL_MPA = 5.0


Values = dict[str, Any]


@dataclass(frozen=True)
class Sample:
    """A random legal spec; `text` is its file."""

    seed: int
    index: int
    kind: Kind
    spec: Spec
    text: str


def sample(seed: int, index: int) -> Sample:
    """Spec `index` of the sequence of `seed`; the same on every machine."""
    rng = np.random.default_rng([seed, index])
    kind: Kind = KINDS[int(rng.choice(len(KINDS), p=SHARES))]
    for _ in range(MOST_TRIES):
        values = _wild(rng) if kind == "wild" else plausible(rng)
        if kind == "edged":
            _edge(rng, values)
        text = as_text(f"s{seed}-{index}", values)
        try:
            spec = Spec.model_validate_json(text)
        except ValidationError:
            continue
        return Sample(seed, index, kind, spec, text)
    raise AssertionError(f"no legal spec drawn for seed {seed}, index {index}")


def distorted(drawn: Sample, rng: np.random.Generator) -> Sample:
    """The same spec with a lens that distorts, and without a field of view that may disagree."""
    data = json.loads(drawn.text)
    for name in ("horizontal_fov_deg", "vertical_fov_deg", "field_of_view_at_mm"):
        data["camera"].pop(name, None)
    if data["camera"].get("focusing") == "internal":
        data["camera"]["focusing"] = "unit"
    for _ in range(MOST_TRIES):
        data["camera"]["distortion"] = _distortion(rng)
        text = json.dumps(data, indent=1, ensure_ascii=False)
        try:
            spec = Spec.model_validate_json(text)
        except ValidationError:
            continue
        return Sample(drawn.seed, drawn.index, drawn.kind, spec, text)
    raise AssertionError(f"no lens fits spec {drawn.index} of seed {drawn.seed}")


def _distortion(rng: np.random.Generator) -> Values:
    kind = rng.integers(3)
    if kind == 0:
        return {"tv_percent": short(rng.uniform(-12, 5))}
    k = {f"k{n + 1}": short(rng.normal(0, size)) for n, size in enumerate((0.15, 0.08, 0.03))}
    return k if kind == 1 else {"model": "kannala_brandt", **k}


def as_text(name: str, values: Values) -> str:
    """The spec as a file: JSON is YAML."""
    data: dict[str, Any] = {"format": "gelslim-spec/1", "name": name}
    for path, value in values.items():
        if value is None:
            continue
        *blocks, key = path.split(".")
        block = data
        for part in blocks:
            block = block.setdefault(part, {})
        block[key] = value
    return json.dumps(data, indent=1, ensure_ascii=False)


def _edge(rng: np.random.Generator, values: Values) -> None:
    """Draw a few fields anew from their whole range."""
    for path in rng.choice(list(LEAVES), size=int(rng.integers(1, 4)), replace=False):
        values[str(path)] = anywhere(rng, LEAVES[str(path)])
        if path in ("camera.model", "camera.mode"):
            values |= _of_library(rng)
    ratio = values["camera.image_height_px"] / values["camera.image_width_px"]
    values["camera.sensor_height_mm"] = short(values["camera.sensor_width_mm"] * ratio, 8)
    _both_cell_counts(values, 17)
    _own_led(rng, values)


def _own_led(rng: np.random.Generator, values: Values) -> None:
    """The fields of an LED that the library does not have: all of them, or none."""
    own = [path for path in LEAVES if path.startswith("electronics.own_")]
    volts, *rest = own
    given = rng.random() < 0.3
    values[volts] = [short(v) for v in rng.uniform(1.3, 4.0, 2)] if given else []
    for path in rest:
        drawn = anywhere(rng, LEAVES[path])
        values[path] = (80.0 if drawn is None else drawn) if given else None


def _of_library(rng: np.random.Generator) -> Values:
    """A camera of the library and one of its modes."""
    name = str(rng.choice(camera_names()))
    mode = str(rng.choice([m.name for m in library_camera(name).modes]))
    return {"camera.model": name, "camera.mode": mode}


def _both_cell_counts(values: Values, count: int) -> None:
    if (values["mesh.cells_along"] is None) != (values["mesh.cells_across"] is None):
        values["mesh.cells_along"] = values["mesh.cells_across"] = count


def _wild(rng: np.random.Generator) -> Values:
    values = {path: anywhere(rng, leaf) for path, leaf in LEAVES.items()}
    _agree_camera(rng, values)
    length, width = values["design.gel.length_mm"], values["design.gel.width_mm"]
    radius = min(length, width) / 2
    if values["design.gel.corner_radius_mm"] > radius:
        values["design.gel.corner_radius_mm"] = float(rng.choice([radius, radius / 3]))
    diameter, pitch = values["design.markers.diameter_mm"], values["design.markers.pitch_mm"]
    if diameter >= pitch:
        diameter = values["design.markers.diameter_mm"] = short(pitch * rng.uniform(0.3, 0.95))
    for path, side in (("design.markers.rows", length), ("design.markers.columns", width)):
        most = int((side - diameter) / pitch)
        if values[path] is not None:
            values[path] = min(values[path], most) if most >= 5 else None
    _both_cell_counts(values, int(rng.integers(1, 401)))
    _own_led(rng, values)
    if values["design.leds.one_wavelength_nm"] is not None:
        values["design.leds.light"] = "red_green"
    values["manufacturing.printer_mm"] = [short(v) for v in rng.uniform(50, 1000, 3)]
    if values["material.gel.youngs_modulus_mpa"] > STIFF_GEL_MPA:
        values["material.allow_stiff_gel"] = True
    return values


def _agree_camera(rng: np.random.Generator, values: Values) -> None:
    """Make pixels square, the lens narrower than its module and fields of view true."""
    height, width = sorted((values["camera.image_width_px"], values["camera.image_height_px"]))
    height = max(height, math.ceil(width / 100))
    least = 0.31 * width / height
    sensor = short(math.exp(rng.uniform(math.log(least), math.log(40))), 6)
    portrait = width > height and values["camera.orientation"] == "portrait"
    across, along = ("height", "width") if portrait else ("width", "height")
    values |= {"camera.model": None, "camera.mode": None} | {
        "camera.orientation": "portrait" if portrait else "landscape",
        f"camera.image_{across}_px": width,
        f"camera.image_{along}_px": height,
        f"camera.sensor_{across}_mm": sensor,
        f"camera.sensor_{along}_mm": short(sensor * height / width, 8),
    }
    if rng.random() < 0.5:
        values |= _of_library(rng)
    lens = values["camera.lens_diameter_mm"]
    values["camera.lens_diameter_mm"] = min(lens, values["camera.module_width_mm"])
    for axis, side in (("horizontal", "width"), ("vertical", "height")):
        half = values[f"camera.sensor_{side}_mm"] / 2 / values["camera.focal_length_mm"]
        angle = short(math.degrees(2 * math.atan(half)) * rng.uniform(0.96, 1.04))
        given = 1 < angle < 170 and rng.random() < 0.4
        values[f"camera.{axis}_fov_deg"] = angle if given else None
