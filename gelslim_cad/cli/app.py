"""The application: its commands and options."""

from __future__ import annotations

from typing import Annotated

import typer

from gelslim_cad import __version__
from gelslim_cad.cli.bench import bench
from gelslim_cad.cli.build import build
from gelslim_cad.cli.bundle import bundle
from gelslim_cad.cli.bundle_export import bundle_export
from gelslim_cad.cli.bundle_info import bundle_info
from gelslim_cad.cli.calibrate import calibrate
from gelslim_cad.cli.carry import carried
from gelslim_cad.cli.check import check
from gelslim_cad.cli.command_list import CommandList
from gelslim_cad.cli.derive import derive
from gelslim_cad.cli.diff import diff
from gelslim_cad.cli.doctor import doctor
from gelslim_cad.cli.explain import explain
from gelslim_cad.cli.explore import explore
from gelslim_cad.cli.family import family
from gelslim_cad.cli.force import force
from gelslim_cad.cli.light import light
from gelslim_cad.cli.markers import markers
from gelslim_cad.cli.new import new
from gelslim_cad.cli.optimise import optimise
from gelslim_cad.cli.plan import plan
from gelslim_cad.cli.schema import schema
from gelslim_cad.cli.simulate import simulate
from gelslim_cad.cli.thinner import thinner
from gelslim_cad.cli.track import track
from gelslim_cad.cli.validate import validate

EPILOG = "Exit status: 0 done, 1 a design rule fails, 2 bad input, 3 a fault of gelslim itself."

app = typer.Typer(
    name="gelslim",
    cls=CommandList,
    help="From one YAML spec to a GelSlim-type tactile finger: CAD, marker print, stiffness, "
    "report.\n\nNew here? `gelslim new my_finger`, then `gelslim check my_finger.yaml`.",
    epilog=EPILOG,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"gelslim {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Options before any command."""


for _command in (
    new,
    check,
    derive,
    explain,
    diff,
    explore,
    optimise,
    thinner,
    build,
    family,
    bundle,
    bundle_info,
    bundle_export,
    bench,
    calibrate,
    force,
    track,
    markers,
    light,
    plan,
    simulate,
    validate,
    schema,
    doctor,
):
    app.command()(carried(_command))
