"""Do the standard deviations of forces hold? Scores over random contacts, and their curve.

    python -m bench.force.force_sigma              # 200 contacts of each mode
    python -m bench.force.force_sigma --processes 8
    python -m bench.force.force_sigma --deep       # the deep contacts only; the rest is kept
    python -m bench.force.force_sigma --mode "ball given"   # only one mode; the rest is kept
    python -m bench.force.force_sigma --strong     # only errors of 200 presses of at least 0.2 N
    python -m bench.force.force_sigma --figure     # draw the figure from the data again

Writes docs/data/force_sigma.json and docs/images/force_sigma.png. Contacts and the scores of each
slice are kept in a folder, so that a run that was stopped goes on where it ended. The contacts are
those of tests/force/sigma_cases.py; the deep ones, of a neo-Hookean gel, those of
tests/force/deep_contacts.py. Of the others a quarter presses with 0.2 N or more, from which on
relative errors count; as many presses as there are contacts are scored beside, all of which do.
"""

from __future__ import annotations

import argparse
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from bench.bench_data import DOCS, see_tests, write_data, write_whole
from bench.rigs.force_scores import four_digits, recorded
from bench.rigs.machine import machine
from gelslim_core.jobs import Engine

Array = NDArray[np.float64]
Record = Mapping[str, Any]
SLICE, DEEP_SLICE = 10, 9
KEPT = Path("out") / "force_sigma"
ERRORS = ("error", "sigma")
COMPONENTS = ("F_x", "F_y", "F_z")
COLOURS = ("#1f4e8c", "#c4580a", "#2d8a57")
SIZE_IN, DPI = (11.5, 3.6), 110


