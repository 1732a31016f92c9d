"""Written boards read back: nets of copper and schematic, clearances, outline, places, bytes."""

from __future__ import annotations

import csv
import io
import itertools
import re
import zipfile

import numpy as np
import pytest
from board_samples import ALL_BOARDS, CASES, board_of, derived, made
from copper_reader import (
    child,
    children,
    copper_nets,
    excellon_holes,
    gerber_shapes,
    numbers,
    parsed,
    pieces,
    property_of,
    schematic_nets,
)
from shapely.geometry import Point, box
from shapely.ops import unary_union

from gelslim_cad.electronics.finger import finger_boards
from gelslim_cad.electronics.gerber_layers import layer_files
from gelslim_cad.electronics.kicad_project import kicad_files
from gelslim_cad.electronics.order import order_files
from gelslim_cad.geometry.led_strips import has_tip_light, strip_sides
from gelslim_cad.light.scene import led_rows, tip_row

SHEET_MM = (150.0, 100.0)
"""Where the files of KiCad put the origin, whose y points down."""


def pads_of_kicad(data: bytes) -> dict[tuple[str, str], tuple[float, float]]:
    """Place of each pad in the frame of the finger."""
    found = {}
    for footprint in children(parsed(data), "footprint"):
        x, y = numbers(child(footprint, "at"))
        for pad in children(footprint, "pad"):
            dx, dy = numbers(child(pad, "at"))
            place = (x + dx - SHEET_MM[0], SHEET_MM[1] - y - dy)
            found[property_of(footprint, "Reference"), pad[1]] = place
    return found


@pytest.mark.parametrize(("case", "number"), ALL_BOARDS)
def test_copper_joins_what_the_schematic_joins(case: str, number: int) -> None:
    board = board_of(case, number).board
    layers, project = layer_files(board), kicad_files(board)
    pads = pads_of_kicad(project[f"{board.name}.kicad_pcb"])
    drawn = schematic_nets(project[f"{board.name}.kicad_sch"])
    n = board.name
    files = (layers[f"{n}-{end}"] for end in ("F_Cu.gbr", "B_Cu.gbr", "PTH.drl"))
    assert copper_nets(*files, pads) == drawn
    # The names of the nets in the board file divide the pins in the same way.
    named: dict[str, set[tuple[str, str]]] = {}
    for footprint in children(parsed(project[f"{n}.kicad_pcb"]), "footprint"):
        for pad in children(footprint, "pad"):
            pin = property_of(footprint, "Reference"), pad[1]
            named.setdefault(child(pad, "net")[2], set()).add(pin)
    assert frozenset(map(frozenset, named.values())) == drawn
    # Every LED lights: from supply to ground through LEDs in series.
    assert {p for p in pads if p[0].startswith("D")} == {
        (c.ref, p.number) for c in board.components if c.kind == "led" for p in c.pads
    }


def test_the_comparison_sees_a_cut_track_and_a_lost_wire() -> None:
    board = board_of("gelslim2", 0).board
    layers, project = layer_files(board), kicad_files(board)
    pads = pads_of_kicad(project[f"{board.name}.kicad_pcb"])
    front = layers[f"{board.name}-F_Cu.gbr"].decode().splitlines()
    line = next(i for i, text in enumerate(front) if text.endswith("D01*"))
    cut = "\n".join([*front[:line], *front[line + 1 :], ""]).encode()
    back, holes = layers[f"{board.name}-B_Cu.gbr"], layers[f"{board.name}-PTH.drl"]
    sheet = project[f"{board.name}.kicad_sch"]
    assert copper_nets(cut, back, holes, pads) != schematic_nets(sheet)
    text = sheet.decode().replace('(global_label "S1_1"', '(global_label "S1_2"', 1)
    assert schematic_nets(text.encode()) != schematic_nets(sheet)


