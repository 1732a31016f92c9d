"""`gelslim validate`: errors of a sensor on simulated contacts with known forces."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import print_json, progress_bar
from gelslim.cli.budget import FieldError, FrameTime, budget_of
from gelslim.cli.options import AsJson, SpecFile, out_folder
from gelslim.cli.output import replace_file, require_own_files

if TYPE_CHECKING:
    from gelslim_twin.simulation.sensor import TwinSensor
    from gelslim_twin.validation.score import Validation

RECORD = "validation.json"
PLOTS = ("resultants.png", "fields.png", "error_budget.png")


def validate(
    spec: SpecFile,
    out: Annotated[Path | None, out_folder("out/NAME-validation")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of noise, dirt and print faults.")] = 0,
    error: FieldError = None,
    within: FrameTime = None,
    pictures: Annotated[bool, typer.Option(help="Write plots and overlay pictures.")] = True,
    as_json: AsJson = False,
) -> int:
    """Compare the forces of a sensor with simulated contacts of known force.

    Repeats the experiment of the GelSlim 2.0 paper. A ball is pressed into the gel and slid in
    many directions, simulated on a finer gel at large strain and drawn as the camera of the sensor
    would see it. The frames go through the force pipeline and through the paper's choices. An
    error budget, rods and a punch follow. Writes validation.json and pictures. --error and --time
    choose the operator of the pipeline from a ladder that is measured first.
    """
    from gelslim.cli.validate_report import print_validation
    from gelslim.contacts import validate as validated
    from gelslim.scene_sensor import spec_bundle
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_core.files.replaced_file import json_bytes
    from gelslim_force.forces.record import plain
    from gelslim_twin.simulation.sensor import TwinSensor

    started = time.monotonic()
    budget = budget_of(error, within)
    name = read_spec(spec).spec.name
    folder = out or Path("out") / f"{name}-validation"
    with progress_bar(quiet=as_json) as tell:
        names = [
            RECORD,
            *(picture_names(TwinSensor(spec_bundle(spec, with_light=False))) if pictures else []),
        ]
        require_own_files(folder, names, RECORD, b"gelslim-validation/1")
        found = validated(spec, folder / "sensor", budget, seed=seed, progress=tell)
    for remark in found.remarks:
        print(f"gelslim: {remark}", file=sys.stderr)
    record = plain(found.to_record())
    replace_file(folder / RECORD, json_bytes(record))
    written = [RECORD, *(_draw(found, folder) if pictures else [])]
    if as_json:
        print_json(record)
        return 0
    print_validation(found)
    print(f"\nIn {folder}/: {', '.join(written)} ({time.monotonic() - started:.0f} s).")
    return 0


def _draw(found: Validation, folder: Path) -> list[str]:
    """Write plots, and the last frame of some contacts with the result of the pipeline."""
    from gelslim.cli.validate_report import budget_png, fields_png, resultants_png
    from gelslim_force.outputs.arrow_scale import scale_of_run
    from gelslim_force.outputs.overlay import Overlay, write_overlay
    from gelslim_twin.validation.score import PAPER_N, PAPER_RELATIVE

    slides = len(found.experiment.tests)
    deepest, others = found.samples[slides - 1], found.samples[slides:]
    resultants, fields, budget = PLOTS
    plots = {resultants: resultants_png(found), fields: fields_png(found, deepest)}
    if found.budget:
        plots[budget] = budget_png(found.budget, PAPER_N, PAPER_RELATIVE)
    for name, content in plots.items():
        replace_file(folder / name, content)
    camera = found.calibration.camera
    shape = (camera.image_height_px, camera.image_width_px)
    overlay = Overlay(shape, camera.project, found.calibration.reference.positions_px)
    names = list(plots)
    for sample in (deepest, *others):
        result = next(iter(sample.results.values()))
        picture = overlay.draw(sample.image, result, scale_of_run([result]))
        names.append(picture_name(sample.name))
        write_overlay(folder / names[-1], picture)
    return names


def picture_names(sensor: TwinSensor) -> list[str]:
    """Return the names of all files that `_draw` may write, before the long experiment."""
    from gelslim_twin.validation.experiment import DIRECTIONS, other_contacts

    mesh = sensor.bundle.mesh
    cases = other_contacts(mesh.layers * mesh.cell_size_mm[2], *sensor.size_mm)
    samples = (f"slide {DIRECTIONS}", *(case.name for case in cases))
    return [*PLOTS, *map(picture_name, samples)]


def picture_name(sample: str) -> str:
    """Return the name of the picture of a sample."""
    return f"{sample.replace(' ', '_').replace(',', '')}.png"
