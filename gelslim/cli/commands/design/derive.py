"""`gelslim derive`: every dependent dimension."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from gelslim.cli.answer import console, number, print_json, say
from gelslim.cli.options import AsJson, SpecFile

if TYPE_CHECKING:
    from gelslim_cad.dimensions import Dimensions

TITLES = {
    "finger": "Finger",
    "view": "What the camera sees",
    "camera_pose": "Camera",
    "mirror": "Mirror",
    "stack": "Optical stack",
    "guide": "Light guide",
    "led": "LEDs",
    "marker_grid": "Marker grid",
    "pad_mesh": "Pad mesh",
}
HOUSING = "Housing"
FIRST = ("finger.thickness_mm", "finger.width_mm", "finger.length_mm")


def derive(spec: SpecFile, as_json: AsJson = False) -> int:
    """Print every dependent dimension of a finger.

    `gelslim explain` shows where one of them comes from.
    """
    from gelslim_cad.dimensions import derive as derive_dimensions
    from gelslim_cad.tolerance.asked import read_spec

    loaded = read_spec(spec)
    dimensions = derive_dimensions(loaded.spec)
    feasible = dimensions.feasible()
    if as_json:
        print_json(
            {
                "format": "gelslim-dimensions/1",
                "name": loaded.spec.name,
                "feasible": feasible,
                "dimensions": {n: dimensions.record(n) for n in dimensions.values},
            }
        )
        return 0
    _print_table(dimensions)
    if not feasible:
        say(
            "No finger keeps every limit. These are the values of the one that misses least; "
            "`gelslim check` shows the rules that fail.",
            style="bold red",
        )
    return 0


def _print_table(d: Dimensions) -> None:
    from rich.table import Table

    from gelslim_cad.dimensions import definition

    screen = console()

    def title(name: str) -> str:
        return TITLES.get(name.partition(".")[0], HOUSING)

    order = [*TITLES.values(), HOUSING]
    names_in_order = [*FIRST, *(n for n in d.values if n not in FIRST)]
    # sorted is stable, so the order of definition remains within a group.
    ordered = sorted(names_in_order, key=lambda n: order.index(title(n)))
    for group, names in groupby(ordered, title):
        screen.print(group, style="bold")
        table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
        table.add_column(no_wrap=True, min_width=27)
        table.add_column(justify="right", no_wrap=True, min_width=10)
        table.add_column(overflow="fold", ratio=1, style="dim")
        for name in names:
            entry = definition(name)
            table.add_row(f"  {name}", number(d.values[name], entry.unit), entry.title.rstrip("."))
        screen.print(table)
