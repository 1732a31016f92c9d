"""`gelslim optimise`: the thinnest, brightest or most accurate feasible design."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import (
    BAD_INPUT,
    RULE_FAILED,
    console,
    number,
    print_json,
    progress_bar,
    say,
    table,
)
from gelslim.cli.commands.design.explore import Jobs, NoisePx, Rays, Scheduler, Vary
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, SpecFile, out_folder
from gelslim.cli.output import replace_file, require_own_file
from gelslim.cli.price_table import price_record, print_broken, print_prices

if TYPE_CHECKING:
    from gelslim_cad.explore.optimum import Neighbour, Optimum
    from gelslim_cad.spec import Spec


class Aim(StrEnum):
    """Quantity to optimise."""

    thin = "thin"
    bright = "bright"
    accurate = "accurate"


def optimise(
    spec: SpecFile,
    vary: Vary,
    aim: Annotated[
        Aim,
        typer.Option("--for", help="Least thickness, exposure or force error."),
    ] = Aim.thin,
    out: Annotated[Path | None, out_folder("out/NAME-optimise")] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the best design as a spec to this file.")
    ] = None,
    rounds: Annotated[
        int, typer.Option(min=0, max=12, help="Number of rounds of finer steps around the best.")
    ] = 3,
    jobs: Jobs = None,
    scheduler: Scheduler = "",
    rays: Rays = 1 << 13,
    marker_noise_px: NoisePx = 0.05,
    as_json: AsJson = False,
) -> int:
    """Find the best feasible design, what limits it, and what it costs.

    Tries every combination of the values, then finer steps around the best one. Prints the best
    design, what a further step would do, and its price against the spec as it is. With --save it
    writes the design as a spec. The exit status is 1 if no design is feasible.
    """
    from gelslim_cad.checks.binding import binding_sentences
    from gelslim_cad.dimensions import derive
    from gelslim_cad.explore.price import measured, prices
    from gelslim_cad.explore.space import changed
    from gelslim_cad.spec.starter import spec_text
    from gelslim_cad.tolerance.asked import read_spec

    if save is not None:
        require_own_file(save, b"gelslim-spec/", "spec")
    loaded = read_spec(spec)
    folder = out or Path("out") / f"{loaded.spec.name}-optimise"
    effort = _Effort(jobs, scheduler, rays, marker_noise_px, rounds)
    best = _best(loaded.spec, vary, aim, folder, effort, quiet=as_json)
    chosen = changed(loaded.spec, best.values)
    words = binding_sentences(chosen, derive(chosen))
    before, after = (measured(s, rays, marker_noise_px) for s in (loaded.spec, chosen))
    price = prices(before, after)
    if save is not None:
        replace_file(save, spec_text(loaded.text, best.values).encode())
    if as_json:
        print_json({**_record(best, words), "price": price_record(price)})
        return 0
    _report(loaded.spec.name, best, words)
    print_prices("what it costs", price, "as it is", "best")
    print_broken("The spec as it is", before)
    if save is not None:
        print(f"Wrote {save}. Next: gelslim check {save}")
    return 0


@dataclass(frozen=True)
class _Effort:
    """Resources of the search and its accuracy."""

    jobs: int | None
    scheduler: str
    rays: int
    noise_px: float
    rounds: int


def _best(
    spec: Spec, vary: list[str], aim: Aim, folder: Path, effort: _Effort, *, quiet: bool
) -> Optimum:
    """Return the best feasible design. Raises CommandError for bad axes or if there is none."""
    from gelslim_cad.explore.optimum import optimise as run
    from gelslim_cad.explore.space import ExploreError, Space, parse_axis
    from gelslim_cad.explore.study import Request
    from gelslim_core.jobs import Engine, processors

    try:
        space = Space.of(spec, [parse_axis(v) for v in vary])
        request = Request(space, rays=effort.rays, noise_px=effort.noise_px)
        engine = Engine(effort.jobs or processors(), effort.scheduler)
        with progress_bar(quiet=quiet) as tell:
            return run(request, aim.value, folder, engine, rounds=effort.rounds, progress=tell)
    except ExploreError as error:
        status = RULE_FAILED if "is feasible" in str(error) else BAD_INPUT
        raise CommandError(f"gelslim optimise: {error}", status) from error


def _record(best: Optimum, words: tuple[str, ...]) -> dict[str, Any]:
    return {
        "format": "gelslim-optimum/1",
        "goal": asdict(best.goal),
        "values": dict(best.values),
        "best": dict(best.row),
        "neighbours": [asdict(n) for n in best.neighbours],
        "at_end_of_range": best.at_end,
        "designs": best.designs,
        "feasible": best.feasible,
        "binding": words,
    }


def _report(name: str, best: Optimum, words: tuple[str, ...]) -> None:
    from gelslim_cad.explore.space import shown

    value = best.row[best.goal.name]
    say(
        f"{name}: least {best.goal.words} {number(value, best.goal.unit)} "
        f"({best.feasible} of {best.designs} designs tried are feasible)",
        style="bold",
    )
    for path, chosen in best.values.items():
        end = ", an end of its range" if path in best.at_end else ""
        say(f"  {path}: {shown(chosen)}{end}")
    for sentence in words:
        say(sentence)
    steps = table("a step further", figures=(best.goal.words, "difference"))
    steps.add_column("what stops it")
    for n in best.neighbours:
        here = n.goal if n.status == "feasible" else None
        steps.add_row(
            f"{n.path.removeprefix('design.')} {shown(n.value)}",
            "" if here is None else number(here, best.goal.unit),
            "" if here is None else f"{'+' if here > value else ''}{number(here - value)}",
            _stop(n),
        )
    console().print(steps)


def _stop(n: Neighbour) -> str:
    """Return what stops a further step, and beyond which value."""
    from gelslim_cad.explore.space import shown

    if n.status == "feasible":
        return ""
    return n.binding if n.holds_to is None else f"{n.stops} beyond {shown(n.holds_to)}"
