"""`gelslim light`: certificate, flux ledger, comparison and exposure of the light guide."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim_cad.cli.options import AsJson, SpecFile

if TYPE_CHECKING:
    from gelslim_cad.light.study import LightStudy
    from gelslim_optics.light_result import Estimate, LightResult


def light(
    spec: SpecFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Folder of the pictures; out/NAME-light if left out."),
    ] = None,
    rays: Annotated[int, typer.Option(min=1024, max=1 << 28, help="Rays traced per guide.")] = 1
    << 17,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the rays.")] = 0,
    pictures: Annotated[bool, typer.Option(help="Draw the pictures.")] = True,
    as_json: AsJson = False,
) -> int:
    """Trace the light guide and compare it with straight guides.

    Certificate of total internal reflection, where the light goes, brightness against straight
    guides with 45° mirrors, exposure and frame rate.
    """
    from gelslim_cad.cli.answer import print_json
    from gelslim_cad.cli.output import replace_file
    from gelslim_cad.cli.progress import progress_bar
    from gelslim_cad.dimensions import derive
    from gelslim_cad.light.record import study_record
    from gelslim_cad.light.study import study_light
    from gelslim_cad.spec.reader import read_spec

    started = time.monotonic()
    loaded = read_spec(spec)
    d = derive(loaded.spec)
    with progress_bar(quiet=as_json) as tell:
        study = study_light(d, rays=rays, seed=seed, progress=tell)
    folder = out or Path("out") / f"{loaded.spec.name}-light"
    if pictures:
        from gelslim_cad.light.figures import irradiance_png, paths_png, ratio_png

        replace_file(folder / "light_paths.png", paths_png(d))
        replace_file(folder / "irradiance.png", irradiance_png(d, study))
        replace_file(folder / "light_ratio.png", ratio_png(study))
    if as_json:
        print_json(study_record(study))
        return 0
    _report(loaded.spec.name, study)
    if pictures:
        print(f"Pictures in {folder}/ ({time.monotonic() - started:.1f} s)")
    return 0


def _report(name: str, study: LightStudy) -> None:
    from gelslim_cad.cli.answer import say

    for sentence in study.certificate.sentences():
        say(sentence)
    for comparison in study.comparisons:
        say(f"{name} is {comparison.sentence()}.")
    print()
    _ledger(study.light)
    for colour in ("red", "green"):
        _evenness(study.light, colour)
    for ours, glued in zip(study.exposures, study.glued_exposures, strict=True):
        say(f"{ours.sentence()}; with glued mirrors {glued.frame_rate_hz:.0f}.")


def _ledger(result: LightResult) -> None:
    """The ledger, in the finger's terms: light that leaves ends in its black inside."""
    from rich.table import Table

    from gelslim_cad.cli.answer import console

    table = Table("where the light goes", "share", "95 % interval", box=None)
    for name, found in result.ledger().items():
        if found.value >= 5e-4 or name in ("lost", "truncated"):
            table.add_row(_named(name), f"{found.value:.2%}", _interval(found))
    console().print(table)


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
        f"{colour} on the coat: darkest spot {even.min_over_mean:.0%} of the mean, "
        f"standard deviation {even.cv:.0%}; light grazes at {rise.value:.0f}° on average"
    )
