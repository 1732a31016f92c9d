"""`gelslim import-sensor`: bundle and calibration of a sensor that was not generated here."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import print_json, progress_bar, say
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, out_folder
from gelslim.cli.output import replace_file, require_own_file, require_own_files

if TYPE_CHECKING:
    from gelslim_core.yaml.reader import Loaded
    from gelslim_force.imported.description import SensorDescription
    from gelslim_force.imported.importer import ImportedSensor

BUNDLE, CALIBRATION, PICTURE, SUMMARY = "bundle", "calibration.json", "dots.png", "sensor.json"
FILES = (SUMMARY, CALIBRATION, PICTURE)
"""Files of an imported sensor beside its bundle; the first tells that gelslim wrote them."""
_TITLES = {
    "given": "Given",
    "measured": "Measured in the picture",
    "assumed": "Assumed, as nothing is given",
    "missing": "Missing",
}


def import_sensor(
    source: Annotated[
        Path | None,
        typer.Argument(
            metavar="SOURCE",
            help="Description of the sensor (.yaml), or its picture without contact, with the "
            "options --length, --width, --thickness and --pitch.",
        ),
    ] = None,
    new: Annotated[
        Path | None,
        typer.Option("--new", help="Write a commented description to start from, and end."),
    ] = None,
    out: Annotated[Path | None, out_folder("out/NAME-sensor")] = None,
    length: Annotated[float | None, typer.Option(help="Length of the gel along x in mm.")] = None,
    width: Annotated[float | None, typer.Option(help="Width of the gel along y in mm.")] = None,
    thickness: Annotated[float | None, typer.Option(help="Thickness of the gel in mm.")] = None,
    pitch: Annotated[
        float | None, typer.Option(help="Distance of neighbouring dots in mm.")
    ] = None,
    modulus: Annotated[
        float | None, typer.Option(help="Young's modulus of the gel in MPa.")
    ] = None,
    field_of_view: Annotated[
        float | None, typer.Option(help="Angle of view across the width of the picture in degrees.")
    ] = None,
    x_points: Annotated[
        str | None, typer.Option(help="Where x points in the picture: right, down, left or up.")
    ] = None,
    mirrored: Annotated[
        bool, typer.Option("--mirrored", help="The picture shows the gel as seen from outside.")
    ] = False,
    ladder: Annotated[
        bool, typer.Option(help="Measure error and time of every force operator (some seconds).")
    ] = True,
    as_json: AsJson = False,
) -> int:
    """Make the bundle of a marker sensor that was not generated here.

    From the size of the gel and one picture without contact it finds the dots, their lattice and
    the camera, and writes a bundle, a calibration, a picture of what was found, and a summary:
    what was given, measured and assumed, and what is missing and is therefore not computed.
    `gelslim force OUT/bundle FRAMES -c OUT/calibration.json` then works on its frames.
    """
    options = {
        "gel.length_mm": length, "gel.width_mm": width, "gel.thickness_mm": thickness,
        "gel.youngs_modulus_mpa": modulus, "markers.pitch_mm": pitch,
        "lens.field_of_view_deg": field_of_view, "view.x_points": x_points,
        "view.mirrored": mirrored or None,
    }  # fmt: skip
    given = {name: value for name, value in options.items() if value is not None}
    if new is not None:
        if source is not None or given:
            raise CommandError("--new writes a description and takes no other argument")
        return _start(new)
    if source is None:
        raise CommandError(
            "give the description of the sensor, or its picture; `gelslim import-sensor --new "
            "sensor.yaml` writes a description to start from"
        )
    loaded, folder = _description(source, given)
    from gelslim_force.imported.importer import import_sensor as imported

    target = out or Path("out") / f"{loaded.model.name}-sensor"
    require_own_files(target, FILES, SUMMARY, b"gelslim-sensor")
    with progress_bar(quiet=as_json) as tell:
        made = imported(
            loaded.model, folder, frozenset(loaded.defaulted), ladder=ladder, progress=tell
        )
    _write(made, target)
    if as_json:
        print_json({"folder": str(target), **_summary(made)})
    else:
        _report(made, target)
    return 0


def _start(target: Path) -> int:
    from gelslim_force.imported.starter import SCHEMA_FILE, schema_text, starter_text

    if target.exists():
        raise CommandError(f"{target} exists and was not changed; give another name")
    schema = target.parent / SCHEMA_FILE
    require_own_file(schema, b"gelslim-", "schema of gelslim")
    text = f"# yaml-language-server: $schema={schema.name}\n{starter_text(target.stem)}"
    replace_file(target, text.encode())
    replace_file(schema, schema_text().encode())
    print(f"Wrote {target}. Next: gelslim import-sensor {target}")
    return 0


def _description(source: Path, given: dict[str, Any]) -> tuple[Loaded[SensorDescription], Path]:
    """The description, and the folder to which its paths are relative."""
    from gelslim_core.yaml.reader import load_bytes
    from gelslim_force.imported.description import FORMAT, SensorDescription, read_description

    if source.suffix.lower() in (".yaml", ".yml"):
        if given:
            raise CommandError(f"{source} says all of the sensor: leave the other options out")
        loaded = read_description(source)
        _require_reference(loaded, source)
        return loaded, source.parent
    need = {
        "gel.length_mm": "--length", "gel.width_mm": "--width", "gel.thickness_mm": "--thickness",
        "markers.pitch_mm": "--pitch",
    }  # fmt: skip
    lacking = [option for name, option in need.items() if name not in given]
    if lacking:
        raise CommandError(
            f"{source} is a picture: give {', '.join(lacking)} too, in mm, or a description"
        )
    import json

    blocks: dict[str, Any] = {"format": FORMAT, "name": _name(source)}
    for name, value in given.items():
        block, _, field = name.partition(".")
        blocks.setdefault(block, {})[field] = value
    blocks.setdefault("view", {})["reference"] = str(source)
    return load_bytes("options", json.dumps(blocks).encode(), SensorDescription), Path()


def _require_reference(loaded: Loaded[SensorDescription], source: Path) -> None:
    """Raise InputError where the picture that a description names is not there."""
    from gelslim_core.yaml.errors import InputError, Problem

    field, name = "view.reference", loaded.model.view.reference
    if not (source.parent / name).exists():
        at = loaded.source_map[field]
        raise InputError(
            (
                Problem(
                    loaded.path, at.line, at.column, field, name,
                    "there is no such file beside the description",
                    "name a picture without contact, or a folder of several",
                ),
            )
        )  # fmt: skip


def _name(picture: Path) -> str:
    stem = picture.resolve().stem
    name = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in stem)
    return name.lstrip("-_.")[:60] or "sensor"


def _write(made: ImportedSensor, folder: Path) -> None:
    from gelslim_core.files.replaced_file import json_bytes
    from gelslim_force.calibration.file import write_calibration
    from gelslim_force.outputs.import_picture import import_picture
    from ifem_export.bundle.files import write_bundle

    outline = made.bundle.outline
    assert outline is not None
    drawn = import_picture(made.calibration, outline)
    replace_file(folder / SUMMARY, json_bytes(_summary(made)))
    write_bundle(folder / BUNDLE, made.bundle)
    write_calibration(made.calibration, folder / CALIBRATION)
    replace_file(folder / PICTURE, drawn)


def _summary(made: ImportedSensor) -> dict[str, Any]:
    told = made.bundle.imported
    assert told is not None
    mesh, camera = made.bundle.mesh, made.calibration.camera
    return {
        **made.description.model_dump(mode="json"),
        "markers_found": len(made.calibration),
        "surface_nodes": len(mesh.surface),
        "cell_size_mm": [round(size, 6) for size in mesh.cell_size_mm],
        "operator": made.bundle.operator,
        "camera": camera.to_record(),
        "lattice": told.lattice.to_record(),
        "told": told.sentences(),
    }


def _report(made: ImportedSensor, folder: Path) -> None:
    told = made.bundle.imported
    assert told is not None
    for kind, lines in told.sentences().items():
        if lines:
            say(f"{_TITLES[kind]}:", style="bold")
        for line in lines:
            say(f"  {line}", style="yellow" if kind == "missing" else "")
    say(f"Wrote {BUNDLE}{os.sep}, {', '.join(FILES)} to {folder}{os.sep}")
    say(f"Next: gelslim force {folder / BUNDLE} FRAMES -c {folder / CALIBRATION}")