def main() -> None:
    """Score the contacts, or draw the figure of stored scores."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=200, help="contacts of each mode")
    parser.add_argument("--kept", type=Path, default=KEPT, help="folder for contacts and slices")
    parser.add_argument("--deep", action="store_true", help="score the deep contacts only")
    parser.add_argument("--mode", help='score only one mode, such as "ball given"')
    parser.add_argument("--strong", action="store_true", help="score only presses of 0.2 N or more")
    parser.add_argument("--processes", type=int, default=1, help="that share the contacts")
    parser.add_argument("--figure", action="store_true", help="draw the stored scores only")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder like docs")
    options = parser.parse_args()
    see_tests("force")
    stored = options.docs / "data" / "force_sigma.json"
    if not options.figure:
        data = measured(options, stored)
        write_data("force_sigma", data, options.docs)
    record = json.loads(stored.read_text("utf-8"))
    panels = {**record["modes"], "nothing given, deep": {"auto": record["deep"]["auto"]}}
    write_whole(options.docs / "images" / "force_sigma.png", drawn(panels))
    print(table(record))


def measured(options: argparse.Namespace, stored: Path) -> dict[str, Any]:
    """All scores; those that are not asked for are the stored ones."""
    from sigma_gate import MODES, WIDE

    data: dict[str, Any] = {}
    every = not (options.deep or options.mode or options.strong)
    if options.mode not in (None, *MODES, WIDE):
        raise SystemExit(f"no mode {options.mode!r}: give one of {', '.join((*MODES, WIDE))}")
    if every:
        data = {**machine(31), "cases": options.cases, "modes": scored(options, MODES)}
    else:
        data = json.loads(stored.read_text("utf-8"))
    if options.mode in MODES:
        data["modes"] |= scored(options, (options.mode,))
    if options.mode == WIDE or every:
        data["wide"] = scored(options, (WIDE,))[WIDE]
    if options.strong or every:
        data["strong"] = strong_scored(options)
    if options.deep or every:
        data["deep"] = deep_scored(options.processes)
    return data


@dataclass(frozen=True)
class Slice:
    """Contacts that one process scores in some modes, with the folder for contacts and scores."""

    seeds: range
    kept: Path
    modes: tuple[str, ...]


@dataclass(frozen=True)
class DeepSlice:
    """Deep contacts that one process scores with one law of the gel."""

    law: str
    seeds: range


@dataclass(frozen=True)
class StrongSlice:
    """Presses of 0.2 N or more that one process scores by some knowledge of the sensor."""

    known: str
    seeds: tuple[int, ...]
    kept: Path


def scored(options: argparse.Namespace, modes: tuple[str, ...]) -> dict[str, Any]:
    """Scores, median errors and deviations by mode and condition."""
    from sigma_cases import CONDITIONS

    options.kept.mkdir(parents=True, exist_ok=True)
    slices = [
        Slice(range(first, min(first + SLICE, options.cases)), options.kept, modes)
        for first in range(0, options.cases, SLICE)
    ]
    for number, _ in Engine(options.processes).run(score_slice, slices):
        print(slices[number].seeds, flush=True)
    rows: dict[str, dict[str, list[Record]]] = {
        mode: {condition: [] for condition in CONDITIONS} for mode in modes
    }
    for some in slices:
        for mode in modes:
            for name, every in json.loads(_path(some, mode).read_text("utf-8")).items():
                rows[mode][name] += every
    return {
        mode: {name: recorded(every, ERRORS) for name, every in some.items()}
        for mode, some in rows.items()
    }


def score_slice(some: Slice) -> None:
    """Write the scores of a slice, mode by mode, where they are not kept."""
    see_tests("force")
    from sigma_gate import scores

    for mode in some.modes:
        if not _path(some, mode).exists():
            found = scores(mode, some.seeds, some.kept)
            plain = {name: [vars(s) for s in every] for name, every in found.items()}
            write_whole(_path(some, mode), json.dumps(plain).encode("utf-8"))


def _path(some: Slice, mode: str) -> Path:
    from sigma_gate import WIDE

    name = "wide" if mode == WIDE else mode.split()[0]
    return some.kept / f"{name}-{some.seeds.start}-{some.seeds.stop}.json"


def strong_scored(options: argparse.Namespace) -> dict[str, Any]:
    """Scores and relative errors of strong presses by what is known of the sensor."""
    from frame_errors import error_summary
    from press_gate import KNOWLEDGE, press_seeds

    options.kept.mkdir(parents=True, exist_ok=True)
    seeds = press_seeds(options.cases)
    slices = [
        StrongSlice(known, tuple(seeds[first : first + SLICE]), options.kept)
        for known in KNOWLEDGE
        for first in range(0, len(seeds), SLICE)
    ]
    scores = dict(Engine(options.processes).run(score_strong_slice, slices))
    found = {}
    for known in KNOWLEDGE:
        some = [s for k, part in enumerate(slices) if part.known == known for s in scores[k]]
        errors = {key: four_digits(value) for key, value in error_summary(some).items()}
        found[known] = {**recorded((vars(s.score) for s in some), ERRORS), "relative": errors}
    return found


def score_strong_slice(some: StrongSlice) -> tuple[Any, ...]:
    """The scores of some strong presses."""
    see_tests("force")
    from press_gate import press_errors

    return tuple(press_errors(some.known, some.seeds, some.kept))


def deep_scored(processes: int) -> dict[str, Any]:
    """Scores and relative errors of the deep contacts by law of the gel; nothing is given."""
    from deep_contacts import COUNT, SEEN
    from deep_gate import LAWS
    from frame_errors import error_summary

    slices = [
        DeepSlice(law, range(first, min(first + DEEP_SLICE, COUNT)))
        for law in LAWS
        for first in range(0, COUNT, DEEP_SLICE)
    ]
    scores = dict(Engine(processes).run(score_deep_slice, slices))
    found = {}
    for law in LAWS:
        own = [scores[k] for k in range(len(slices)) if slices[k].law == law]
        some = [score for part in own for score in part]
        parts = {"relative": some, "relative_held_out": some[SEEN:]}
        errors = {
            name: {key: four_digits(value) for key, value in error_summary(part).items()}
            for name, part in parts.items()
        }
        found[law] = {**recorded((vars(s.score) for s in some), ERRORS), **errors}
    return found


def score_deep_slice(some: DeepSlice) -> tuple[Any, ...]:
    """The scores of some deep contacts."""
    see_tests("force")
    from deep_gate import deep_scores

    return deep_scores(some.law, some.seeds)


def table(record: Record) -> str:
    """The scores as a Markdown table, with what they stand for."""
    lines = [
        f"{record['cases']} contacts of each mode, the conditions in turn; three numbers are those "
        "of F_x, F_y and F_z.",
        "",
        "| known, condition | contacts | refused | median error, mN | median σ, mN | "
        "RMS of error/σ | mean of error/σ | within 1.96 σ |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for mode, conditions in record["modes"].items():
        every = list(conditions.values())
        lines += [_row(f"{mode}, {name}", [row]) for name, row in conditions.items()]
        lines.append(_row(f"**{mode}, all**", every))
    if "wide" in record:
        every = list(record["wide"].values())
        lines.append(_row("nothing given, Poisson's ratio ± 0.02, all", every))
    lines += [_row(f"nothing given, deep, gel {law}", [row]) for law, row in record["deep"].items()]
    return "\n".join([*lines, "", *_strong_table(record["strong"])])


def _strong_table(rows: Record) -> list[str]:
    """Relative errors of the strong presses."""
    lines = [
        "Presses with at least 0.2 N, nothing given, the conditions in turn. *Mean* is that of the "
        "errors with their sign and its standard deviation; shear is relative to F_z, the field is "
        "that of the nodal forces.",
        "",
        "| known | presses | refused | F_z, median | 95th percentile | mean | shear | "
        "centre of pressure | field | RMS of error/σ | within 1.96 σ |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for name, row in rows.items():
        error, z = row["relative"], np.array(row["error_mn"]) / np.array(row["sigma_mn"])
        cells = [
            name,
            f"{len(z) + row['refused']}",
            f"{row['refused']}",
            f"{100 * error['normal']:.1f} %",
            f"{100 * error['normal_95']:.1f} %",
            f"{100 * error['mean']:+.1f} ± {100 * error['mean_sigma']:.1f} %",
            f"{100 * error['shear']:.1f} %",
            f"{error['centre_mm']:.3f} mm",
            f"{100 * error['field']:.0f} %",
            _three(np.sqrt((z**2).mean(axis=0)), ".2f"),
            _three(100 * (np.abs(z) < norm.ppf(0.975)).mean(axis=0), ".0f") + " %",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _row(name: str, conditions: list[Record]) -> str:
    error, sigma = (
        np.concatenate([row[key] for row in conditions]) for key in ("error_mn", "sigma_mn")
    )
    refused, z = sum(row["refused"] for row in conditions), error / sigma
    cells = [
        name,
        f"{len(z) + refused}",
        f"{refused}",
        _three(np.median(np.abs(error), axis=0), ".2g"),
        _three(np.median(sigma, axis=0), ".2g"),
        _three(np.sqrt((z**2).mean(axis=0)), ".2f"),
        _three(z.mean(axis=0), "+.2f"),
        _three(100 * (np.abs(z) < norm.ppf(0.975)).mean(axis=0), ".0f") + " %",
    ]
    return "| " + " | ".join(cells) + " |"


def _three(values: Iterable[float], form: str) -> str:
    return ", ".join(_plain(format(value, form)) for value in values)


def _plain(text: str) -> str:
    return f"{float(text):g}" if "e" in text else text


def drawn(modes: Record) -> bytes:
    """Observed against nominal coverage, a panel for each mode, as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, len(modes), sharey=True)
    nominal = np.linspace(0.02, 0.995, 80)
    limits = norm.ppf((1 + nominal) / 2)
    for axes, (mode, conditions) in zip(panels, modes.items(), strict=True):
        error, sigma = (
            np.concatenate([row[key] for row in conditions.values()])
            for key in ("error_mn", "sigma_mn")
        )
        z = np.abs(error / sigma)
        _expected(axes, nominal, len(z))
        for k, colour in enumerate(COLOURS):
            seen = (z[:, k, None] < limits).mean(axis=0)
            axes.plot(100 * nominal, 100 * seen, color=colour, lw=1.4, label=f"${COMPONENTS[k]}$")
        axes.set(title=mode, xlabel="nominal coverage, %", xlim=(0, 100), ylim=(0, 100))
        axes.set_aspect("equal")
    panels[0].set_ylabel("observed coverage, %")
    panels[0].legend(loc="upper left", fontsize=8, frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _expected(axes: Any, nominal: Array, count: int) -> None:
    """The diagonal, with twice the deviation of a share of `count` frames."""
    spread = 2 * np.sqrt(nominal * (1 - nominal) / max(count, 1))
    axes.fill_between(
        100 * nominal, 100 * (nominal - spread), 100 * (nominal + spread), color="#dfe4ea", lw=0
    )
    axes.plot([0, 100], [0, 100], color="#9aa3ad", lw=0.8)


if __name__ == "__main__":
    main()
