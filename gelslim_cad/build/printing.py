"""The measures of the printed parts of a build, read from its files."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.part import Part
from gelslim_cad.ordering.line import BomLine
from gelslim_cad.printability.limits import print_limits, print_process
from gelslim_cad.printability.measures import PrintMeasures
from gelslim_cad.printability.rules import PrintedPart, hint

SERVICE_NOTE = re.compile(r"\bprint\b")
"""Marks a note on a part that a printing service must know."""


def print_options(d: Lookup, part: Part) -> tuple[tuple[str, Any], ...]:
    """What the unit of work of a printed part needs of its process; empty for other parts."""
    if part.process != "print":
        return ()
    limits = print_limits(d, print_process(d, part))
    return (("overhang_deg", limits.overhang_deg), ("bridge_mm", limits.bridge_mm))


def print_stem(part: Part) -> str:
    """Path of the files of a printed part without the suffix."""
    return f"{'mould' if 'mould' in part.tags else 'print'}/{part.name}"


def printed_parts(
    d: Lookup, parts: Iterable[Part], contents: Mapping[str, bytes]
) -> tuple[PrintedPart, ...]:
    """The printed parts with the measures that their units wrote.

    Args:
        d: Spec fields.
        parts: All parts and tooling.
        contents: Files of the build by path.

    Returns:
        Measures and limits, in the order of the parts.
    """
    return tuple(
        PrintedPart(
            part.name,
            PrintMeasures(**json.loads(contents[f"{print_stem(part)}.json"])),
            print_limits(d, print_process(d, part)),
        )
        for part in parts
        if part.process == "print" and "instance" not in part.tags
    )


def print_hints(bom: Iterable[BomLine], printed: Iterable[PrintedPart]) -> dict[str, str]:
    """What the printing service must know of each part: notes on printing, supports, openings."""
    notes = {b.name: b.note for b in bom if b.process == "print" and SERVICE_NOTE.search(b.note)}
    found = {p.name: "; ".join(filter(None, (notes.get(p.name, ""), hint(p)))) for p in printed}
    return {name: said for name, said in found.items() if said}
