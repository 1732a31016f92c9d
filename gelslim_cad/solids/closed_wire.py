"""Closed wires of straight and circular pieces that share their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cadquery as cq
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeVertex,
    BRepBuilderAPI_MakeWire,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.TopoDS import TopoDS_Edge, TopoDS_Vertex


@dataclass(frozen=True)
class Piece:
    """From `start_mm` to where the next piece starts: straight, or an arc through `middle_mm`."""

    start_mm: cq.Vector
    middle_mm: cq.Vector | None = None


def closed_wire(pieces: Sequence[Piece]) -> cq.Wire:
    """Wire through the pieces in turn, the last one ending where the first begins.

    Neighbouring pieces share one vertex. The kernel would merge equal ends into their mean, summed
    in the order of memory addresses, so that the last bits would differ between processes.
    """
    corners = [BRepBuilderAPI_MakeVertex(p.start_mm.toPnt()).Vertex() for p in pieces]
    wire = BRepBuilderAPI_MakeWire()
    for k, piece in enumerate(pieces):
        follow = (k + 1) % len(pieces)
        wire.Add(_edge(piece, corners[k], pieces[follow].start_mm, corners[follow]))
    return cq.Wire(wire.Wire())


def _edge(piece: Piece, start: TopoDS_Vertex, to_mm: cq.Vector, end: TopoDS_Vertex) -> TopoDS_Edge:
    if piece.middle_mm is None:
        return BRepBuilderAPI_MakeEdge(start, end).Edge()
    points = (piece.start_mm.toPnt(), piece.middle_mm.toPnt(), to_mm.toPnt())
    arc = GC_MakeArcOfCircle(*points).Value()
    first, last = arc.FirstParameter(), arc.LastParameter()
    return BRepBuilderAPI_MakeEdge(arc, start, end, first, last).Edge()
