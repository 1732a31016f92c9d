"""`gelslim validate`: what a sensor will measure, against known forces."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim_cad.cli.options import AsJson, SpecFile

if TYPE_CHECKING:
    from gelslim_twin.validation.validate import Outcome, Validation


def validate(
    spec: SpecFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Folder; out/NAME-validation if left out.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of noise, dirt and print faults.")] = 0,
    pictures: Annotated[bool, typer.Option(help="Write the overlay pictures.")] = True,
    as_json: AsJson = False,
) -> int:
    """Try a sensor on frames with known forces, before it is printed.

    Simulates standard contacts on a finer pad, draws their frames as this sensor's camera would
    see them, and puts them through the force pipeline and through the paper's choices.
    """
    from gelslim_cad.cli.answer import print_json
    from gelslim_cad.cli.output import replace_file
    from gelslim_cad.cli.progress import progress_bar
    from gelslim_cad.cli.twin_sensor import spec_sensor
    from gelslim_cad.spec.reader import read_spec
    from gelslim_force.outputs.atomic_file import json_bytes
    from gelslim_force.outputs.packed_frame import plain
    from gelslim_twin.simulation.stored_sensor import store_sensor, stored_sensor
    from gelslim_twin.validation.validate import validate as validated

    started = time.monotonic()
    name = read_spec(spec).spec.name
    folder = out or Path("out") / f"{name}-validation"
    with progress_bar(quiet=as_json) as tell:
        kept = folder / "sensor"
        store_sensor(spec_sensor(spec), kept, True)
        found = validated(stored_sensor(kept), kept, seed, tell)
    record = plain(found.to_record())
    replace_file(folder / "validation.json", json_bytes(record))
    if pictures:
        _draw(found, folder)
    if as_json:
        print_json(record)
        return 0
    _table(found)
    print(f"In {folder}/: validation.json, pictures ({time.monotonic() - started:.0f} s).")
    return 0


def _table(found: Validation) -> None:
    from rich.table import Table

    from gelslim_cad.cli.answer import console

    titles = ("contact", "chain", "shear N", "normal N", "field", "markers", "")
    table = Table(*titles, box=None, padding=(0, 2, 0, 0))
    last = ""
    for outcome in found.outcomes:
        if outcome.case != last:
            x, y, z = outcome.true_n
            table.add_row(outcome.case, "true", f"{x:+.3f} {y:+.3f}", f"{z:+.3f}", style="bold")
        last = outcome.case
        table.add_row("", outcome.chain, *_cells(outcome))
    console().print(table)


def _cells(outcome: Outcome) -> tuple[str, ...]:
    x, y, z = outcome.found_n
    known = z == z
    return (
        f"{x:+.3f} {y:+.3f}",
        f"{z:+.3f}" if known else "unknown",
        f"{outcome.field_error:.0%} off" if known else "",
        f"{1000 * outcome.lateral_error_mm:.1f} µm",
        "; ".join(outcome.problems),
    )


def _draw(found: Validation, folder: Path) -> None:
    """The last frame of every contact with what our first chain finds in it."""
    from gelslim_force.outputs.arrow_scale import scale_of_run
    from gelslim_force.outputs.overlay import Overlay, write_overlay

    camera = found.calibration.camera
    shape = (camera.image_height_px, camera.image_width_px)
    places = found.calibration.reference.places_px
    for case, result in found.results.items():
        overlay = Overlay(shape, camera.project, places)
        picture = overlay.draw(found.frames[case], result, scale_of_run([result]))
        path = folder / f"{case.replace(' ', '_')}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_overlay(path, picture)
