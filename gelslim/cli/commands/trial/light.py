"""`gelslim light`: certificate, flux ledger, comparison and exposure of the light guide."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import console, print_json, progress_bar, say, table
from gelslim.cli.budget import budget_of, keep_times, note_choice
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, DrawPictures, SpecFile, out_folder
from gelslim.cli.output import replace_file, require_own_files

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gelslim_cad.dimensions import Dimensions
    from gelslim_cad.light.study import Comparison, LightStudy, Progress, TipLight
    from gelslim_cad.spec import Spec
    from gelslim_core.budget.budget import Budget
    from gelslim_optics.light.result import Estimate, LightResult

PICTURES = ("light_paths.png", "irradiance.png", "light_ratio.png")
FIRST = "delivered"
"""Entry of the ledger that is printed first; the others follow by size."""
LEAST_SHARE = 5e-4
"""Smallest part of all light that is printed."""
MARK = "gelslim light"
"""Text in the first picture, by which a picture of an earlier run is recognised."""

RaysPerGuide = Annotated[
    int | None,
    typer.Option(min=1024, max=1 << 28, help="Number of rays per guide; by default 131072."),
]
LightError = Annotated[
    str | None,
    typer.Option(
        help="Largest error of the light of any colour on the coat (half of its 95 % interval), "
        "such as 1%; it chooses the rays."
    ),
]
TraceTime = Annotated[
    str | None,
    typer.Option(
        "--time",
        "--time-ms",
        help="Largest time of the study, such as 2s, without pictures; it chooses the rays.",
    ),
]


def light(
    spec: SpecFile,
    out: Annotated[Path | None, out_folder("out/NAME-light", "Folder of the pictures")] = None,
    rays: RaysPerGuide = None,
    error: LightError = None,
    within: TraceTime = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers of the rays.")] = 0,
    pictures: DrawPictures = True,
    as_json: AsJson = False,
) -> int:
    """Trace the light guide and compare it with straight guides.

    Prints the certificate of total internal reflection, where the light goes, the brightness
    against straight guides with 45° mirrors, exposure and frame rate. Writes pictures.
    """
    from gelslim_cad.dimensions import derive
    from gelslim_cad.light.study import RAYS, study_light, study_record
    from gelslim_cad.tolerance.asked import read_spec

    started = time.monotonic()
    loaded = read_spec(spec)
    d = derive(loaded.spec)
    budget = budget_of(error, within)
    if rays is not None and not budget.unlimited:
        raise CommandError("give --rays or a budget (--error, --time), not both")
    folder = out or Path("out") / f"{loaded.spec.name}-light"
    if pictures:
        require_own_files(folder, PICTURES, PICTURES[0], MARK.encode())
    with progress_bar(quiet=as_json) as tell:
        if not budget.unlimited:
            rays = _budgeted(loaded.spec, d, budget, seed, spec, tell)
        study = study_light(d, rays=rays or RAYS, seed=seed, progress=tell)
    _note_missed(study, budget)
    if pictures:
        _draw(folder, d, study)
    if as_json:
        print_json(study_record(study))
        return 0
    _report(loaded.spec.name, study)
    if pictures:
        print(f"Pictures in {folder}/ ({time.monotonic() - started:.1f} s)")
    return 0


def _draw(folder: Path, d: Dimensions, study: LightStudy) -> None:
    from gelslim_cad.light.figures import irradiance_png, paths_png, ratio_png

    made = (paths_png(d, MARK), irradiance_png(d, study), ratio_png(study))
    for name, content in zip(PICTURES, made, strict=True):
        replace_file(folder / name, content)


def _budgeted(
    spec: Spec, d: Dimensions, budget: Budget, seed: int, path: Path, tell: Progress | None
) -> int:
    """Return the rays per guide for a budget; a budget of time measures missing times first."""
    from gelslim_cad.light.ray_ladder import (
        TRACED,
        measure_errors,
        measure_times,
        rays_of,
        rung_name,
        times_key,
    )
    from gelslim_cad.sensor import spec_hash
    from gelslim_core.budget.machine_times import read_times

    key = times_key(spec_hash(spec))
    times = read_times(key)
    errors = measure_errors(d, seed, tell)
    if budget.time_ms is not None and not {rung_name(r) for r in TRACED} <= set(times):
        times = measure_times(d, tell)
        keep_times(key, times)
    choice = errors.ladder(times).choose(budget)
    note_choice(choice, budget, bool(times), f"gelslim bench {path}")
    return rays_of(choice.rung)


def _note_missed(study: LightStudy, budget: Budget) -> None:
    """Print a remark if the interval of the result is wider than the budget allows."""
    from gelslim_cad.light.ray_ladder import half_widths
    from gelslim_core.budget.budget import shown_share

    half = max(half_widths(study.light))
    if not budget.allows_error(half):
        rays = study.light.rays
        print(
            f"gelslim: the error of the light is {shown_share(half)} with {rays} rays; "
            f"--rays {2 * rays} makes it smaller",
            file=sys.stderr,
        )


def _report(name: str, study: LightStudy) -> None:
    for sentence in study.certificate.sentences():
        say(sentence)
    print()
    _comparisons(name, study.comparisons)
    print()
    _ledger(study.light)
    print()
    for colour in study.light.colours:
        _evenness(study.light, colour)
    for ours, glued in zip(study.exposures, study.glued_exposures, strict=False):
        say(f"{ours.sentence()} (with glued mirrors: {glued.frame_rate_hz:.0f}).")
    if study.tip is not None:
        say(f"{study.exposures[-1].sentence()}.")
        print()
        _tip(study.light, study.tip)


def _tip(light: LightResult, tip: TipLight) -> None:
    """Print how bright the light of the tip is, and which slopes each light shows."""
    name = "" if tip.colour == "tip" else f" ({tip.colour})"
    say(
        f"Light from the tip{name}, which no bend guides, is {tip.over_sides:.2f} times as bright "
        "on the coat as that of a side."
    )
    rows = table("change per unit slope", "along the finger", "across")
    for colour in light.colours:
        along, across = (light.slope_sensitivity(colour, axis) for axis in ("x", "y"))
        rows.add_row(colour, _change(along.value), _change(across.value))
    console().print(rows)


def _change(value: float) -> str:
    """A change with its sign and two decimals; a change that rounds to nothing is +0.00."""
    return f"{round(value, 2) + 0.0:+.2f}"


def _comparisons(name: str, found: Sequence[Comparison]) -> None:
    """Print the ratio to the light of each other guide, with interval and verdict."""
    from gelslim_cad.light.study import QUANTITIES

    rows = table("straight guide with", "light", "times", "95 % interval", "")
    alike = ""
    for c in found:
        other, _, alike = c.other.partition(" (")
        interval = f"{c.ratio.low:.3f} to {c.ratio.high:.3f}"
        kind = other.removeprefix("a straight guide with ")
        place = QUANTITIES[c.quantity].removeprefix("light ")
        rows.add_row(kind, place, f"{c.ratio.value:.3f}", interval, c.verdict)
    say(f"Light of {name} over that of others ({alike}:" if alike else f"Light of {name}:")
    console().print(rows)


def _ledger(result: LightResult) -> None:
    """Print the ledger; light that leaves the guide of a finger ends in its black housing."""
    title = f"where the light goes ({result.rays} rays)"
    rows = table(title, "share", "95 % interval")
    for name, found in sorted(result.ledger().items(), key=lambda e: (e[0] != FIRST, -e[1].value)):
        if found.value >= LEAST_SHARE:
            rows.add_row(_named(name), f"{found.value:.2%}", _interval(found))
    console().print(rows)


def _named(entry: str) -> str:
    known = {
        "delivered": "coat of the gel",
        "absorbed": "absorbed on the way",
        "missed_foot": "missed the guide's foot",
        "foot_reflection": "reflected at the foot",
        "truncated": "weight cut off",
        "lost": "lost at corners",
    }
    group, _, face = entry.partition(".")
    if not face:
        return known.get(entry, entry)
    back = group == "returned" and face.startswith("foot")
    way = "back to the LEDs by" if back else ("stopped at" if group == "stopped" else "leaked by")
    return f"{way} {face.replace('_', ' ')}"


def _interval(found: Estimate) -> str:
    return f"{found.low:.2%} to {found.high:.2%}"


def _evenness(result: LightResult, colour: str) -> None:
    even, rise = result.uniformity(colour), result.elevation_deg(colour)
    print(
        f"{colour} on the coat: darkest 64th {even.min_over_mean:.0%} of the mean, "
        f"standard deviation {even.cv:.0%}; light grazes at {rise.value:.0f}° on average"
    )
