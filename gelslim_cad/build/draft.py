"""The documents that need no built file, written while the other files are built."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from gelslim_cad.build.bill import finger_bill
from gelslim_cad.build.manifest import json_bytes
from gelslim_cad.build.stages import Plan, Stages
from gelslim_cad.build.work import Files
from gelslim_cad.build.writers import MARKERS_PURPOSE
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.electronics.finger import FingerBoards, finger_boards
from gelslim_cad.electronics.order import circuit_record, order_files
from gelslim_cad.markers.nodes import render_csv
from gelslim_cad.markers.write import MARKER_TABLE
from gelslim_cad.ordering.cost import Cost, cost_record
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.ordering.pricing import priced
from gelslim_cad.ordering.shopping import total_cost
from gelslim_cad.ordering.tables import bom_csv
from gelslim_cad.sensor import marker_print
from gelslim_cad.spec.parts import OwnPart
from ifem_export.markers.grid import MarkerGrid


@dataclass(frozen=True)
class Draft:
    """These documents, and what the others need of them.

    Attributes:
        files: Markers, LED boards, bill of materials, dimensions.
        boards: The LED boards.
        bom: The priced bill of materials.
        cost: What the finger costs.
    """

    files: Files
    boards: FingerBoards
    bom: tuple[BomLine, ...]
    cost: Cost


def draft(stages: Stages, plan: Plan) -> Draft:
    """Write what can be written while the other files are built."""
    d, grid = stages.dimensions, stages.grid
    boards = finger_boards(d)
    prices = stages.prices.entries
    bom = priced(finger_bill(d, (*plan.finger, *plan.tooling), boards), prices)
    cost = total_cost(bom, prices)
    dimensions = {
        "format": "gelslim-dimensions/1",
        "name": stages.name,
        "spec_hash": stages.spec_hash,
        "binding": stages.binding,
        "dimensions": {name: d.record(name) for name in d.values},
    }
    made = {} if grid is None else marker_table(d, grid)
    made |= own_files(stages.loaded.own_parts)
    made |= {f"electronics/{n}": entries for n, entries in order_files(boards, d).items()}
    made |= {
        "electronics/circuits.json": (
            json_bytes(circuit_record(boards)),
            "circuits of the LED boards",
        ),
        "spec.yaml": (stages.loaded.text.encode(), "the spec this was built from"),
        "dimensions.json": (
            json_bytes(dimensions),
            "dependent dimensions with formulas and inputs",
        ),
        "orders/cost.json": (json_bytes(cost_record(cost)), "what the finger costs"),
        "BOM.csv": (bom_csv(bom, cost), "bill of materials with prices"),
    }
    return Draft(made, boards, bom, cost)


def own_files(own: Iterable[OwnPart]) -> Files:
    """Copies of the files of the author's own parts, so that the folder tells what it is of."""
    return {
        f"own_parts/{part.file.name}": (part.file.read_bytes(), f"own part: {part.name}")
        for part in own
    }


def marker_table(d: Dimensions, grid: MarkerGrid) -> Files:
    """The table of the markers with their nodes; the drawings are a unit of work."""
    nodes, _ = marker_print(d, grid)
    return {f"markers/{MARKER_TABLE}": (render_csv(grid, nodes), MARKERS_PURPOSE)}
