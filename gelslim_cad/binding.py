"""What binds the finger's thickness, and what it would gain from giving way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.dimensions import Dimensions, derive_batch
from gelslim_cad.spec import Spec

ACTIVE = 0.004
LEAST_SAVING_MM = 0.05
SENTENCES_AT_MOST = 6


@dataclass(frozen=True)
class Relaxation:
    """One way to give way: which spec field changes, to what, and in words."""

    path: str
    value: float
    words: str


SETTERS = {
    "mirror": "the depth of the mirror under the window",
    "camera": "the height of the camera housing",
    "guide": "the bend, leg and LED board of the light guide",
}
LIMITS = {
    "blur": "blur at the far edge",
    "field of view along": "the field of view along the finger",
    "field of view across": "the field of view across the finger",
    "pixels per marker": "the pixels per marker at the far edge",
    "keystone": "the keystone limit",
    "lens travel": "how far the lens can be unscrewed",
    "camera below window": "the camera housing, which must stay under the window",
    "camera beside view": "the camera housing beside the view",
    "camera clear of mirror": "the gap between camera and mirror",
    "mirror before camera": "the gap between camera and mirror",
    "camera clear of ledge": "the ledge above the camera",
}


def relaxations(spec: Spec) -> tuple[Relaxation, ...]:
    """The steps that are tried, each within the spec's legal range."""
    c, g, o = spec.camera, spec.design, spec.design.optics
    diameter = g.markers.diameter_mm
    more_blur = o.blur_per_diameter + 0.1 / diameter
    return (
        Relaxation(
            "design.optics.blur_per_diameter", min(2.0, more_blur), "allowing 0.1 mm more blur"
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
        Relaxation("design.gel.length_mm", max(5.0, g.gel.length_mm - 2), "a gel 2 mm shorter"),
        Relaxation("design.gel.width_mm", max(5.0, g.gel.width_mm - 2), "a gel 2 mm narrower"),
        Relaxation(
            "design.gel.thickness_mm",
            max(0.3, g.gel.thickness_mm - 0.5),
            "a gel 0.5 mm thinner",
        ),
        Relaxation(
            "design.light_guide.bend_radius_ratio",
            max(0.1, g.light_guide.bend_radius_ratio - 0.5),
            "a bend radius ratio smaller by 0.5",
        ),
        Relaxation(
            "design.housing.back_wall_mm",
            max(0.4, g.housing.back_wall_mm - 0.2),
            "a back wall 0.2 mm thinner",
        ),
        Relaxation(
            "design.mirror.border_mm", max(0.0, g.mirror.border_mm - 0.3), "0.3 mm less border"
        ),
    )


def binding_sentences(spec: Spec, d: Dimensions) -> tuple[str, ...]:
    """Plain sentences: what sets the thickness, what gives, and what would make it fit."""
    steps = relaxations(spec)
    tried = _try(spec, [(s,) for s in steps])
    if not bool(np.all(d.feasible())):
        return _infeasible(spec, d, steps)
    thickness = float(d["finger.thickness_mm"])
    return (
        _what_binds(d, thickness),
        *_savings(steps, tried, thickness),
        *_too_thick(spec, steps, thickness),
    )


def _try(spec: Spec, sets: list[tuple[Relaxation, ...]]) -> tuple[Any, Any]:
    """Thickness and feasibility of the spec under each set of relaxations, in one batch."""
    paths = {s.path for chosen in sets for s in chosen}
    given = spec.model_dump()
    columns = {}
    for path in sorted(paths):
        here: Any = given
        for name in path.split("."):
            here = here[name]
        columns[path] = np.array(
            [next((s.value for s in chosen if s.path == path), here) for chosen in sets],
            dtype=float,
        )
    batch = derive_batch(spec, columns)
    return batch["finger.thickness_mm"], batch.feasible()


def _what_binds(d: Dimensions, thickness: float) -> str:
    depths = {
        "mirror": d["finger.mirror_depth_mm"],
        "camera": d["finger.camera_depth_mm"],
        "guide": d["guide.stack_mm"],
    }
    setter = max(depths, key=lambda k: depths[k])
    text = f"Thickness {thickness:.2f} mm is set by {SETTERS[setter]}"
    if setter == "guide":
        return text + "."
    active = [
        LIMITS[name]
        for name, value in d.fold.violations.items()
        if name in LIMITS and float(np.reshape(value, -1)[0]) > -ACTIVE
    ]
    if not active:
        return text + "."
    return f"{text}; it cannot be less because of {_list(active)}."


def _savings(
    steps: tuple[Relaxation, ...], tried: tuple[Any, Any], thickness: float
) -> tuple[str, ...]:
    gains = [
        (thickness - float(t), s.words)
        for s, t, ok in zip(steps, *tried, strict=True)
        if ok and thickness - t > LEAST_SAVING_MM
    ]
    gains.sort(key=lambda g: -g[0])
    return tuple(
        f"{words[0].upper()}{words[1:]} saves {gain:.2f} mm of thickness."
        for gain, words in gains[:SENTENCES_AT_MOST]
    )


def _too_thick(spec: Spec, steps: tuple[Relaxation, ...], thickness: float) -> tuple[str, ...]:
    limit = spec.design.envelope.max_thickness_mm
    if limit is None or thickness <= limit:
        return ()
    start = f"The envelope allows {limit:g} mm; {thickness - limit:.2f} mm must be saved."
    found = _first_that_fits(spec, steps, limit)
    return (f"{start} {found}",)


def _infeasible(spec: Spec, d: Dimensions, steps: tuple[Relaxation, ...]) -> tuple[str, ...]:
    missed = sorted(
        ((float(np.reshape(v, -1)[0]), n) for n, v in d.fold.violations.items()), reverse=True
    )
    names = [LIMITS.get(n, n) for v, n in missed if v > 1e-6]
    text = f"No finger of this gel and camera keeps every limit; missed: {_list(names)}."
    limit = spec.design.envelope.max_thickness_mm
    return (text, _first_that_fits(spec, steps, math.inf if limit is None else limit))


def _first_that_fits(spec: Spec, steps: tuple[Relaxation, ...], limit: float) -> str:
    """The fewest steps, at most two, that make the design feasible and thin enough."""
    for size in (1, 2):
        sets = [
            chosen
            for chosen in _combinations(steps, size)
            if len({s.path for s in chosen}) == len(chosen)
        ]
        thickness, feasible = _try(spec, sets)
        fits = [
            (float(t), chosen)
            for t, ok, chosen in zip(thickness, feasible, sets, strict=True)
            if ok and t <= limit
        ]
        if fits:
            best, chosen = min(fits, key=lambda f: f[0])
            words = _list([s.words for s in chosen])
            return f"It would fit with {words}: {best:.2f} mm."
    return (
        "No one or two of the usual steps make it fit: use a smaller gel, a camera with a wider "
        "field of view and a smaller aperture, or allow a thicker finger."
    )


def _combinations(steps: tuple[Relaxation, ...], size: int) -> list[tuple[Relaxation, ...]]:
    if size == 1:
        return [(s,) for s in steps]
    return [(a, b) for i, a in enumerate(steps) for b in steps[i + 1 :]]


def _list(words: list[str]) -> str:
    unique = list(dict.fromkeys(words))
    if len(unique) < 2:
        return "".join(unique)
    return ", ".join(unique[:-1]) + " and " + unique[-1]
