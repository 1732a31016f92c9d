"""The report's sections that are lists: dimensions, files, bill of materials, notes, spec."""

from __future__ import annotations

import re

from gelslim_cad.report.data import BomLine, DimensionRow, FileRow, Note, Scalar
from gelslim_cad.report.markup import anchor, href, number, size, text, with_unit


def dimensions(rows: tuple[DimensionRow, ...]) -> str:
    """List the dimensions by group; each row unfolds to its formula with numbers and source."""
    if not rows:
        return '<p class="card empty">No dimensions were given.</p>'
    known = {row.name for row in rows}
    groups = list(dict.fromkeys(row.group for row in rows))
    options = "".join(f'<option value="{text(name)}">{text(name)}</option>' for name in groups)
    blocks = []
    for group in groups:
        body = "".join(_dimension(row, known) for row in rows if row.group == group)
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


def _dimension(row: DimensionRow, known: set[str]) -> str:
    value = with_unit(row.value, row.unit)
    steps = [f'<p class="chain"><code>{text(row.name)} = {text(row.formula)}</code></p>']
    filled = substituted(row.formula, row.inputs)
    if filled != row.formula:
        steps.append(f'<p class="chain"><code>= {text(filled)}</code></p>')
    steps.append(f'<p class="chain"><code>= {value}</code></p>')
    if row.inputs:
        chips = "".join(f"<li>{_input(name, given, known)}</li>" for name, given in row.inputs)
        steps.append(f'<ul class="inputs" aria-label="Inputs">{chips}</ul>')
    if row.source:
        steps.append(f'<p class="chain soft">Source: {text(row.source)}</p>')
    return (
        f'<details class="dimension" id="{anchor("dim", row.name)}">'
        f'<summary><code class="name">{text(row.name)}</code><span class="value">{value}</span>'
        f'<code class="formula">{text(row.formula)}</code></summary>'
        f'<div class="body">{"".join(steps)}</div></details>'
    )


def _input(name: str, value: Scalar, known: set[str]) -> str:
    label = f"<code>{text(name)}</code>"
    if name in known:
        label = f'<a href="#{anchor("dim", name)}">{label}</a>'
    return f"{label} = {text(number(value))}"


def substituted(formula: str, inputs: tuple[tuple[str, Scalar], ...]) -> str:
    """Put the inputs' numbers in place of their names, whole names only, longest name first.

    An input called `camera.focal_length_mm` is also found as `focal_length_mm` where that last
    part is not shared by another input.
    """
    values: dict[str, str] = {}
    short = [name.rsplit(".", 1)[-1] for name, _ in inputs]
    for (name, value), last in zip(inputs, short, strict=True):
        if isinstance(value, str) or value is None:
            continue
        values[name] = number(value)
        if short.count(last) == 1:
            values.setdefault(last, number(value))
    if not values:
        return formula
    names = "|".join(re.escape(name) for name in sorted(values, key=lambda n: (-len(n), n)))
    pattern = re.compile(rf"(?<![\w.])(?:{names})(?![\w(]|\.\w)")
    return pattern.sub(lambda found: values[found.group()], formula)


def files(rows: tuple[FileRow, ...]) -> str:
    """List the files by folder with size and sha256; links are relative to the report."""
    if not rows:
        return '<p class="card empty">No files were written beside this report.</p>'
    ordered = sorted(rows, key=lambda row: (row.path.count("/") > 0, row.path))
    folder = ""
    lines = []
    for row in ordered:
        here, _, base = row.path.rpartition("/")
        if here != folder:
            folder = here
            lines.append(
                f'<tr class="folder"><th colspan="4" scope="rowgroup">{text(here)}/</th></tr>'
            )
        lines.append(
            f'<tr><td><a href="{href(row.path)}">{text(base)}</a></td><td>{text(row.purpose)}</td>'
            f'<td class="num">{size(row.size_bytes)}</td>'
            f'<td class="hash mono" title="{text(row.sha256)}">{text(row.sha256)}</td></tr>'
        )
    return (
        '<div class="card files scroll"><table><thead><tr><th>File</th><th>For</th>'
        '<th class="num">Size</th><th>sha256</th></tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def bom(rows: tuple[BomLine, ...]) -> str:
    """List what to make and to buy."""
    if not rows:
        return '<p class="card empty">No bill of materials was given.</p>'
    lines = "".join(
        f'<tr><td class="num">{row.quantity}</td><td>{text(row.name)}'
        f"{' (tooling)' if row.tooling else ''}</td>"
        f"<td>{text(row.material)}</td><td>{text(row.process)}</td>"
        f'<td class="num">{text(number(row.mass_g, 3))}</td><td>{text(row.note)}</td></tr>'
        for row in rows
    )
    return (
        '<div class="card bom scroll"><table><thead><tr><th class="num">Quantity</th><th>Part</th>'
        '<th>Material</th><th>Process</th><th class="num">Mass, g</th><th>Note</th></tr></thead>'
        f"<tbody>{lines}</tbody></table></div>"
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
