"""A board as KiCad's .kicad_pcb, in the format of KiCad 8, which later versions read too."""

from __future__ import annotations

from collections.abc import Iterator

from gelslim_cad.electronics.board import Board, Component, Pad, Point
from gelslim_cad.electronics.gerber_layers import MASK_MM, PIN_NAMES, PROFILE_MM
from gelslim_cad.electronics.s_expression import NO, YES, Expression, Word, identifier, render
from gelslim_core import __version__

FORMAT = 20240108
"""Format of the file, that of KiCad 8.0."""
ORIGIN_MM = (150.0, 100.0)
"""Where the frame of the board has its origin on KiCad's sheet, whose y points down."""
LIBRARY = "gelslim"
COURTYARD_MM = 0.05
LAYERS = (
    (0, "F.Cu", "signal"), (31, "B.Cu", "signal"), (34, "B.Paste", "user"),
    (35, "F.Paste", "user"), (36, "B.SilkS", "user"), (37, "F.SilkS", "user"),
    (38, "B.Mask", "user"), (39, "F.Mask", "user"), (44, "Edge.Cuts", "user"),
    (46, "B.CrtYd", "user"), (47, "F.CrtYd", "user"), (48, "B.Fab", "user"),
    (49, "F.Fab", "user"),
)  # fmt: skip
LED_LAYERS = ("F.Cu", "F.Paste", "F.Mask")
WIRE_LAYERS = ("F.Cu", "F.Mask")


def kicad_board(board: Board) -> bytes:
    """The board; its parts point to the symbols of the schematic of the same name."""
    nets = {name: number for number, name in enumerate(board.nets, start=1)}
    title: Expression = ("title_block", ("title", board.title), ("rev", "1"))
    expression: Expression = (
        "kicad_pcb",
        ("version", FORMAT),
        ("generator", "gelslim-cad"),
        ("generator_version", __version__),
        ("general", ("thickness", board.thickness_mm), ("legacy_teardrops", NO)),
        ("paper", "A4"),
        title,
        ("layers", *((Word(n), name, Word(kind)) for n, name, kind in LAYERS)),
        (
            "setup",
            ("pad_to_mask_clearance", MASK_MM),
            ("allow_soldermask_bridges_in_footprints", NO),
            ("grid_origin", *ORIGIN_MM),
        ),
        ("net", 0, ""),
        *(("net", number, name) for name, number in nets.items()),
        *(_footprint(board, part, nets) for part in board.components),
        *_drawings(board),
        *_copper(board, nets),
    )
    return (render(expression) + "\n").encode()


def on_sheet_mm(point: Point) -> Point:
    """A point of the board's frame on KiCad's sheet."""
    return ORIGIN_MM[0] + point[0], ORIGIN_MM[1] - point[1]


def footprint_name(part: Component) -> str:
    """Name of the footprint with its library, as schematic and board give it."""
    return f"{LIBRARY}:{part.footprint}"


def symbol_identifier(board: Board, ref: str) -> str:
    """Identifier of a part's symbol in the schematic."""
    return identifier(board.name, "symbol", ref)


def _footprint(board: Board, part: Component, nets: dict[str, int]) -> Expression:
    def own(*names: str) -> Expression:
        return ("uuid", identifier(board.name, "footprint", part.ref, *names))

    bought = part.kind != "wires"
    attributes = ("smd",) if bought else ("smd", "exclude_from_pos_files", "exclude_from_bom")
    return (
        "footprint",
        footprint_name(part),
        ("layer", "F.Cu"),
        own(),
        ("at", *on_sheet_mm(part.at_mm)),
        *(
            (
                "property",
                name,
                value,
                ("at", 0, 0, 0),
                ("layer", "F.Fab"),
                ("hide", YES if name != "Reference" else NO),
                own(name),
                ("effects", ("font", ("size", 0.4, 0.4), ("thickness", 0.06))),
            )
            for name, value in (
                ("Reference", part.ref),
                ("Value", part.value),
                ("Footprint", footprint_name(part)),
                ("Manufacturer", part.maker),
                ("Part", part.part),
            )
        ),
        ("path", f"/{symbol_identifier(board, part.ref)}"),
        ("sheetname", "/"),
        ("sheetfile", f"{board.name}.kicad_sch"),
        ("attr", *map(Word, attributes)),
        *_outlines(part, own),
        *(_pad(part, pad, nets, own(pad.number)) for pad in part.pads),
    )