@pytest.mark.parametrize(("case", "number"), ALL_BOARDS)
def test_copper_keeps_its_distances(case: str, number: int) -> None:
    board = board_of(case, number).board
    s, layers = board.spacing, layer_files(board)
    outline = box(*board.corners_mm[0], *board.corners_mm[2])
    tolerance = 2e-3  # chords of the round ends
    holes = excellon_holes(layers[f"{board.name}-PTH.drl"])
    for layer in ("F_Cu", "B_Cu"):
        shapes = gerber_shapes(layers[f"{board.name}-{layer}.gbr"])
        parts = pieces(shapes)
        apart = [a.distance(b) for a, b in itertools.combinations(parts, 2)]
        assert min(apart, default=1.0) >= s.space_mm - tolerance
        whole = unary_union(shapes)
        assert outline.contains(whole)
        assert outline.exterior.distance(whole) >= s.edge_mm - tolerance
        for x, y, diameter in holes:
            (own,) = [p for p in parts if p.contains(Point(x, y))]
            ring = own.exterior.distance(Point(x, y)) - diameter / 2
            assert ring >= (s.via_mm - s.drill_mm) / 2 - tolerance
    for track in board.tracks:
        assert track.width_mm >= s.trace_mm - 1e-9
    assert all(d == pytest.approx(s.drill_mm) for _, _, d in holes)
    places = np.array([(x, y) for x, y, _ in holes])
    between = np.linalg.norm(places[:, None] - places[None], axis=-1)
    assert (between + 10 * np.eye(len(holes))).min() >= s.drill_mm + 0.15


@pytest.mark.parametrize(("case", "number"), ALL_BOARDS)
def test_mask_paste_and_legend_suit_the_pads(case: str, number: int) -> None:
    board = board_of(case, number).board
    layers = layer_files(board)

    def shapes(layer: str) -> list:
        return gerber_shapes(layers[f"{board.name}-{layer}.gbr"])

    openings, paste = shapes("F_Mask"), shapes("F_Paste")
    pads = [box(*p.box_mm) for _, p in board.pads]
    assert len(openings) == len(pads)
    assert all(any(o.buffer(1e-6).contains(p) for o in openings) for p in pads)
    # Between openings of different nets a web of mask remains.
    for (a, net_a), (b, net_b) in itertools.combinations(
        [(o, p.net) for o, (_, p) in zip(openings, board.pads, strict=True)], 2
    ):
        assert net_a == net_b or a.distance(b) >= 0.05 - 1e-9
    soldered = sum(p.area for p, (c, _) in zip(pads, board.pads, strict=True) if c.kind != "wires")
    assert sum(p.area for p in paste) == pytest.approx(soldered)
    legend = unary_union(shapes("F_Silkscreen")) if shapes("F_Silkscreen") else None
    if legend is not None:
        assert legend.distance(unary_union(openings)) > 0.02
        assert box(*board.corners_mm[0], *board.corners_mm[2]).contains(legend)
    assert shapes("B_Mask") == []


@pytest.mark.parametrize("case", CASES)
def test_leds_stand_where_the_light_is_traced(case: str) -> None:
    d = derived(case)
    rows = {side: row.x_mm for side, row in zip(("left", "right"), led_rows(d), strict=True)}
    if has_tip_light(d):
        # Along the board's x the finger's y falls: its wires leave at +y.
        rows["tip"] = tuple(-y for y in reversed(tip_row(d).y_mm))
    seen = []
    for item in made(case).boards:
        text = layer_files(item.board)[f"{item.board.name}-F_Cu.gbr"].decode()
        assert ".AperFunction,SMDPad,CuDef" in text
        table = order_files(made(case), d)[f"{item.board.name}/{item.board.name}_CPL.csv"][0]
        places = [
            float(row["Mid X"].removesuffix("mm"))
            for row in csv.DictReader(io.StringIO(table.decode()))
            if row["Designator"].startswith("D")
        ]
        for side in item.sides:
            np.testing.assert_allclose(places, rows[side], atol=1e-4)
            seen.append(side)
    assert seen == list(strip_sides(d))


