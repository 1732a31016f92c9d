"""Order files: one archive for each service, with a text that says all it must know."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from gelslim_cad.ordering.cost import Cost, cost_sentence
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.ordering.price_list import PriceList
from gelslim_cad.ordering.shopping import purchases
from gelslim_cad.ordering.tables import shopping_csv
from gelslim_cad.ordering.texts import (
    Kerfs,
    PrintOrder,
    glass_text,
    laser_text,
    milling_text,
    overview,
    print_text,
    sheet_folder,
    stencil_text,
)
from gelslim_core.files.archive import archive

FOLDER = "orders"
Files = dict[str, tuple[bytes, str]]
"""Content and purpose of files by their path."""


@dataclass(frozen=True)
class OrderInput:
    """What order files are made of.

    Attributes:
        name: Name of the finger.
        lines: The priced bill of materials.
        contents: Files of the build by path, with those of the electronics.
        printing: How the parts are printed.
        kerfs: Kerf that each outline is moved for, by the name of its file.
        boards: Names of the LED boards.
        stencil: Files of a marker stencil that a stencil maker cuts; empty where none is wanted.
    """

    name: str
    lines: tuple[BomLine, ...]
    contents: Mapping[str, bytes]
    printing: PrintOrder
    kerfs: Kerfs
    boards: tuple[str, ...] = ()
    stencil: tuple[str, ...] = ()


def order_archives(given: OrderInput, cost: Cost, prices: PriceList) -> Files:
    """All order files of a finger.

    Args:
        given: Bill, files and processes.
        cost: The sums of the bill.
        prices: The price list.

    Returns:
        The archives, the shopping list and a page that says what goes where, by path.
    """
    makers: tuple[tuple[str, str, Callable[[OrderInput], dict[str, bytes]]], ...] = (
        ("printer.zip", "for the 3D printing service", printer_files),
        ("laser.zip", "for the laser service", laser_files),
        ("glass.zip", "for who cuts the mirror", glass_files),
        ("milling.zip", "for who mills the mould", milling_files),
        ("boards.zip", "for the board house", board_files),
        ("stencil.zip", "for the stencil maker", stencil_files),
    )
    packed = {name: (make(given), purpose) for name, purpose, make in makers}
    packed = {name: found for name, found in packed.items() if found[0]}
    made: Files = {
        f"{FOLDER}/{name}": (archive(files), purpose) for name, (files, purpose) in packed.items()
    }
    listed = purchases(given.lines)
    made[f"{FOLDER}/shopping.csv"] = (shopping_csv(listed, prices), "what to buy, by supplier")
    page = overview(given.name, {n: p for n, (_, p) in packed.items()}, cost_sentence(cost))
    made[f"{FOLDER}/ORDER.md"] = (page, "what to order where")
    return made


def printer_files(given: OrderInput) -> dict[str, bytes]:
    """Meshes of the printed parts in print orientation, with a text."""
    lines = [line for line in given.lines if line.process == "print"]
    files: dict[str, bytes] = {}
    for line in lines:
        for kind in ("stl", "3mf"):
            path = _first(given.contents, f"print/{line.name}.{kind}", f"mould/{line.name}.{kind}")
            files[f"{kind}/{line.name}.{kind}"] = given.contents[path]
    if lines:
        files["PRINT.txt"] = print_text(given.name, lines, given.printing, files)
    return files


def laser_files(given: OrderInput) -> dict[str, bytes]:
    """Outlines in a folder for each sheet, with a text."""
    cut = [(line, path) for line, path in _outlines(given) if line.process != "buy"]
    named = [(line, f"{sheet_folder(line)}/{path.rpartition('/')[2]}") for line, path in cut]
    files = {to: given.contents[path] for (_, to), (_, path) in zip(named, cut, strict=True)}
    if files:
        files["LASER.txt"] = laser_text(given.name, named, given.kerfs)
    return files


def glass_files(given: OrderInput) -> dict[str, bytes]:
    """Outlines of bought parts that are cut to size, with a text."""
    found = [(line, path) for line, path in _outlines(given) if line.process == "buy"]
    files = {path.rpartition("/")[2]: given.contents[path] for _, path in found}
    if files:
        files["GLASS.txt"] = glass_text(given.name, [line for line, _ in found])
    return files


def milling_files(given: OrderInput) -> dict[str, bytes]:
    """Solids of the mould where it is milled, with a text."""
    lines = [
        line
        for line in given.lines
        if line.process == "buy" and f"mould/{line.name}.step" in given.contents
    ]
    files = {f"{line.name}.step": given.contents[f"mould/{line.name}.step"] for line in lines}
    if files:
        files["MILLING.txt"] = milling_text(given.name, lines)
    return files


def board_files(given: OrderInput) -> dict[str, bytes]:
    """For each board its layers as an archive, its parts and their places; the order's page."""
    files = {
        f"{board}/{board}{end}": given.contents[f"electronics/{board}/{board}{end}"]
        for board in given.boards
        for end in ("_gerber.zip", "_BOM.csv", "_CPL.csv")
    }
    if files:
        for name in ("ORDER.md", "wiring.svg"):
            files[name] = given.contents[f"electronics/{name}"]
    return files


def stencil_files(given: OrderInput) -> dict[str, bytes]:
    """Layers of the marker stencil, with a text."""
    files = {name: given.contents[f"markers/{name}"] for name in given.stencil}
    if files:
        files["STENCIL.txt"] = stencil_text(given.name, sorted(files))
    return files


def _outlines(given: OrderInput) -> Iterable[tuple[BomLine, str]]:
    """Lines that are cut to an outline, each with its drawing, which may be that of its blank."""
    for line in given.lines:
        for stem in (f"{line.name}_blank", line.name):
            path = f"laser/{stem}.dxf"
            if path in given.contents:
                yield line, path
                break


def _first(contents: Mapping[str, bytes], *paths: str) -> str:
    return next(path for path in paths if path in contents)
