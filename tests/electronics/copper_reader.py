"""Readers of written board files, apart from the writers: S-expressions, Gerber, Excellon, nets."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from shapely.geometry import LineString, Point, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

Pin = tuple[str, str]
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[()]|[^\s()"]+')


def parsed(data: bytes) -> list[Any]:
    """The one S-expression of a file as nested lists of texts."""
    stack: list[list[Any]] = [[]]
    for token in TOKEN.findall(data.decode()):
        if token == "(":
            stack.append([])
        elif token == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(token[1:-1] if token[0] == '"' else token)
    ((expression,),) = (stack,)
    return expression[0] if isinstance(expression[0], list) else expression


def children(expression: list[Any], name: str) -> list[list[Any]]:
    return [e for e in expression if isinstance(e, list) and e and e[0] == name]


def child(expression: list[Any], name: str) -> list[Any]:
    (found,) = children(expression, name)
    return found


def numbers(expression: list[Any]) -> tuple[float, ...]:
    return tuple(float(v) for v in expression[1:])


def property_of(expression: list[Any], name: str) -> str:
    return next(p[2] for p in children(expression, "property") if p[1] == name)


def gerber_shapes(data: bytes) -> list[BaseGeometry]:
    """Every flash and line of a Gerber file with round and rectangular apertures."""
    apertures: dict[str, tuple[str, list[float]]] = {}
    shapes: list[BaseGeometry] = []
    tool, here = "", (0.0, 0.0)
    for line in data.decode("ascii").splitlines():
        if found := re.fullmatch(r"%ADD(\d+)([CR]),([\d.X]+)\*%", line):
            apertures[found[1]] = (found[2], [float(v) for v in found[3].split("X")])
        elif found := re.fullmatch(r"D(\d\d+)\*", line):
            tool = found[1]
        elif found := re.fullmatch(r"X(-?\d+)Y(-?\d+)D0([123])\*", line):
            place = (int(found[1]) * 1e-6, int(found[2]) * 1e-6)
            kind, sizes = apertures[tool]
            if found[3] == "1":
                assert kind == "C"
                shapes.append(LineString([here, place]).buffer(sizes[0] / 2, 32))
            elif found[3] == "3" and kind == "C":
                shapes.append(Point(place).buffer(sizes[0] / 2, 32))
            elif found[3] == "3":
                half = sizes[0] / 2, sizes[1] / 2
                shapes.append(
                    box(
                        place[0] - half[0],
                        place[1] - half[1],
                        place[0] + half[0],
                        place[1] + half[1],
                    )
                )
            here = place
        else:
            assert line[0] in "%GM", line
    return shapes


def excellon_holes(data: bytes) -> list[tuple[float, float, float]]:
    """Centre and diameter of each hole."""
    tools: dict[str, float] = {}
    tool, holes = "", []
    for line in data.decode("ascii").splitlines():
        if found := re.fullmatch(r"T(\d+)C([\d.]+)", line):
            tools[found[1]] = float(found[2])
        elif found := re.fullmatch(r"T(\d+)", line):
            tool = found[1]
        elif found := re.fullmatch(r"X(-?[\d.]+)Y(-?[\d.]+)", line):
            holes.append((float(found[1]), float(found[2]), tools[tool]))
    return holes


def pieces(shapes: list[BaseGeometry]) -> list[BaseGeometry]:
    """Connected pieces of copper."""
    union = unary_union(shapes)
    return list(union.geoms) if union.geom_type == "MultiPolygon" else [union]


class Groups:
    """Things that are joined one by one."""

    def __init__(self) -> None:
        self.parent: dict[Any, Any] = {}

    def root(self, thing: Any) -> Any:
        self.parent.setdefault(thing, thing)
        while self.parent[thing] != thing:
            thing = self.parent[thing]
        return thing

    def join(self, one: Any, other: Any) -> None:
        self.parent[self.root(one)] = self.root(other)


def copper_nets(
    front: bytes, back: bytes, holes: bytes, pads: dict[Pin, tuple[float, float]]
) -> frozenset[frozenset[Pin]]:
    """Pins that the copper of the written files joins, through the plated holes."""
    layers = [pieces(gerber_shapes(front)), pieces(gerber_shapes(back))]
    groups = Groups()

    def piece(layer: int, point: tuple[float, float]) -> tuple[int, int]:
        (found,) = [i for i, p in enumerate(layers[layer]) if p.intersects(Point(point))]
        return layer, found

    for x, y, _ in excellon_holes(holes):
        groups.join(piece(0, (x, y)), piece(1, (x, y)))
    return by_root(groups, {pin: piece(0, place) for pin, place in pads.items()})


def by_root(groups: Groups, places: dict[Pin, Any]) -> frozenset[frozenset[Pin]]:
    nets: dict[Any, set[Pin]] = {}
    for pin, place in places.items():
        nets.setdefault(groups.root(place), set()).add(pin)
    return frozenset(map(frozenset, nets.values()))


def schematic_nets(data: bytes) -> frozenset[frozenset[Pin]]:
    """Pins that wires and labels of a schematic join."""
    sheet = parsed(data)
    library = {s[1]: s for s in children(child(sheet, "lib_symbols"), "symbol")}
    groups = Groups()
    wires = []
    for wire in children(sheet, "wire"):
        start, end = (key(numbers(p)) for p in children(child(wire, "pts"), "xy"))
        groups.join(start, end)
        wires.append((start, end))
    labels: dict[str, Any] = {}
    for label in children(sheet, "global_label"):
        place = key(numbers(child(label, "at")))
        for start, end in wires:
            if on_wire(place, start, end):
                groups.join(place, start)
        if label[1] in labels:
            groups.join(place, labels[label[1]])
        labels[label[1]] = place
    for joint in children(sheet, "junction"):
        place = key(numbers(child(joint, "at")))
        for start, end in wires:
            if on_wire(place, start, end):
                groups.join(place, start)
    pins: dict[Pin, Any] = {}
    for symbol in children(sheet, "symbol"):
        x, y, _ = numbers(child(symbol, "at"))
        for number, dx, dy in symbol_pins(library[child(symbol, "lib_id")[1]]):
            pins[property_of(symbol, "Reference"), number] = key((x + dx, y - dy))
    ends = {p for wire in wires for p in wire}
    assert set(pins.values()) <= ends, "a pin without a wire"
    return by_root(groups, pins)


def symbol_pins(symbol: list[Any]) -> Iterator[tuple[str, float, float]]:
    for unit in children(symbol, "symbol"):
        for pin in children(unit, "pin"):
            x, y, _ = numbers(child(pin, "at"))
            yield child(pin, "number")[1], x, y


def key(place: tuple[float, ...]) -> tuple[int, int]:
    return round(place[0] * 1000), round(place[1] * 1000)


def on_wire(point: tuple[int, int], start: tuple[int, int], end: tuple[int, int]) -> bool:
    return bool(LineString([start, end]).distance(Point(point)) < 1)
