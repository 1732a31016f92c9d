"""The report's table of force operators: errors by kind of contact, and memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_cad.report.markup import number, text

if TYPE_CHECKING:
    from ifem_export.operators.operator_ladder import MeasuredRung, OperatorLadder

KINDS = {
    "smooth": "Smooth motion",
    "small_ball": "Small ball",
    "sharp_punch": "Sharp punch",
    "edge": "At the edge",
    "two_contacts": "Two contacts",
}


def forces_section(ladder: OperatorLadder | None, default: str = "") -> str:
    """The section as HTML.

    Args:
        ladder: The measured operators of the bundle; None where there are none.
        default: Label of the operator with which the force pipeline starts.

    Returns:
        A table; a sentence where there is no ladder.
    """
    if ladder is None:
        return '<p class="soft">No operators were measured.</p>'
    head = "".join(f'<th class="num">{text(h)}</th>' for h in (*KINDS.values(), "Memory, MB"))
    rows = "".join(_row(rung, rung.label == default) for rung in ladder.rungs)
    told = (
        "The larger error of force field and resultant with which each operator turns the motion "
        f"of the gel into forces, against {ladder.reference}. The force pipeline starts with "
        f"{default or 'the chosen one'}; the noise of the markers comes on top."
    )
    return (
        f'<p class="soft">{text(told)}</p><div class="card scroll"><table><thead><tr>'
        f"<th>Operator</th>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _row(rung: MeasuredRung, is_default: bool) -> str:
    errors = rung.errors
    cells = [f"{number(100 * errors[kind], 3)} %" if kind in errors else "–" for kind in KINDS] + [
        number(rung.n_bytes / 1e6, 3)
    ]
    name = text(rung.label)
    body = "".join(f'<td class="num">{text(cell)}</td>' for cell in cells)
    return f"<tr><td>{f'<strong>{name}</strong>' if is_default else name}</td>{body}</tr>"
