"""Fill the blocks of the pages that are made from docs/data or by the program.

    python -m bench.page_blocks            # fill the blocks of every page
    python -m bench.page_blocks --check    # write nothing; exit status 1 if a page is out of date

A block stands between the comments `<!-- name -->` and `<!-- /name -->`. `PAGES` says which
function makes which block. `docs/accuracy_vs_time.md` is generated as a whole by accuracy_page.py.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bench.bench_data import DOCS, ROOT, write_whole
from bench.force import compressed_pictures, force_sigma, shipped_designs
from bench.learning import data_set_cost, data_set_workers, learned_forces, real_locations
from bench.page import (
    drawn_light_table,
    force_tables,
    mitsuba_scores,
    page_tables,
    planning_figure,
    tolerance_tables,
    twin_tables,
)
from bench.twin import linear_gel, twin_batch, twin_fine, twin_look, twin_skin, twin_steps

sys.path.insert(0, str(ROOT / "tools"))
Make = Callable[[], str]


def _from(name: str, make: Callable[[Any], str]) -> Make:
    """Return a maker that reads docs/data/`name`.json."""
    return lambda: make(json.loads((DOCS / "data" / f"{name}.json").read_text("utf-8")))


def _operators_in_short() -> str:
    names = ("stiffness_ladder", "operator_contacts")
    found = [json.loads((DOCS / "data" / f"{name}.json").read_text("utf-8")) for name in names]
    return page_tables.operators_in_short(*found)


def _sensitivities() -> str:
    import sensitivities

    return sensitivities.table(json.loads(sensitivities.DATA.read_text("utf-8")))


PAGES: Mapping[str, Mapping[str, Make]] = {
    "README.md": {
        "latency": _from("force_latency", force_tables.short_latency),
        "operators": _operators_in_short,
        "concessions": lambda: page_tables.concessions(2),
    },
    "docs/design_guide.md": {
        "concessions": lambda: page_tables.concessions(3),
        "sensitivities": _sensitivities,
    },
    "docs/force_pipeline.md": {
        "latency": _from("force_latency", force_tables.full_latency),
        "ladders": _from("force_ladders", force_tables.ladder_tables),
        "large-strain": _from("force_ladders", page_tables.large_strain),
        "sigma": _from("force_sigma", force_sigma.table),
        "compressed-pictures": _from("compressed_pictures", compressed_pictures.table),
        "mitsuba-forces": _from("mitsuba_forces", mitsuba_scores.table),
        "shipped-designs": _from("shipped_designs", shipped_designs.table),
    },
    "docs/digital_twin.md": {
        "validation": _from("twin_validation", twin_tables.validation_text),
        "twin-planning": _from("twin_planning", planning_figure.table),
        "twin-effects": _from("twin_ladders", twin_tables.scenes_text),
        "twin-contact": _from("twin_ladders", twin_tables.contact_text),
        "twin-fine": _from("twin_fine", twin_fine.table),
        "twin-skin": _from("twin_skin", twin_skin.table),
        "twin-overhead": _from("twin_ladders", twin_tables.overhead_text),
        "twin-look": _from("twin_look", twin_look.table),
        "drawn-light": _from("drawn_light", drawn_light_table.table),
    },
    "docs/data_sets.md": {
        "data-set-workers": _from("data_set_workers", data_set_workers.table),
        "data-set-cost": _from("data_set_cost", data_set_cost.table),
    },
    "docs/train.md": {
        "learned-forces": _from("learned_forces", learned_forces.table),
        "real-locations": _from("real_locations", real_locations.table),
    },
    "docs/twin_steps.md": {
        "steps": _from("twin_steps", twin_steps.table),
        "batch": twin_batch.page_table,
    },
    "docs/stiffness.md": {
        "operators": _from("stiffness_ladder", page_tables.operators),
        "contacts": _from("operator_contacts", page_tables.contacts),
        "layers": _from("stiffness_ladder", page_tables.layers),
        "edge-fits": _from("operator_contacts", page_tables.edge_fits),
        "cut-cells": _from("stiffness_cases", page_tables.cut_cells),
        "iterations": _from("stiffness_cases", page_tables.iterations),
        "noise": _from("stiffness_cases", page_tables.noise),
        "assembly": _from("assembly", page_tables.assembly),
    },
    "docs/tolerance.md": {
        "tolerance-causes": tolerance_tables.causes,
        "tolerance-yields": _from("tolerance_yields", tolerance_tables.yields),
        "tolerance-forces": _from("tolerance_yields", tolerance_tables.forces),
    },
    "docs/light_guide.md": {
        "rays": _from("light_rays", page_tables.rays),
        "chords": _from("light_rays", page_tables.chords),
        "settings": _from("light_rays", page_tables.settings),
        "bend-ratios": _from("light_rays", page_tables.bend_ratios),
    },
    "docs/physics.md": {
        "one-layer": _from("stiffness_ladder", page_tables.one_layer),
        "large-strain": _from("force_ladders", page_tables.large_strain),
        "error-budget": _from("twin_validation", page_tables.error_budget),
        "linear-gel": _from("linear_gel", linear_gel.table),
    },
}


def filled(text: str, blocks: Mapping[str, Make]) -> str:
    """Return a page with its blocks made anew.

    Args:
        text: The page.
        blocks: The maker of each block by its name.

    Raises:
        ValueError: The page does not have exactly one block of a name.
    """
    for name, make in blocks.items():
        first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
        if text.count(first) != 1 or text.count(last) != 1:
            raise ValueError(f"the page needs one block between {first} and {last}")
        before, rest = text.split(first)
        text = f"{before}{first}\n{make().strip(chr(10))}\n{last}{rest.split(last)[1]}"
    return text


def block_names(text: str) -> list[str]:
    """Return the names of the blocks of a page."""
    return re.findall(r"^<!-- /([\w-]+) -->$", text, re.MULTILINE)


def fill_pages(root: Path = ROOT) -> list[str]:
    """Fill the blocks of every page and return the names of those that changed."""
    changed = []
    for name, blocks in PAGES.items():
        path = root / name
        text = path.read_text("utf-8")
        made = filled(text, blocks)
        if made != text:
            write_whole(path, made.encode("utf-8"))
            changed.append(name)
    return changed


def main() -> None:
    """Fill the pages, or name those that are out of date."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing; 1 where out of date")
    if not parser.parse_args().check:
        print("\n".join(fill_pages()) or "every page is up to date")
        return
    old = [n for n, blocks in PAGES.items() if _differs(ROOT / n, blocks)]
    if old:
        sys.exit(f"out of date: {', '.join(old)}; run: python -m bench.page_blocks")


def _differs(path: Path, blocks: Mapping[str, Make]) -> bool:
    text = path.read_text("utf-8")
    return filled(text, blocks) != text


if __name__ == "__main__":
    main()
