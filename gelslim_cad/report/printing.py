"""The report's table of the printed parts: walls, holes, overhangs, what stands on the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_cad.report.markup import number, text

if TYPE_CHECKING:
    from gelslim_cad.printability.rules import PrintedPart

COLUMNS = (
    "Size, mm", "Thinnest wall, mm", "Narrowest hole, mm", "Overhang, mm²", "of it over the part",
    "Widest span, mm", "On the plate, mm²", "Sharp openings there",
)  # fmt: skip
THICK = "> 4"
"""For a part without a wall thinner than the rays reach."""


def printing_section(parts: tuple[PrintedPart, ...]) -> str:
    """What was measured of each printed part in print orientation, folded."""
    if not parts:
        return '<p class="card soft">No part is printed.</p>'
    rows = "".join(_row(part) for part in parts)
    head = "".join(f'<th class="num">{text(column)}</th>' for column in COLUMNS)
    limits = parts[0].limits
    span = (
        "any span" if limits.bridge_mm == float("inf") else f"spans up to {limits.bridge_mm:g} mm"
    )
    told = (
        f"In print orientation, for {limits.process}. Faces that lean out farther than "
        f"{limits.overhang_deg:g}° from the vertical count as overhangs; {span} carry themselves. "
        f"Walls from {limits.wall_mm:g} mm and holes from {limits.hole_mm:g} mm are advised."
    )
    return (
        f'<details class="card scroll printing"><summary>{len(parts)} printed parts as measured'
        f"</summary><p>{text(told)}</p><table><thead><tr><th>Part</th>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table></details>"
    )


def _row(part: PrintedPart) -> str:
    m = part.measures
    span = number(m.bridge_mm, 3) + (" and in the air" if m.floating else "")
    cells = (
        " × ".join(f"{s:.1f}" for s in m.size_mm),
        THICK if m.wall_mm is None else number(m.wall_mm, 3),
        "–" if m.hole_mm is None else number(m.hole_mm, 3),
        number(m.overhang_mm2, 3),
        number(m.on_part_mm2, 3),
        span,
        number(m.plate_mm2, 4),
        str(m.openings),
    )
    body = "".join(f'<td class="num">{text(cell)}</td>' for cell in cells)
    return f"<tr><td>{text(part.name)}</td>{body}</tr>"
