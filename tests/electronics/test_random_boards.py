"""Random boards: whatever the rules let through keeps its distances and its nets."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from copper_reader import copper_nets, gerber_shapes, pieces, schematic_nets
from shapely.geometry import box
from shapely.ops import unary_union

from gelslim_cad.electronics.board import Board
from gelslim_cad.electronics.circuit import Circuit, circuit
from gelslim_cad.electronics.finger import layout_problem
from gelslim_cad.electronics.gerber_layers import layer_files
from gelslim_cad.electronics.kicad_project import kicad_files
from gelslim_cad.electronics.layout import BoardShape, lay_out
from gelslim_cad.electronics.leds import BoardLed
from gelslim_cad.electronics.netlist import StringPlan
from gelslim_cad.electronics.slots import Spacing
from gelslim_cad.electronics.strings import string_lengths
from gelslim_cad.spec.led_library import library_leds

CHORD_MM = 2e-3
"""What the chords of round ends take away."""


def drawn(seed: int) -> tuple[BoardShape, Circuit, StringPlan]:
    """A random row of LEDs with a random circuit, most of them tight."""
    rng = np.random.default_rng(seed)
    entry = list(library_leds().values())[rng.integers(len(library_leds()))]
    variant = list(entry.variants.values())[rng.integers(len(entry.variants))]
    led = BoardLed(
        "any", entry.manufacturer, variant, entry.package_mm, entry.height_mm, entry.pads, "",
        variant.radiant_flux_mw,
    )  # fmt: skip
    count = int(rng.integers(1, 9))
    drill, ring = rng.uniform(0.1, 0.35), rng.uniform(0.08, 0.2)
    spacing = Spacing(
        edge_mm=rng.uniform(0.1, 0.3),
        space_mm=rng.uniform(0.08, 0.25),
        trace_mm=rng.uniform(0.08, 0.25),
        via_mm=drill + 2 * ring,
        drill_mm=drill,
    )
    reach = sum(led.reach_mm)
    pitch = reach + rng.uniform(0.3, 4.0)
    span = (count - 1) * pitch
    width = max(p.size_mm[1] for p in (led.pads.anode, led.pads.cathode)) + rng.uniform(0.2, 2.0)
    ends = rng.uniform(1.5, 6.0), rng.uniform(0.8, 4.0)
    found = circuit(
        led,
        count=count,
        wanted_ma=variant.max_current_ma * rng.uniform(0.02, 0.5),
        supply_v=rng.uniform(4.5, 24.0),
        driven=bool(rng.random() < 0.2),
        ambient_c=25.0,
        board_k=rng.uniform(20.0, 200.0),
    )
    lengths = string_lengths(count, round(float(found.series)))
    ohms = () if found.resistance_ohm == 0 else (float(found.resistance_ohm),) * len(lengths)
    shape = BoardShape(
        name="led_board_any",
        title="LED board",
        label="LEFT ANY",
        x_mm=(-span / 2 - ends[0] - led.reach_mm[0], span / 2 + led.reach_mm[1] + ends[1]),
        width_mm=width,
        thickness_mm=0.8,
        led_x_mm=tuple(k * pitch - span / 2 for k in range(count)),
        material="fr4",
        copper_um=35.0,
        spacing=spacing,
    )
    return shape, found, StringPlan(lengths, ohms)


def faults(board: Board) -> list[str]:
    """What is wrong with the written copper."""
    layers, project = layer_files(board), kicad_files(board)
    s, n, told = board.spacing, board.name, []
    pads = {(c.ref, p.number): p.at_mm for c, p in board.pads}
    files = (layers[f"{n}-{end}"] for end in ("F_Cu.gbr", "B_Cu.gbr", "PTH.drl"))
    if copper_nets(*files, pads) != schematic_nets(project[f"{n}.kicad_sch"]):
        told.append("nets")
    outline = box(*board.corners_mm[0], *board.corners_mm[2])
    for layer in ("F_Cu", "B_Cu"):
        shapes = gerber_shapes(layers[f"{n}-{layer}.gbr"])
        parts = pieces(shapes)
        apart = min((a.distance(b) for a, b in itertools.combinations(parts, 2)), default=1.0)
        edge = outline.exterior.distance(unary_union(shapes))
        if apart < s.space_mm - CHORD_MM:
            told.append(f"{layer}: space {apart:.3f} of {s.space_mm:.3f}")
        if edge < s.edge_mm - CHORD_MM or not outline.contains(unary_union(shapes)):
            told.append(f"{layer}: edge {edge:.3f} of {s.edge_mm:.3f}")
    thin = min(t.width_mm for t in board.tracks)
    if thin < s.trace_mm - 1e-9:
        told.append(f"trace {thin:.3f} of {s.trace_mm:.3f}")
    bodies = [
        box(c.at_mm[0] - c.body_mm[0] / 2, c.at_mm[1] - c.body_mm[1] / 2,
            c.at_mm[0] + c.body_mm[0] / 2, c.at_mm[1] + c.body_mm[1] / 2)
        for c in board.components
    ]  # fmt: skip
    if any(a.intersects(b) for a, b in itertools.combinations(bodies, 2)):
        told.append("bodies overlap")
    return told


def outcomes(seeds: range) -> dict[str, Any]:
    """How many of the boards can be laid out, and what is wrong with which of them."""
    wrong, laid = {}, 0
    for seed in seeds:
        shape, found, plan = drawn(seed)
        if layout_problem(shape, found):
            continue
        laid += 1
        if told := faults(lay_out(shape, found, plan)):
            wrong[seed] = told
    return {"laid": laid, "wrong": wrong}


def test_random_boards() -> None:
    told = outcomes(range(80))
    assert told["wrong"] == {}
    assert 15 < told["laid"] < 70


@pytest.mark.slow
def test_many_random_boards() -> None:
    told = outcomes(range(1000, 2500))
    assert told["wrong"] == {}
    assert told["laid"] > 300
