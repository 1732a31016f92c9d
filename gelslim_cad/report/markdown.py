"""The Markdown of the building instructions as HTML: headings, lists, tables, paragraphs.

Only what BUILD.md uses is understood. Items of lists get a check box each.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

from gelslim_cad.report.markup import text

_ITEM = re.compile(r"^(?:- |\d+\. )(.*)$")
_RULE = re.compile(r"^\|[-|: ]+\|$")


def to_html(markdown: str, key: str) -> str:
    """Turn Markdown into HTML.

    Args:
        markdown: The text; blocks are separated by empty lines.
        key: Beginning of the names of the check boxes, unique on the page.

    Returns:
        HTML, in which all other markup of the text is escaped.
    """
    numbers = itertools.count(1)
    return "\n".join(
        _block(kind, list(lines), key, numbers)
        for block in re.split(r"\n{2,}", markdown.strip())
        for kind, lines in itertools.groupby(block.split("\n"), _kind)
    )


def _kind(line: str) -> str:
    if line.startswith("#"):
        return "heading"
    if line.startswith("|"):
        return "table"
    if _ITEM.match(line):
        return "ordered" if line[0].isdigit() else "list"
    return "paragraph"


def _block(kind: str, lines: list[str], key: str, numbers: Iterator[int]) -> str:
    if kind == "heading":
        return "".join(_heading(line) for line in lines)
    if kind == "table":
        return _table(lines)
    if kind == "paragraph":
        return f"<p>{inline(' '.join(lines))}</p>"
    tag = "ol" if kind == "ordered" else "ul"
    items = "".join(_item(line, f"{key}-{next(numbers)}") for line in lines)
    return f'<{tag} class="todo">{items}</{tag}>'


def _heading(line: str) -> str:
    marks, _, title = line.partition(" ")
    level = min(len(marks), 6)
    return f"<h{level}>{inline(title)}</h{level}>"


def _item(line: str, name: str) -> str:
    found = _ITEM.match(line)
    words = inline(found.group(1) if found else line)
    box = f'<input type="checkbox" data-key="{text(name)}">'
    return f"<li><label>{box} <span>{words}</span></label></li>"


def _table(lines: list[str]) -> str:
    rows = [
        [inline(cell.strip()) for cell in line.strip().strip("|").split("|")]
        for line in lines
        if not _RULE.match(line)
    ]
    head = "".join(f"<th>{cell}</th>" for cell in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{c}</td>" for c in row) + "</tr>" for row in rows[1:])
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def inline(words: str) -> str:
    """Escape text and turn code, bold and italic marks into elements."""
    pieces = words.split("`")
    if len(pieces) % 2 == 0:  # a mark without its end
        pieces = [*pieces[:-2], "`".join(pieces[-2:])]
    return "".join(
        f"<code>{text(piece)}</code>" if k % 2 else _emphasis(text(piece))
        for k, piece in enumerate(pieces)
    )


def _emphasis(escaped: str) -> str:
    bold = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", escaped)
    return re.sub(r"(?<![\w*])\*([^*\s][^*]*)\*(?![\w*])", r"<em>\1</em>", bold)