def _outlines(part: Component, own: object) -> Iterator[Expression]:
    """Body on the layer of the assembly drawing, and the courtyard."""
    assert callable(own)
    x, y = part.at_mm
    boxes = [p.box_mm for p in part.pads]
    half = part.body_mm[0] / 2, part.body_mm[1] / 2
    grow = COURTYARD_MM
    yard = (
        min(-half[0], *(b[0] - x for b in boxes)) - grow,
        min(-half[1], *(b[1] - y for b in boxes)) - grow,
        max(half[0], *(b[2] - x for b in boxes)) + grow,
        max(half[1], *(b[3] - y for b in boxes)) + grow,
    )
    for layer, width, (x0, y0, x1, y1) in (
        ("F.Fab", 0.05, (-half[0], -half[1], half[0], half[1])),
        ("F.CrtYd", 0.05, yard),
    ):
        yield (
            "fp_rect",
            ("start", x0, -y1),
            ("end", x1, -y0),
            ("stroke", ("width", width), ("type", Word("solid"))),
            ("fill", Word("none")),
            ("layer", layer),
            own(layer),
        )


def _pad(part: Component, pad: Pad, nets: dict[str, int], own: Expression) -> Expression:
    layers = WIRE_LAYERS if part.kind == "wires" else LED_LAYERS
    offset = pad.at_mm[0] - part.at_mm[0], part.at_mm[1] - pad.at_mm[1]
    return (
        "pad",
        pad.number,
        Word("smd"),
        Word("rect"),
        ("at", *offset),
        ("size", *pad.size_mm),
        ("layers", *layers),
        ("net", nets[pad.net], pad.net),
        ("pinfunction", PIN_NAMES.get(pad.role, "")),
        ("pintype", "passive"),
        own,
    )


def _drawings(board: Board) -> Iterator[Expression]:
    """Outline and legend."""
    corners = board.corners_mm
    edges = zip(corners, (*corners[1:], corners[0]), strict=True)
    lines = [("Edge.Cuts", PROFILE_MM, a, b) for a, b in edges]
    lines += [(m.layer, m.width_mm, m.start_mm, m.end_mm) for m in board.marks]
    for number, (layer, width, start, end) in enumerate(lines):
        yield (
            "gr_line",
            ("start", *on_sheet_mm(start)),
            ("end", *on_sheet_mm(end)),
            ("stroke", ("width", width), ("type", Word("solid"))),
            ("layer", layer),
            ("uuid", identifier(board.name, "line", str(number))),
        )


def _copper(board: Board, nets: dict[str, int]) -> Iterator[Expression]:
    for number, track in enumerate(board.tracks):
        yield (
            "segment",
            ("start", *on_sheet_mm(track.start_mm)),
            ("end", *on_sheet_mm(track.end_mm)),
            ("width", track.width_mm),
            ("layer", track.layer),
            ("net", nets[track.net]),
            ("uuid", identifier(board.name, "track", str(number))),
        )
    for number, via in enumerate(board.vias):
        yield (
            "via",
            ("at", *on_sheet_mm(via.at_mm)),
            ("size", board.spacing.via_mm),
            ("drill", board.spacing.drill_mm),
            ("layers", "F.Cu", "B.Cu"),
            ("net", nets[via.net]),
            ("uuid", identifier(board.name, "via", str(number))),
        )
