"""The commands of the command line and its global options."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from gelslim.cli.commands.design.cameras import cameras
from gelslim.cli.commands.design.check import check
from gelslim.cli.commands.design.derive import derive
from gelslim.cli.commands.design.diff import diff
from gelslim.cli.commands.design.explain import explain
from gelslim.cli.commands.design.explore import explore
from gelslim.cli.commands.design.grippers import grippers
from gelslim.cli.commands.design.new import examples, new
from gelslim.cli.commands.design.optimise import optimise
from gelslim.cli.commands.design.thinner import thinner
from gelslim.cli.commands.design.view import view
from gelslim.cli.commands.files.build import build
from gelslim.cli.commands.files.bundle import bundle, bundle_export, bundle_info
from gelslim.cli.commands.files.family import family
from gelslim.cli.commands.files.markers import markers
from gelslim.cli.commands.measure.calibrate import calibrate
from gelslim.cli.commands.measure.calibrate_gel import calibrate_gel
from gelslim.cli.commands.measure.calibrate_light import calibrate_light
from gelslim.cli.commands.measure.calibrate_look import calibrate_look
from gelslim.cli.commands.measure.force import force
from gelslim.cli.commands.measure.import_sensor import import_sensor
from gelslim.cli.commands.measure.score import score
from gelslim.cli.commands.measure.track import track
from gelslim.cli.commands.program.bench import bench
from gelslim.cli.commands.program.doctor import doctor
from gelslim.cli.commands.program.schema import schema
from gelslim.cli.commands.trial.dataset import dataset, dataset_merge, dataset_verify
from gelslim.cli.commands.trial.light import light
from gelslim.cli.commands.trial.plan import plan
from gelslim.cli.commands.trial.simulate import simulate
from gelslim.cli.commands.trial.tolerance import tolerance
from gelslim.cli.commands.trial.validate import validate
from gelslim.cli.main import carried
from gelslim_core import __version__

COMMANDS: Mapping[str, tuple[Callable[..., int], ...]] = {
    "Design a finger": (
        new,
        examples,
        cameras,
        grippers,
        check,
        view,
        derive,
        explain,
        diff,
    ),
    "Search for one": (thinner, explore, optimise),
    "Try it before it is built": (tolerance, light, plan, simulate, validate),
    "Learn from it": (dataset, dataset_verify, dataset_merge),
    "Make its files": (build, family, markers, bundle, bundle_info, bundle_export),
    "Measure with it": (
        import_sensor,
        calibrate,
        calibrate_gel,
        calibrate_light,
        calibrate_look,
        force,
        track,
        score,
    ),
    "This program": (doctor, bench, schema),
}
"""The commands under the headings of their list."""
LONGEST = 200
"""Largest length of the first sentence of a command, which the list of commands shows."""


class CommandList(TyperGroup):
    """Lists the commands under headings."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each heading."""
        width = max(map(len, self.commands))
        for title, functions in COMMANDS.items():
            with formatter.section(title):
                formatter.write_dl(
                    (name.ljust(width), self.commands[name].get_short_help_str(LONGEST))
                    for name in map(_name, functions)
                )


def _name(command: Callable[..., int]) -> str:
    return command.__name__.replace("_", "-")


EPILOG = (
    "Exit status: 0 after success, 1 if a design rule fails, 2 after bad input, 3 after a fault of "
    "gelslim itself."
)

app = typer.Typer(
    name="gelslim",
    cls=CommandList,
    help="Design a tactile finger of the GelSlim type from one YAML file, make its files, and turn "
    "the pictures of its camera into forces.\n\nTo start, run `gelslim new my_finger`, then "
    "`gelslim check my_finger.yaml`.",
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
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Take the options that stand before a command."""


for _functions in COMMANDS.values():
    for _function in _functions:
        app.command(_name(_function))(carried(_function))
