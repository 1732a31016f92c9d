"""`gelslim thinner`: what a thinner finger costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from gelslim.cli.answer import OK, RULE_FAILED, console, indented, number, print_json, say
from gelslim.cli.commands.design.explore import NoisePx, Rays
from gelslim.cli.failure import CommandError
from gelslim.cli.options import AsJson, SpecFile
from gelslim.cli.price_table import figure_text, per_cent, price_record

if TYPE_CHECKING:
    from gelslim_cad.explore.price import Price
    from gelslim_cad.explore.thinner import Concession, Offer


def thinner(
    spec: SpecFile,
    to: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            min=0.1,
            help="Thickness to reach; by default each field changes by one usual step.",
        ),
    ] = None,
    rays: Rays = 1 << 13,
    marker_noise_px: NoisePx = 0.05,
    as_json: AsJson = False,
) -> int:
    """Print what a thinner finger costs.

    For each single field that can make the finger thinner it prints the thickness and the changes
    of keystone, blur, brightness, exposure, force error and stiffness in per cent. Nothing is
    written. The exit status is 1 if no single field reaches the thickness.
    """
    from gelslim_cad.explore.space import ExploreError
    from gelslim_cad.explore.thinner import thinner as run
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec)
    try:
        offer = run(loaded.spec, to, rays, marker_noise_px)
    except ExploreError as error:
        raise CommandError(f"gelslim thinner: {error}") from error
    if as_json:
        print_json(_record(loaded.spec.name, offer))
    else:
        _report(loaded.spec.name, str(spec), offer)
    return OK if any(c.reaches for c in offer.concessions) else RULE_FAILED


def _record(name: str, offer: Offer) -> dict[str, Any]:
    return {
        "format": "gelslim-thinner/1",
        "name": name,
        "to_mm": offer.to_mm,
        "present": dict(offer.present.figures),
        "concessions": [
            {
                "path": c.path,
                "before": c.before,
                "after": c.after,
                "thickness_mm": c.thickness_mm,
                "reaches": c.reaches,
                "breaks": c.breaks,
                "price": price_record(c.prices),
            }
            for c in offer.concessions
        ],
    }


def _report(name: str, path: str, offer: Offer) -> None:
    from gelslim_cad.explore.pareto import FIGURES

    aim = "" if offer.to_mm is None else f", {offer.to_mm:g} mm asked for"
    say(f"{name} is {offer.present_mm:.2f} mm thick{aim}.", style="bold")
    present = (f"{f.words} {figure_text(f, offer.present.figures[f.name])}" for f in FIGURES[1:])
    say(f"As it is: {', '.join(present)}.")
    reached = [c for c in offer.concessions if c.reaches]
    if offer.to_mm is not None and not reached:
        print()
        say(
            f"No field alone makes it {offer.to_mm:g} mm thick. Several together: "
            f"gelslim optimise {path} --for thin --vary FIELD=... --vary FIELD=..."
        )
    elif not reached:
        say("No usual step makes it thinner.")
    for c in offer.concessions:
        _print_concession(c, offer)


def _print_concession(c: Concession, offer: Offer) -> None:
    """Print the thickness that one field gives, and what it costs, gains and changes."""
    from rich.text import Text

    from gelslim_cad.explore.price import SAME

    short = "" if c.reaches or c.breaks or offer.to_mm is None else ", the thinnest by this field"
    print()
    say(
        f"{c.path.removeprefix('design.')} {number(c.before)} → {number(c.after)}: "
        f"{c.thickness_mm:.2f} mm, {offer.present_mm - c.thickness_mm:.2f} mm less{short}",
        style="bold" if c.reaches else "",
    )
    if c.breaks:
        console().print(indented(Text(f"forbidden: breaks {', '.join(c.breaks)}", style="red"), 2))
        return
    changes = [p for p in c.prices[1:] if p.change is None or abs(p.change) >= SAME]
    for word, verdict in (("costs", "worse"), ("gains", "better"), ("changes", "")):
        listed = ", ".join(_change(p) for p in changes if p.verdict == verdict)
        if listed or word == "costs":
            console().print(indented(f"{word} {listed or 'nothing among these figures'}", 2))


def _change(p: Price) -> str:
    return f"{p.figure.words} {per_cent(p.change)} ({figure_text(p.figure, p.after)})"
