"""Make the page of all ladders, with its figures, from the JSON files of the benches.

    python -m bench.accuracy_page              # from docs/data to docs
    python -m bench.accuracy_page --docs D     # from D/data to D
    python -m bench.accuracy_page --check      # writes nothing; fails if the page is out of date

Writes accuracy_vs_time.md, images/accuracy_*.png and data/accuracy.json, which holds every ladder
in one form. A ladder whose bench has not been run yet is named as missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, write_data, write_whole
from bench.page import accuracy_text
from bench.page.accuracy_figure import drawn
from bench.page.accuracy_text import conclusion, table
from bench.page.ladder_record import LadderRecord, records_of
from bench.page.ladders_of_camera import camera
from bench.page.ladders_of_force import force
from bench.page.ladders_of_solids import light, stiffness, tessellation
from bench.page.ladders_of_sources import sources
from bench.page.ladders_of_twin import rendering, twin

Convert = Callable[[Mapping[str, Any], Mapping[str, Any]], list[LadderRecord]]
SOURCES: dict[str, Convert] = {
    "stiffness_ladder": stiffness,
    "light_rays": light,
    "tessellation": tessellation,
    "camera_models": camera,
    "force_ladders": force,
    "normal_sources": sources,
    "twin_ladders": twin,
    "rendering": rendering,
}
"""Files in docs/data with the functions that make ladders of them, in the order of the page."""
BESIDE = {"stiffness_ladder": "operator_contacts"}
"""Files whose data a ladder needs too: which operator is the default follows from contacts."""
HEADER = ("machine", "system", "processor", "cores", "threads", "python", "numpy", "scipy",
          "numba", "opencv", "cadquery", "gelslim_cad", "seed")  # fmt: skip
PAGE = "accuracy_vs_time.md"
INTRODUCTION = """\
# What accuracy costs in time

Almost every step of this project can be done more or less accurately, and accuracy takes time. For
each step that offers a choice, this page shows the error of every way against an independent
reference, and the time that it takes. A grey line joins the ways that no other beats in both error
and time (the Pareto front). A black star is the choice of the GelSlim 2.0 paper, where the paper
states it. A red ring is the default of this project. A default is called beaten if another way is
no worse in both and at least 5 % better in one of them. The times are those of one machine and
compare the ways on it. The errors do not depend on the machine.
"""
CLOSING = """\
## How this page is made

    make bench          # measures every ladder in full and then makes this page
    make bench-quick    # measures all at reduced size into out/bench, in under five minutes

`python -m bench.accuracy_page` makes text, tables and figures from the JSON files in `docs/data`.
`docs/data/accuracy.json` holds all ladders in one form. Tests compare this page with these files,
and the files with limits on errors and operation counts; no test depends on a time.
"""


def main() -> None:
    """Write the page, or say that it is out of date."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder with data/ and images/")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 where out of date")
    asked = parser.parse_args()
    ladders = read_ladders(asked.docs)
    text = page(ladders)
    if asked.check:
        path = asked.docs / PAGE
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            sys.exit(f"{path} is out of date: run python -m bench.accuracy_page")
        return
    for ladder in ladders:
        write_whole(asked.docs / picture(ladder), drawn(ladder))
    wanted = {(asked.docs / picture(ladder)).name for ladder in ladders}
    for old in (asked.docs / "images").glob("accuracy_*.png"):
        if old.name not in wanted:
            old.unlink()
    write_data("accuracy", {"ladders": records_of(ladders)}, asked.docs)
    write_whole(asked.docs / PAGE, text.encode("utf-8"))
    print(f"{len(ladders)} ladders in {asked.docs / PAGE}")


def read_ladders(docs: Path) -> list[LadderRecord]:
    """Return the ladders of all benches that have been run."""
    found: list[LadderRecord] = []
    for name, convert in SOURCES.items():
        path = docs / "data" / f"{name}.json"
        if path.exists():
            data = json.loads(path.read_text(encoding="utf-8"))
            beside = docs / "data" / f"{BESIDE.get(name, name)}.json"
            if name in BESIDE and beside.exists():
                data[BESIDE[name]] = json.loads(beside.read_text(encoding="utf-8"))
            found += convert(data, {key: data[key] for key in HEADER if key in data})
    return found


def picture(ladder: LadderRecord) -> str:
    """Return the path of the figure of a ladder under docs."""
    return f"images/accuracy_{ladder.name.replace('-', '_')}.png"


def page(ladders: list[LadderRecord]) -> str:
    """Return the text of the page."""
    present = {ladder.source for ladder in ladders}
    missing = [name for name in SOURCES if name not in present]
    parts = [INTRODUCTION, overview(ladders), *map(section, ladders)]
    if missing:
        names = ", ".join(f"`{name}`" for name in missing)
        parts.append(f"Not measured yet: {names}.\n")
    return "\n".join([*parts, CLOSING])


def overview(ladders: list[LadderRecord]) -> str:
    """Return the table at the top, with one row per ladder."""
    lines = ["| step | ours | the paper | ours is |", "|---|---|---|---|"]
    for ladder in ladders:
        link = f"[{ladder.title}](#{anchor(ladder.title)})"
        lines.append(accuracy_text.overview(ladder, link))
    return "\n".join(lines) + "\n"


def anchor(title: str) -> str:
    """Return the fragment of a link to a heading."""
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -_")
    return kept.replace(" ", "-")


def section(ladder: LadderRecord) -> str:
    """Return the section of a ladder: conclusion, figure, table, reference, machine."""
    return f"""\
## {ladder.title}

{ladder.question}

{conclusion(ladder)}

![{ladder.error_label} against {ladder.time_label}]({picture(ladder)})

{table(ladder)}

The error is against: {sentence(ladder.reference)} The paper: {sentence(ladder.paper)}

<sub>`data/{ladder.source}.json`: {measured_on(ladder.header)}</sub>
"""


def sentence(text: str) -> str:
    """Return a text that ends with a full stop."""
    return text if text.endswith(".") else f"{text}."


def measured_on(header: Mapping[str, Any]) -> str:
    """Return machine, versions and seed as a line."""
    machine = ", ".join(
        str(header[key]) for key in ("processor", "machine", "system") if header.get(key)
    )
    if header.get("cores"):
        machine += f", {header['cores']} cores, {header.get('threads', 'default')} thread"
    plain = ("python", "numpy", "scipy", "numba", "opencv", "cadquery")
    versions = ", ".join(f"{key} {header[key]}" for key in plain if header.get(key))
    seed = header.get("seed")
    seeds = f"seed {seed}"
    if isinstance(seed, dict):
        named = (
            f"{key} {value[0]} to {value[-1]}" if isinstance(value, list) else f"{key} {value}"
            for key, value in seed.items()
        )
        seeds = f"seeds: {', '.join(named)}"
    return f"{machine}; {versions}; {'no random numbers' if seed is None else seeds}"


if __name__ == "__main__":
    main()
