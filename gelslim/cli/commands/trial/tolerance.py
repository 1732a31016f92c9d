"""`gelslim tolerance`: what the errors of making a finger do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gelslim.cli.answer import OK, RULE_FAILED, console, number, print_json, say, table
from gelslim.cli.options import AsJson, SpecFile
from gelslim.cli.output import replace_file, require_own_file

if TYPE_CHECKING:
    from gelslim_cad.tolerance.study import ToleranceStudy
    from gelslim_cad.tolerance.yields import Yield

STAGES = {"as_built": "as built", "adjusted": "adjusted"}
SHOWN = 0.01
"""Least share of the variance of a group of causes that is listed."""


def tolerance(
    spec: SpecFile,
    samples: Annotated[
        int, typer.Option(min=100, max=1_000_000, help="Number of fingers to sample.")
    ] = 10_000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    least_yield: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            max=0.999,
            help="Share of fingers that must keep every rule; the exit status is 1 if fewer do. "
            "Without it the changes lead to 0.95.",
        ),
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the spec with these changes to this file.")
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Print which share of built fingers keeps the rules, and what limits it.

    Samples the errors of making a finger (block `tolerance` of the spec and others). Prints the
    yield of each rule, the causes of the rule that fails most, the errors of the forces, and
    changes of the spec that give the yield of --least-yield with what they cost in thickness.
    With --save it writes the changed spec.
    """
    from gelslim_cad.spec.starter import spec_text
    from gelslim_cad.tolerance.asked import read_spec
    from gelslim_cad.tolerance.study import LEAST_YIELD, study_record, tolerance_study
    from gelslim_cad.tolerance.yields import ALL

    wanted = LEAST_YIELD if least_yield is None else least_yield
    if save is not None:
        require_own_file(save, b"gelslim-spec/", "spec")
    loaded = read_spec(spec)
    study = tolerance_study(loaded.spec, samples=samples, seed=seed, least_yield=wanted)
    if save is not None:
        replace_file(save, spec_text(loaded.text, study.plan.changes()).encode())
    if as_json:
        print_json(study_record(study))
    else:
        _print_yields(study)
        _print_causes(study)
        _print_forces(study)
        _print_plan(study)
        if save is not None:
            print(f"Wrote {save}. Next: gelslim check {save}")
    enough = study.yields[study.stage][ALL].share >= wanted
    return OK if enough or least_yield is None else RULE_FAILED


def _print_yields(study: ToleranceStudy) -> None:
    from gelslim_cad.tolerance.margins import ASSEMBLY, RULES
    from gelslim_cad.tolerance.yields import ALL

    say(f"{study.name}: yield of {study.samples} sampled fingers (95 % interval)", style="bold")
    shown = table("rule", figures=tuple(STAGES.values()), header_style="dim", padding=(0, 1))
    for rule in (*(r for r in study.yields[study.stage] if r != ALL), ALL):
        title = "every rule" if rule == ALL else RULES[rule].title
        style = "bold" if rule == ALL else ""
        shown.add_row(title, *(_yield_text(study.yields[s][rule]) for s in STAGES), style=style)  # type: ignore[index]
    console().print(shown)
    if study.broken:
        say(
            f"Without any error the design already breaks {', '.join(study.broken)}: see "
            "`gelslim check` first.",
            style="bold red",
        )
    for stage, words in ASSEMBLY.items():
        say(f"{STAGES[stage].capitalize()}: {words}")
    say(
        f"The spec says tolerance.adjusted: {str(study.stage == 'adjusted').lower()}, so the "
        f"column “{STAGES[study.stage]}” counts."
    )


def _yield_text(found: Yield) -> str:
    low, high = found.interval
    return f"{100 * found.share:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _print_causes(study: ToleranceStudy) -> None:
    from gelslim_cad.tolerance.causes import GROUPS
    from gelslim_cad.tolerance.margins import RULES

    worst = study.shares_of(study.worst_rule)
    kept = RULES[worst.rule]
    print()
    say(f"Fails most: {kept.title} ({worst.place})", style="bold")
    say(
        f"Margin {number(worst.mean)} ± {number(worst.deviation)} {kept.unit}; every error at its "
        f"limit would leave {number(worst.worst_case)}. Where its variance comes from:"
    )
    shown = table(
        "cause",
        "field to change",
        figures=("linear", "Sobol", "total"),
        header_style="dim",
        padding=(0, 1),
    )
    for group in sorted(worst.total, key=lambda g: -worst.total[g]):
        figures = (worst.linear[group], worst.first[group], worst.total[group])
        if max(figures) >= SHOWN:
            shown.add_row(
                group, GROUPS[group].field, *(f"{100 * max(f, 0):.0f} %" for f in figures)
            )
    console().print(shown)
    say(
        f"Linear: squared standardised coefficients, which explain {100 * worst.r_squared:.0f} % "
        "of the variance. Sobol: first-order index. Total: with interactions.",
        style="dim",
    )


def _print_forces(study: ToleranceStudy) -> None:
    print()
    say("Error of the forces (standard deviation; 95 % stay below)", style="bold")
    heads = [f"{f.component}, {'calibrated' if f.calibrated else 'not'}" for f in study.forces]
    shown = table("cause, alone", figures=tuple(heads), header_style="dim", padding=(0, 1))
    for name in dict.fromkeys(c for f in study.forces for c in f.causes):
        shown.add_row(
            name, *(f"{f.causes[name]:.2f} %" if name in f.causes else "" for f in study.forces)
        )
    shown.add_row(
        "all",
        *(f"{f.deviation_percent:.1f} % ({f.most_percent:.0f} %)" for f in study.forces),
        style="bold",
    )
    console().print(shown)


def _print_plan(study: ToleranceStudy) -> None:
    from gelslim_cad.tolerance.margins import RULES

    plan = study.plan
    print()
    say(f"What gives a yield of {100 * plan.wanted:g} %", style="bold")
    shown = table("change", figures=("yield", "thickness"), header_style="dim", padding=(0, 1))
    for step in plan.steps:
        words = step.words or "the spec as it is"
        shown.add_row(words, f"{100 * step.share:.1f} %", f"{step.thickness_mm:.2f} mm")
    console().print(shown)
    for path, value in plan.changes().items():
        say(f"  {path}: {number(value)}")
    if not plan.reached:
        rule = plan.steps[-1].worst_rule()
        say(
            f"No usual change goes further. {RULES[rule].title} ({rule}) still fails most: try "
            f"{RULES[rule].remedy}."
        )
    if study.thickness_per_percent_mm is not None:
        say(
            "By the image margin alone a per cent of yield costs "
            f"{number(study.thickness_per_percent_mm, 'mm')} of thickness at present."
        )