def test_outline_and_height_are_those_of_the_cad_part() -> None:
    pytest.importorskip("cadquery", reason="comparing with the solid needs the [cad] extra")
    from gelslim_cad.solids.guide import led_boards

    for case in ("gelslim2", "long50", "small"):
        d = derived(case)
        parts = led_boards(d)
        for item, part, side in zip(made(case).boards, parts, (-1, 1), strict=True):
            project = kicad_files(item.board)[f"{item.board.name}.kicad_pcb"]
            lines = [
                [numbers(child(e, end)) for end in ("start", "end")]
                for e in children(parsed(project), "gr_line")
                if child(e, "layer")[1] == "Edge.Cuts"
            ]
            points = np.array(lines).reshape(-1, 2)
            x, y = points[:, 0] - SHEET_MM[0], SHEET_MM[1] - points[:, 1]
            bounds = part.solid.BoundingBox()
            centre = side * d["led.y_mm"]
            found = (x.min(), x.max(), y.min() + centre, y.max() + centre)
            wanted = (bounds.xmin, bounds.xmax, bounds.ymin, bounds.ymax)
            np.testing.assert_allclose(found, wanted, atol=1e-4)
            assert part.name == item.board.name
            assert child(child(parsed(project), "general"), "thickness")[1] == f"{0.8:g}"


def test_the_board_at_the_tip_is_as_large_as_its_cad_part() -> None:
    pytest.importorskip("cadquery", reason="comparing with the solid needs the [cad] extra")
    from gelslim_cad.solids.guide import led_boards

    d, item = derived("tip"), board_of("tip", 2)
    part = led_boards(d)[2]
    bounds = part.solid.BoundingBox()
    assert part.name == item.board.name == "led_board_blue"
    assert item.board.x_mm == pytest.approx((bounds.ymin, bounds.ymax))
    assert item.board.width_mm == pytest.approx(bounds.zlen)
    wires = next(c for c in item.board.components if c.kind == "wires")
    # The lips hold 1.2 mm of both ends; between pads and lip lies the copper's edge.
    assert min(p.box_mm[0] for p in wires.pads) == pytest.approx(bounds.ymin + 1.2 + 0.2)
    assert max(p.box_mm[2] for _, p in item.board.pads) < bounds.ymax - 1.2
    # The wires' pads lie over the channel of the wires.
    assert wires.pads[0].box_mm[0] < -d["wire.tip_y_mm"] < wires.pads[0].box_mm[2]
    assert item.circuit.led.variant.wavelength_nm == 470


def test_gerber_files_say_what_they_are() -> None:
    wanted = {
        "F_Cu": ("Copper,L1,Top", "Positive"),
        "B_Cu": ("Copper,L2,Bot", "Positive"),
        "F_Mask": ("Soldermask,Top", "Negative"),
        "B_Mask": ("Soldermask,Bot", "Negative"),
        "F_Paste": ("Paste,Top", "Positive"),
        "F_Silkscreen": ("Legend,Top", "Positive"),
        "B_Silkscreen": ("Legend,Bot", "Positive"),
        "Edge_Cuts": ("Profile,NP", "Positive"),
    }
    board = board_of("gelslim2", 0).board
    layers = layer_files(board)
    assert set(layers) == {f"{board.name}-{n}.gbr" for n in wanted} | {f"{board.name}-PTH.drl"}
    for name, (function, polarity) in wanted.items():
        text = layers[f"{board.name}-{name}.gbr"].decode("ascii")
        assert f"%TF.FileFunction,{function}*%" in text
        assert f"%TF.FilePolarity,{polarity}*%" in text
        assert "%TF.Part,Single*%" in text
        assert text.endswith("M02*\n")
        assert text.index("%FSLAX46Y46*%") < text.index("%MOMM*%") < text.index("%LPD*%")
    nets = set(re.findall(r"%TO\.N,([^*]+)\*%", layers[f"{board.name}-F_Cu.gbr"].decode()))
    assert nets == set(board.nets)


