"""The commands of the command line and its global options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from gelslim.cli.commands.bench import bench
from gelslim.cli.commands.build import build
from gelslim.cli.commands.bundle import bundle
from gelslim.cli.commands.bundle_export import bundle_export
from gelslim.cli.commands.bundle_info import bundle_info
from gelslim.cli.commands.calibrate import calibrate
from gelslim.cli.commands.check import check
from gelslim.cli.commands.derive import derive
from gelslim.cli.commands.diff import diff
from gelslim.cli.commands.doctor import doctor
from gelslim.cli.commands.examples import examples
from gelslim.cli.commands.explain import explain
from gelslim.cli.commands.explore import explore
from gelslim.cli.commands.family import family
from gelslim.cli.commands.force import force
from gelslim.cli.commands.light import light
from gelslim.cli.commands.markers import markers
from gelslim.cli.commands.new import new
from gelslim.cli.commands.optimise import optimise
from gelslim.cli.commands.plan import plan
from gelslim.cli.commands.schema import schema
from gelslim.cli.commands.simulate import simulate
from gelslim.cli.commands.thinner import thinner
from gelslim.cli.commands.track import track
from gelslim.cli.commands.validate import validate
from gelslim.cli.main import carried
from gelslim_core import __version__

GROUPS: Mapping[str, tuple[str, ...]] = {
    "Design a finger": ("new", "examples", "check", "derive", "explain", "diff"),
    "Search for one": ("thinner", "explore", "optimise"),
    "Try it before it is built": ("light", "plan", "simulate", "validate"),
    "Make its files": ("build", "family", "markers", "bundle", "bundle-info", "bundle-export"),
    "Measure with it": ("calibrate", "force", "track"),
    "This program": ("doctor", "bench", "schema"),
}
LONGEST = 200
"""Largest length of the first sentence of a command, which the list of commands shows."""


class CommandList(TyperGroup):
    """Lists the commands under headings; commands without a heading come last."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a section for each heading."""
        known = [name for name in self.list_commands(ctx) if not self.commands[name].hidden]
        rest = tuple(n for n in known if all(n not in names for names in GROUPS.values()))
        width = max(map(len, known))
        for title, names in {**GROUPS, "Other": rest}.items():
            rows = [
                (name.ljust(width), self.commands[name].get_short_help_str(LONGEST))
                for name in names
                if name in known
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


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


for _command in (
    examples,
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
