"""Relaxations of a design: spec fields changed by a usual step or by growing amounts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.dimensions import DimensionsBatch, derive_batch
from gelslim_cad.spec import Spec


@dataclass(frozen=True)
class Relaxation:
    """A change of one spec field that relaxes the design: its path, its new value, its name."""

    path: str
    value: float
    words: str


def relaxations(spec: Spec) -> tuple[Relaxation, ...]:
    """One usual step per field, each within the spec's legal range."""
    c, g, o = spec.camera, spec.design, spec.design.optics
    steps = [
        Relaxation(
            "design.optics.blur_per_diameter",
            min(2.0, o.blur_per_diameter + 0.1 / g.markers.diameter_mm),
            "allowing 0.1 mm more blur",
        ),
        Relaxation(
            "camera.f_number", min(64.0, c.f_number * math.sqrt(2)), "one stop less aperture"
        ),
        Relaxation(
            "design.optics.min_px_per_marker",
            max(1.0, o.min_px_per_marker - 1),
            "one pixel less per marker",
        ),
        Relaxation(
            "design.optics.max_keystone", min(5.0, o.max_keystone + 0.2), "0.2 more keystone"
        ),
        Relaxation("camera.lens_travel_mm", c.lens_travel_mm + 0.2, "0.2 mm more lens travel"),
        Relaxation(
            "camera.module_height_mm",
            max(1.0, c.module_height_mm - 1),
            "a camera housing 1 mm lower",
        ),
        Relaxation("design.gel.length_mm", g.gel.length_mm - 2, "a gel 2 mm shorter"),
        Relaxation("design.gel.width_mm", g.gel.width_mm - 2, "a gel 2 mm narrower"),
        Relaxation(
            "design.gel.thickness_mm",
            max(0.5, g.gel.thickness_mm - 0.5),
            "a gel 0.5 mm thinner",
        ),
        *_longer(spec),
        *_thicker(spec),
        *_thinner_acrylic(spec),
        *_tighter_bend(spec),
        Relaxation(
            "design.housing.back_wall_mm",
            max(0.4, g.housing.back_wall_mm - 0.2),
            "a back wall 0.2 mm thinner",
        ),
        Relaxation(
            "design.mirror.border_mm", max(0.0, g.mirror.border_mm - 0.3), "0.3 mm less border"
        ),
    ]
    return _legal(spec, steps)


def growing_changes(spec: Spec) -> tuple[tuple[Relaxation, ...], ...]:
    """For each field growing changes, to find how far that field alone must change."""
    c, g, o = spec.camera, spec.design, spec.design.optics
    lengths = [0.5 * math.floor(2 * g.gel.length_mm * (1 - 0.08 * k)) for k in range(1, 11)]
    stops = [c.f_number * math.sqrt(2) ** k for k in range(2, 7)]
    blurs = [b for b in (0.5, 0.75, 1.0, 1.5) if b > o.blur_per_diameter]
    found = [
        [Relaxation("design.gel.length_mm", v, f"a gel {v:g} mm long") for v in lengths],
        [Relaxation("camera.f_number", v, f"an aperture of f/{v:.1f}") for v in stops if v <= 64],
        [
            Relaxation(
                "design.optics.blur_per_diameter", b, f"blur of up to {b:g} marker diameters"
            )
            for b in blurs
        ],
    ]
    pixels = [v for v in (5.0, 4.0, 3.0) if v < o.min_px_per_marker]
    found.append(
        [
            Relaxation("design.optics.min_px_per_marker", v, f"only {v:g} px per marker")
            for v in pixels
        ]
    )
    if c.horizontal_fov_deg is None and c.vertical_fov_deg is None:
        focal = [c.focal_length_mm * part for part in (0.85, 0.7, 0.55)]
        found.append(
            [Relaxation("camera.focal_length_mm", v, f"a lens of f = {v:.2g} mm") for v in focal]
        )
    return tuple(_legal(spec, steps) for steps in found)


def _thicker(spec: Spec) -> Iterable[Relaxation]:
    """Where the thickness is a limit and not the goal."""
    envelope = spec.design.envelope
    thickest = envelope.max_thickness_mm
    weighed = envelope.length_worth > 0 or envelope.pixel_worth_mm > 0
    if thickest is not None and (weighed or envelope.goal != "thinnest"):
        path = "design.envelope.max_thickness_mm"
        yield Relaxation(path, min(300.0, thickest + 1), "allowing 1 mm more thickness")


def _longer(spec: Spec) -> Iterable[Relaxation]:
    longest = spec.design.envelope.max_length_mm
    if longest is not None:
        path = "design.envelope.max_length_mm"
        yield Relaxation(path, min(600.0, longest + 5), "allowing 5 mm more length")


def _tighter_bend(spec: Spec) -> Iterable[Relaxation]:
    ratio = spec.design.light_guide.bend_radius_ratio
    if ratio != "auto":
        path, words = "design.light_guide.bend_radius_ratio", "a bend radius ratio smaller by 0.5"
        yield Relaxation(path, max(0.5, ratio - 0.5), words)


def _thinner_acrylic(spec: Spec) -> Iterable[Relaxation]:
    """The next thinner sheet on sale that still holds the LEDs."""
    leds = spec.design.leds
    least = leds.package_mm + 2 * leds.placement_tolerance_mm
    here = spec.design.light_guide.thickness_mm
    fitting = [t for t in spec.manufacturing.acrylic_stock_mm if least <= t < here]
    if fitting:
        thickness = max(fitting)
        yield Relaxation(
            "design.light_guide.thickness_mm", thickness, f"acrylic of {thickness:g} mm"
        )


def _legal(spec: Spec, steps: Iterable[Relaxation]) -> tuple[Relaxation, ...]:
    """The steps that change a value and that the spec would accept."""
    gel, markers = spec.design.gel, spec.design.markers

    def least(count: int | None) -> float:
        lattice = 0 if count is None else (count - 1) * markers.pitch_mm + markers.diameter_mm
        return max(5.0, 2 * gel.corner_radius_mm, lattice)

    floors = {
        "design.gel.length_mm": least(markers.rows),
        "design.gel.width_mm": least(markers.columns),
    }
    return tuple(
        s
        for s in steps
        if s.value >= floors.get(s.path, -math.inf) and s.value != given(spec, s.path)
    )


def given(spec: Spec, path: str) -> Any:
    """The value of the field at a dotted path."""
    value: Any = spec
    for name in path.split("."):
        value = getattr(value, name)
    return value


def derive_each(spec: Spec, designs: Sequence[Mapping[str, float]]) -> DimensionsBatch:
    """Dimensions of the spec with each set of fields changed, by path, in one batch."""
    paths = sorted({path for changes in designs for path in changes})
    columns = {
        path: np.array([changes.get(path, given(spec, path)) for changes in designs], dtype=float)
        for path in paths
    }
    return derive_batch(spec, columns)
