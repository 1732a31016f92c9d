"""The layers of a board as Gerber X2 and its holes as Excellon, in the frame of the finger."""

from __future__ import annotations

from collections.abc import Iterator

from gelslim_cad.electronics.board import Board, Layer, Legend
from gelslim_cad.markers.gerber_file import (
    GerberObject,
    Polarity,
    circle,
    gerber_file,
    object_lines,
    rectangle,
)

MASK_MM = 0.05
"""How far the solder mask stays off a pad."""
PROFILE_MM = 0.05
PIN_NAMES = {"cathode": "K", "anode": "A", "thermal": "PAD", "plus": "+", "minus": "-"}


def layer_files(board: Board) -> dict[str, bytes]:
    """Every layer and the holes, by file name as board houses expect them."""
    layers: dict[str, tuple[str, Iterator[GerberObject], Polarity]] = {
        "F_Cu": ("Copper,L1,Top", _copper(board, "F.Cu"), "Positive"),
        "B_Cu": ("Copper,L2,Bot", _copper(board, "B.Cu"), "Positive"),
        "F_Mask": ("Soldermask,Top", _openings(board, MASK_MM), "Negative"),
        "B_Mask": ("Soldermask,Bot", iter(()), "Negative"),
        "F_Paste": ("Paste,Top", _paste(board), "Positive"),
        "F_Silkscreen": ("Legend,Top", _legend(board, "F.SilkS"), "Positive"),
        "B_Silkscreen": ("Legend,Bot", _legend(board, "B.SilkS"), "Positive"),
        "Edge_Cuts": ("Profile,NP", _profile(board), "Positive"),
    }
    files = {
        f"{board.name}-{layer}.gbr": _gerber(board, function, objects, polarity)
        for layer, (function, objects, polarity) in layers.items()
    }
    return {**files, f"{board.name}-PTH.drl": excellon(board)}


def excellon(board: Board) -> bytes:
    """The plated holes in XNC, the strict form of Excellon (Ucamco, 2021), with one tool."""
    lines = [
        "M48",
        f"; {board.title}; coordinates as in the Gerber files",
        "; #@! TF.FileFunction,Plated,1,2,PTH",
        "METRIC",
        f"T01C{board.spacing.drill_mm:.3f}",
        "%",
        "G05",
        "T01",
        *(f"X{v.at_mm[0]:.4f}Y{v.at_mm[1]:.4f}" for v in board.vias),
        "M30",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


def _gerber(
    board: Board, function: str, objects: Iterator[GerberObject], polarity: Polarity
) -> bytes:
    return gerber_file(
        function,
        object_lines(objects),
        project=board.name,
        frame=board.name,
        comment="Seen from the LEDs: x to the tip of the finger, y across from the middle",
        polarity=polarity,
    )


def _copper(board: Board, layer: Layer) -> Iterator[GerberObject]:
    if layer == "F.Cu":
        for part, pad in board.pads:
            name = PIN_NAMES.get(pad.role, "")
            yield GerberObject(
                rectangle(*pad.size_mm, "SMDPad,CuDef"),
                (pad.at_mm,),
                (f".C,{part.ref}", f".P,{part.ref},{pad.number},{name}", f".N,{pad.net}"),
            )
    for via in board.vias:
        yield GerberObject(circle(board.spacing.via_mm, "ViaPad"), (via.at_mm,), (f".N,{via.net}",))
    for track in board.tracks:
        if track.layer == layer:
            yield GerberObject(
                circle(track.width_mm, "Conductor"),
                (track.start_mm, track.end_mm),
                (f".N,{track.net}",),
            )


def _openings(board: Board, grow_mm: float) -> Iterator[GerberObject]:
    for _, pad in board.pads:
        sides = (pad.size_mm[0] + 2 * grow_mm, pad.size_mm[1] + 2 * grow_mm)
        yield GerberObject(rectangle(*sides, "Material"), (pad.at_mm,))


def _paste(board: Board) -> Iterator[GerberObject]:
    for part, pad in board.pads:
        if part.kind != "wires":
            yield GerberObject(rectangle(*pad.size_mm, "Material"), (pad.at_mm,))


def _legend(board: Board, layer: Legend) -> Iterator[GerberObject]:
    for mark in board.marks:
        if mark.layer == layer:
            yield GerberObject(circle(mark.width_mm, "Material"), (mark.start_mm, mark.end_mm))


def _profile(board: Board) -> Iterator[GerberObject]:
    corners = board.corners_mm
    yield GerberObject(circle(PROFILE_MM, "Profile"), (*corners, corners[0]))
