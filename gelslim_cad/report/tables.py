"""The report's sections that are lists: dimensions, files, bill of materials, notes, spec."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gelslim_cad.ordering.cost import Cost, cost_sentence
from gelslim_cad.ordering.line import BomLine, price_source
from gelslim_cad.report.markup import Scalar, anchor, href, number, size, text, with_unit

if TYPE_CHECKING:
    from gelslim_cad.build.manifest import FileEntry


_NAME = re.compile(r"(?<![\w.])\w[\w.]*(?<!\.)(?![\w(]|\.\w)")
"""A dotted name or a number in a formula, but no function."""


@dataclass(frozen=True)
class Note:
    """A short remark under a heading of its own, e.g. on the light guide."""

    title: str
    text: str


def dimensions(records: Mapping[str, Mapping[str, Any]]) -> str:
    """List the dimensions by group; each row unfolds to its formula with numbers and source.

    `records` are those of `Dimensions.record` by the dimensions' dotted names.
    """
    groups = list(dict.fromkeys(name.split(".")[0] for name in records))
    options = "".join(f'<option value="{text(name)}">{text(name)}</option>' for name in groups)
    blocks = []
    for group in groups:
        body = "".join(
            _dimension(name, record, records)
            for name, record in records.items()
            if name.split(".")[0] == group
        )
        blocks.append(
            f'<div class="group" data-group="{text(group)}"><h3>{text(group)}</h3>{body}</div>'
        )
    return (
        '<div class="tools"><input type="search" id="dimension-search" '
        'placeholder="Search name, formula, source" aria-label="Search the dimensions">'
        '<select id="dimension-group" aria-label="Group"><option value="">all groups</option>'
        f"{options}</select>"
        '<button type="button" id="dimension-unfold">Unfold or fold all</button>'
        '<output id="dimension-count" class="soft" aria-live="polite"></output></div>'
        f'<div class="card dimensions">{"".join(blocks)}</div>'
    )


def _dimension(name: str, record: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    value, formula = with_unit(record["value"], record["unit"]), record["formula"]
    inputs = {n: v for n, v in record["inputs"].items() if isinstance(v, int | float | str)}
    steps = [f'<p class="chain"><code>{text(name)} = {text(formula)}</code></p>']
    filled = substituted(formula, inputs)
    if filled != formula:
        steps.append(f'<p class="chain"><code>= {text(filled)}</code></p>')
    steps.append(f'<p class="chain"><code>= {value}</code></p>')
    if inputs:
        chips = "".join(f"<li>{_input(n, given, known)}</li>" for n, given in inputs.items())
        steps.append(f'<ul class="inputs" aria-label="Inputs">{chips}</ul>')
    if record["source"]:
        steps.append(f'<p class="chain soft">Source: {text(record["source"])}</p>')
    return (
        f'<details class="dimension" id="{anchor("dim", name)}">'
        f'<summary><code class="name">{text(name)}</code><span class="value">{value}</span>'
        f'<code class="formula">{text(formula)}</code></summary>'
        f'<div class="body">{"".join(steps)}</div></details>'
    )


def _input(name: str, value: Scalar, known: Mapping[str, Any]) -> str:
    label = f"<code>{text(name)}</code>"
    if name in known:
        label = f'<a href="#{anchor("dim", name)}">{label}</a>'
    return f"{label} = {text(number(value))}"


def substituted(formula: str, inputs: Mapping[str, Scalar]) -> str:
    """Put the inputs' numbers in place of their names, whole names only.

    An input called `camera.focal_length_mm` is also found as `focal_length_mm` where that last
    part is not shared by another input.
    """
    values: dict[str, str] = {}
    short = [name.rsplit(".", 1)[-1] for name in inputs]
    for (name, value), last in zip(inputs.items(), short, strict=True):
        if isinstance(value, str):
            continue
        values[name] = number(value)
        if short.count(last) == 1:
            values.setdefault(last, number(value))
    return _NAME.sub(lambda found: values.get(found.group(), found.group()), formula)


def files(entries: Mapping[str, FileEntry]) -> str:
    """List the files by folder with size and sha256; links are relative to the report."""
    folder = ""
    lines = []
    for path, entry in sorted(entries.items(), key=lambda item: ("/" in item[0], item[0])):
        here, _, base = path.rpartition("/")
        if here != folder:
            folder = here
            lines.append(
                f'<tr class="folder"><th colspan="4" scope="rowgroup">{text(here)}/</th></tr>'
            )
        lines.append(
            f'<tr><td><a href="{href(path)}">{text(base)}</a></td><td>{text(entry.purpose)}</td>'
            f'<td class="num">{size(entry.size_bytes)}</td>'
            f'<td class="hash mono" title="{text(entry.sha256)}">{text(entry.sha256)}</td></tr>'
        )
    return (
        '<div class="card files scroll"><table><thead><tr><th>File</th><th>For</th>'
        '<th class="num">Size</th><th>sha256</th></tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def bom(rows: tuple[BomLine, ...], cost: Cost) -> str:
    """List what to make and to buy, with prices; makers and suppliers unfold below."""
    lines = "".join(
        f'<tr><td class="num">{row.quantity}</td><td>{text(row.name)}'
        f"{' (tooling)' if row.tooling else ''}</td>"
        f"<td>{text(row.material)}</td><td>{text(row.process)}</td>"
        f'<td class="num">{text(number(row.mass_g, 3))}</td>'
        f'<td class="num">{text(_total(row))}</td><td>{text(row.note)}</td></tr>'
        for row in rows
    )
    return (
        f'<p class="cost">{text(cost_sentence(cost))}</p>'
        '<div class="card bom scroll"><table><thead><tr><th class="num">Quantity</th><th>Part</th>'
        '<th>Material</th><th>Process</th><th class="num">Mass, g</th>'
        f'<th class="num">{text(cost.currency)}</th><th>Note</th></tr></thead>'
        f"<tbody>{lines}</tbody></table></div>{_makers(rows)}"
    )


def _total(row: BomLine) -> str:
    return "" if row.price is None else f"{row.price.total:.2f}"


def _makers(rows: tuple[BomLine, ...]) -> str:
    """Manufacturer, order number, supplier and origin of the price of each line, folded."""
    lines = "".join(
        f"<tr><td>{text(row.name)}</td><td>{text(maker)}</td><td>{text(part)}</td>"
        f"<td>{text(supplier)}</td><td>{text(price_source(row))}</td></tr>"
        for row in rows
        for maker, part, supplier in (
            (row.manufacturer, row.part_number, "")
            if row.price is None
            else (row.price.manufacturer, row.price.part_number, row.price.supplier),
        )
    )
    return (
        '<details class="card bom scroll"><summary>Makers, order numbers, suppliers, and where the '
        "prices come from</summary><table><thead><tr><th>Part</th><th>Manufacturer</th>"
        "<th>Part number</th><th>Supplier</th><th>Price</th></tr></thead>"
        f"<tbody>{lines}</tbody></table></details>"
    )


def notes(rows: tuple[Note, ...]) -> str:
    """Show each note under its own heading."""
    body = "".join(
        f'<div class="note"><h3>{text(note.title)}</h3><p>{text(note.text)}</p></div>'
        for note in rows
    )
    return f'<div class="card">{body}</div>'


def spec(source: str, digest: str) -> str:
    """Show the spec as it was read, with line numbers."""
    lines = "".join(f"<span>{text(line)}</span>" for line in source.splitlines())
    return (
        '<details class="card spec"><summary>The YAML this finger was made from, '
        f'<span class="soft">hash <code>{text(digest[:16])}</code></span></summary>'
        f"<pre>{lines}</pre></details>"
    )