def test_another_reader_finds_the_same_stack() -> None:
    gerbonara = pytest.importorskip(
        "gerbonara", reason="GERBONARA MISSING: boards were not read by it; pip install gerbonara"
    )
    import tempfile
    from pathlib import Path

    for case, number in (("gelslim2", 0), ("narrow", 1), ("driven", 0)):
        board = board_of(case, number).board
        with tempfile.TemporaryDirectory() as folder:
            for name, data in layer_files(board).items():
                (Path(folder) / name).write_bytes(data)
            stack = gerbonara.LayerStack.open(Path(folder))
        (low, high) = stack.outline.bounding_box(unit="mm")
        size = np.subtract(high, low)
        length = board.x_mm[1] - board.x_mm[0]
        np.testing.assert_allclose(size, (length + 0.05, board.width_mm + 0.05), atol=1e-3)
        (drills,) = stack.drill_layers
        assert len(drills.objects) == len(board.vias)
        front = stack.graphic_layers["top", "copper"].objects
        flashes = [o for o in front if type(o).__name__ == "Flash"]
        assert len(flashes) == len(board.pads) + len(board.vias)
        lines = [t for t in board.tracks if t.layer == "F.Cu"]
        assert len(front) - len(flashes) == len(lines)


def test_tables_name_every_part_once() -> None:
    item = board_of("unequal_strings", 1)
    files = order_files(made("unequal_strings"), derived("unequal_strings"))
    n = item.board.name

    def rows(table: str) -> list[dict[str, str]]:
        return list(csv.DictReader(io.StringIO(files[f"{n}/{n}_{table}.csv"][0].decode())))

    named = [ref for row in rows("BOM") for ref in row["Designator"].split(",")]
    placed = [row["Designator"] for row in rows("CPL")]
    assert sorted(named) == sorted(placed)
    assert (
        len(set(named)) == len(named) == round(float(item.circuit.count)) + len(item.plan.lengths)
    )
    assert all(int(r["Quantity"]) == len(r["Designator"].split(",")) for r in rows("BOM"))
    assert {r["Layer"] for r in rows("CPL")} == {"Top"}
    # Two lengths of strings have two resistors.
    assert len({r["Comment"] for r in rows("BOM") if r["Footprint"].startswith("R_")}) == 2


def test_files_repeat_byte_for_byte_and_the_archive_holds_the_layers() -> None:
    d = derived("gelslim2")
    first, again = (order_files(finger_boards(d), d) for _ in range(2))
    assert {k: v[0] for k, v in first.items()} == {k: v[0] for k, v in again.items()}
    n = "led_board_red"
    with zipfile.ZipFile(io.BytesIO(first[f"{n}/{n}_gerber.zip"][0])) as packed:
        held = {i.filename: packed.read(i) for i in packed.infolist()}
    assert held == layer_files(board_of("gelslim2", 0).board)
    identifiers = re.findall(rb'\(uuid "([^"]+)"\)', first[f"{n}/{n}.kicad_pcb"][0])
    assert len(identifiers) == len(set(identifiers)) > 50


def test_boards_of_one_wavelength_are_one_design() -> None:
    (item,) = made("infrared").boards
    assert item.sides == ("left", "right")
    assert item.board.quantity == 2
    assert item.board.name == "led_board"
    assert (
        b"| `led_board` | 2 |" in order_files(made("infrared"), derived("infrared"))["ORDER.md"][0]
    )


def test_the_order_tells_the_flux_that_the_plastic_bears() -> None:
    from board_samples import varied

    from gelslim_cad.dimensions import derive

    hot = derive(varied("mini20", {"design.leds.radiant_flux_mw": 20.0}))
    page = order_files(finger_boards(hot), hot)["ORDER.md"][0].decode()
    flux = min(float(v) for v in re.findall(r"radiant_flux_mw to about ([\d.]+);", page))
    cooler = derive(varied("mini20", {"design.leds.radiant_flux_mw": 0.9 * flux}))
    assert cooler["electronics.right_board_c"] < 55 < hot["electronics.right_board_c"]
    calm = order_files(finger_boards(cooler), cooler)["ORDER.md"][0].decode()
    assert "Too warm" not in calm


def test_without_an_led_of_the_library_the_order_says_why() -> None:
    from board_samples import varied

    from gelslim_cad.dimensions import derive

    d = derive(varied("thin", {}))
    boards = finger_boards(d)
    assert boards.boards == ()
    files = order_files(boards, d)
    assert set(files) == {"ORDER.md"}
    assert b"No LED board can be made" in files["ORDER.md"][0]
