"""Which limits set what the finger is arranged for, and what relaxing each of them would gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.checks.relaxation import Relaxation, growing_changes, relaxations
from gelslim_cad.checks.trials import Changes, Trial, Trials
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.spec import Spec
from gelslim_cad.spec.design import Envelope

Figures = Dimensions | Mapping[str, float]

ACTIVE, ACTIVE_MM = 0.004, 0.02
LEAST_GAIN = 0.05
"""In the unit of the goal: mm or px."""
SENTENCES_AT_MOST = 6
AT_ONCE = 12
"""Pairs of steps that are solved together."""


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
    "camera below window": "the room for the camera under the window",
    "camera beside view": "the camera housing beside the view",
    "camera clear of mirror": "the gap between camera and mirror",
    "mirror before camera": "the gap between camera and mirror",
    "camera clear of ledge": "the ledge above the camera",
    "thickness": "the thickness that design.envelope.max_thickness_mm allows",
    "length": "the length that design.envelope.max_length_mm allows",
    "mirror between baffles": "the mirror between the baffles",
    "clamp before seat": "the camera clamp before the mirror's seat",
    "clamp beside channel": "the camera clamp beside the LED channels",
    "cable over cover": "the camera's cable over the back cover",
    "cable under roof": "the roof of the body over the camera's cable",
    "clamp floor": "the clamp's floor under a cable that leaves at the bottom",
}
LARGE_CAMERA_MM = 12.0
"""From this height on a camera is taken for one on a board."""


@dataclass(frozen=True)
class Aim:
    """What camera and mirror are arranged for."""

    cost: Callable[[Figures], Any]
    """The figure of the dimensions that is made least."""
    gain: str
    """What a change does that lowers the cost."""
    state: Callable[[Dimensions], str] | None = None
    """The figure that was reached and that nothing betters; none where it is the thickness."""


THINNEST = Aim(lambda d: d["finger.thickness_mm"], "saves {:.2f} mm of thickness")
SHORTEST = Aim(
    lambda d: d["finger.length_mm"],
    "saves {:.2f} mm of length",
    lambda d: (
        f"Of the fingers within the limits this is the shortest, {d['finger.length_mm']:.2f} mm; "
        "it cannot be shorter"
    ),
)
BEST_PICTURE = Aim(
    lambda d: -_least_px(d),
    "gains {:.2f} px per marker",
    lambda d: (
        "Of the fingers within the limits this one has the best picture, "
        f"{_least_px(d):.2f} px across the smallest marker; there cannot be more"
    ),
)


def _least_px(d: Figures) -> Any:
    return np.minimum(d["view.marker_across_px"], d["view.marker_along_px"])


def aim_of(envelope: Envelope) -> Aim:
    """What the envelope asks camera and mirror to be arranged for."""
    if envelope.goal != "thinnest":
        return SHORTEST if envelope.goal == "shortest" else BEST_PICTURE
    length, pixel_mm = envelope.length_worth, envelope.pixel_worth_mm
    if length == pixel_mm == 0:
        return THINNEST

    def cost(d: Figures) -> Any:
        return d["finger.thickness_mm"] + length * d["finger.length_mm"] - pixel_mm * _least_px(d)

    def state(d: Dimensions) -> str:
        return (
            f"Weighed against each other, {d['finger.thickness_mm']:.2f} mm of thickness, "
            f"{d['finger.length_mm']:.2f} mm of length and {_least_px(d):.2f} px across the "
            "smallest marker are the best; none is better"
        )

    return Aim(cost, "is worth {:.2f} mm of thickness", state)


def binding_sentences(spec: Spec, d: Dimensions) -> tuple[str, ...]:
    """Sentences on what limits the goal, what would better it and what would make the design fit.

    The goal is the thickness unless `design.envelope` states another.
    """
    steps, trials = relaxations(spec), Trials(spec)
    if not d.feasible():
        return _infeasible(d, steps, trials)
    aim = aim_of(spec.design.envelope)
    return _what_binds(d, aim), *_gains(d, aim, steps, trials), *_outside(d, steps, trials)


def _keeps_envelope(envelope: Envelope, chosen: Changes, trial: Trial, aim: Aim) -> bool:
    """Whether a relaxed design is feasible and within its envelope.

    The thickness is a limit only where it is not what is made least.
    """
    given = {"max_length_mm": envelope.max_length_mm}
    if aim is not THINNEST:
        given["max_thickness_mm"] = envelope.max_thickness_mm
    changed = {s.path: s.value for s in chosen}
    return trial.is_feasible and all(
        trial.figures[f"finger.{name.removeprefix('max_')}"]
        <= changed.get(f"design.envelope.{name}", math.inf if limit is None else limit) + 1e-9
        for name, limit in given.items()
    )


def _what_binds(d: Dimensions, aim: Aim) -> str:
    if aim.state is not None:
        active = _active(d)
        return aim.state(d) + (f" because of {_list(active)}." if active else ".")
    depths = {
        "mirror": d["finger.mirror_depth_mm"],
        "camera": d["finger.camera_depth_mm"],
        "guide": d["guide.stack_mm"],
    }
    setter = max(depths, key=lambda k: depths[k])
    text = f"Thickness {d['finger.thickness_mm']:.2f} mm is set by {SETTERS[setter]}"
    active = [words for words in _active(d) if words != LIMITS["thickness"]]
    if setter == "guide" or not active:
        return text + "."
    return f"{text}; it cannot be less because of {_list(active)}."


def _active(d: Dimensions) -> list[str]:
    """The limits that the fold touches, in words."""
    return [
        LIMITS[name]
        for limits, slack in ((d.fold.violations, ACTIVE), (d.fold.housing, ACTIVE_MM))
        for name, value in limits.items()
        if name in LIMITS and float(np.reshape(value, -1)[0]) > -slack
    ]


def _gains(
    d: Dimensions, aim: Aim, steps: tuple[Relaxation, ...], trials: Trials
) -> tuple[str, ...]:
    """What each concession would gain, the largest first."""
    here, envelope = float(aim.cost(d)), trials.spec.design.envelope
    gains = [
        (here - float(aim.cost(trial.figures)), step.words)
        for step, trial in zip(steps, trials.of([(s,) for s in steps]), strict=True)
        if _keeps_envelope(envelope, (step,), trial, aim)
    ]
    gains = sorted((g for g in gains if g[0] > LEAST_GAIN), key=lambda g: -g[0])
    return tuple(
        f"{words[0].upper()}{words[1:]} {aim.gain.format(gain)}."
        for gain, words in gains[:SENTENCES_AT_MOST]
    )


def _outside(d: Dimensions, steps: tuple[Relaxation, ...], trials: Trials) -> tuple[str, ...]:
    """By how much the finger is outside its envelope, and what would make it fit."""
    envelope = trials.spec.design.envelope
    over = [
        f"design.envelope.max_{side}_mm allows {limit:g} mm; {size - limit:.2f} mm must be saved."
        for side, size, limit in (
            ("thickness", float(d["finger.thickness_mm"]), envelope.max_thickness_mm),
            ("length", float(d["finger.length_mm"]), envelope.max_length_mm),
        )
        if limit is not None and size > limit + 1e-9
    ]
    if not over:
        return ()
    thickness = math.inf if envelope.max_thickness_mm is None else envelope.max_thickness_mm
    return *over, *_what_fits(trials, steps, thickness)


def _infeasible(d: Dimensions, steps: tuple[Relaxation, ...], trials: Trials) -> tuple[str, ...]:
    missed = sorted(
        ((float(np.reshape(v, -1)[0]), n) for n, v in d.fold.violations.items()), reverse=True
    )
    names = [LIMITS.get(n, n) for v, n in missed if v > 1e-6]
    limit = trials.spec.design.envelope.max_thickness_mm
    within = "" if limit is None else f", let alone within {limit:g} mm"
    text = f"No finger of this gel and camera keeps every limit{within}; missed: {_list(names)}."
    if limit is None:
        return (text, *_what_fits(trials, steps, math.inf))
    thicker = "In a thicker finger it would fit with"
    return (
        text,
        *_what_fits(trials, steps, limit),
        *(s.replace("It would fit with", thicker) for s in _what_fits(trials, steps, math.inf)),
    )


def _what_fits(trials: Trials, steps: tuple[Relaxation, ...], limit: float) -> tuple[str, ...]:
    """Changes that make the design feasible and thin enough: one step, one field or two steps."""
    if smaller := _smaller_camera(trials, limit):
        return (smaller,)
    steps = tuple(s for s in steps if not s.path.startswith("design.envelope."))
    series = growing_changes(trials.spec)
    fits = _fitting(trials, [(s,) for s in steps], limit)
    single = [(thickness, s.words) for (s,), thickness in fits.items()]
    if single:
        best, words = min(single)
        return (f"It would fit with {words}: {best:.2f} mm.",)
    fits = _fitting(trials, [(s,) for changes in series for s in changes], limit)
    alone = [next((s for s in changes if (s,) in fits), None) for changes in series]
    ways = [f"{s.words} ({fits[(s,)]:.2f} mm)" for s in alone if s is not None]
    if ways:
        return (f"It would fit with {' or with '.join(ways)}.",)
    if pair := _fitting_pair(trials, steps, limit):
        chosen, thickness = pair
        return (f"It would fit with {_list([s.words for s in chosen])}: {thickness:.2f} mm.",)
    return (
        "No one field alone and no two of the usual steps make it fit: use a smaller gel and "
        "a camera with a wider field of view or a smaller aperture, or allow a thicker finger.",
    )


def _fitting_pair(trials: Trials, steps: Changes, limit: float) -> tuple[Changes, float] | None:
    """Of the pairs of steps that fit a thin one, with its thickness; None if no pair fits.

    A step only widens a limit or shrinks what must fit. Where a step does not fit together with
    all weaker ones, it therefore fits with none of them. The pairs that are left are solved in
    lists, the most promising first; the thinnest of the first list that holds any is taken.
    """
    alone = trials.of([(step,) for step in steps])
    saving = {s: trial.thickness_mm for s, trial in zip(steps, alone, strict=True)}
    order = tuple(sorted(steps, key=lambda s: saving[s]))
    groups = [order[k:] for k in range(len(order) - 1)]
    fits = _fitting(trials, groups, limit)
    pairs = [(group[0], other) for group in groups if group in fits for other in group[1:]]
    pairs.sort(key=lambda pair: sum(saving[s] for s in pair))
    for start in range(0, len(pairs), AT_ONCE):
        found = _fitting(trials, pairs[start : start + AT_ONCE], limit)
        if found:
            chosen = min(found, key=lambda c: found[c])
            return chosen, found[chosen]
    return None


def _smaller_camera(trials: Trials, limit: float) -> str | None:
    """The largest camera housing with which a finger fits whose camera stands on a large board."""
    camera = trials.spec.camera
    if camera.module_height_mm < LARGE_CAMERA_MM:
        return None
    least = max(1.0, camera.lens_diameter_mm)
    sizes = np.arange(math.floor(2 * camera.module_height_mm) / 2 - 0.5, least - 1e-9, -0.5)
    sets = [
        tuple(
            Relaxation(f"camera.module_{side}_mm", min(size, given), "")
            for side, given in (
                ("height", camera.module_height_mm),
                ("width", camera.module_width_mm),
            )
        )
        for size in map(float, sizes)
    ]
    fits = _fitting(trials, sets, limit)
    if not fits:
        return None
    (height, width), thickness = next(iter(fits.items()))
    return (
        f"A camera whose housing is at most {width.value:g} x {height.value:g} mm would fit: "
        f"{thickness:.2f} mm. Take the bare module, or a version on a flex cable, in place of one "
        f"on a board of {camera.module_width_mm:g} x {camera.module_height_mm:g} mm."
    )


def _fitting(trials: Trials, sets: Sequence[Changes], limit: float) -> dict[Changes, float]:
    """Those sets of relaxations that fit, each with the thickness it gives."""
    envelope = trials.spec.design.envelope
    return {
        chosen: trial.thickness_mm
        for chosen, trial in zip(sets, trials.of(sets), strict=True)
        if _keeps_envelope(envelope, chosen, trial, THINNEST) and trial.thickness_mm <= limit + 1e-9
    }


def _list(words: list[str]) -> str:
    unique = list(dict.fromkeys(words))
    if len(unique) < 2:
        return "".join(unique)
    return ", ".join(unique[:-1]) + " and " + unique[-1]
