"""Syntax errors of YAML in words that say what to change."""

from __future__ import annotations

from typing import Any

from gelslim_core.yaml.errors import Problem, shown
from gelslim_core.yaml.source import Position, Source

_QUOTE = "put the value in quotes"

_SENTENCES: tuple[tuple[str, str, str], ...] = (
    ("'\\t'", "a tab where spaces belong", "replace the tab by spaces"),
    ("'@'", "a value may not begin with @", _QUOTE),
    ("'`'", "a value may not begin with a backquote", _QUOTE),
    ("'%'", "a value may not begin with %", _QUOTE),
    (
        "mapping values are not allowed",
        "a second `:` on the line, or a line indented too far",
        "put the value in quotes or correct the indentation",
    ),
    (
        "could not find expected ':'",
        "a line that is no `name: value`",
        "write `name: value` with a space after the colon",
    ),
    ("unexpected end of stream", "a quote that is opened and never closed", "close the quote"),
    ("expected ',' or ']'", "a `[` that is opened and never closed", "close it with ]"),
    ("expected ',' or '}'", "a `{` that is opened and never closed", "close it with }"),
    (
        "expected <block end>",
        "a line indented differently from its neighbours",
        "line up the fields of a block",
    ),
    ("escape", "an escape sequence that YAML does not know", "use single quotes, or write \\\\"),
    ("expected the node content", "it ends in the middle of a value", "complete the value"),
    ("undefined tag handle", "tags are not read", "delete it"),
    ("duplicate", "an anchor given twice", "delete the anchors"),
)


_BLAME_START = ("end of stream", "stream end", "expected ','", "could not find expected ':'")


def syntax_error(source: Source, error: Exception, last: Position) -> Problem:
    """The parser's complaint as a problem with a line and a remedy.

    A quote or bracket that is never closed is blamed on the line that opens it; a complaint
    without a line on `last`, the place where parsing had arrived.
    """
    reason = str(getattr(error, "problem", None) or "").strip()
    mark: Any = getattr(error, "problem_mark", None)
    opened: Any = getattr(error, "context_mark", None)
    if opened is not None and any(sign in reason for sign in _BLAME_START):
        mark = opened
    message, remedy = "is not valid YAML", "correct the syntax"
    for key, sentence, cure in _SENTENCES:
        if key in reason:
            message, remedy = f"is not valid YAML: {sentence}", cure
            break
    else:
        if reason:
            message = f"is not valid YAML: {shown(reason, 120)}"
    if mark is None:
        mark = opened
    line, column = last if mark is None else (mark.line + 1, mark.column + 1)
    return Problem(source.path, line, column, "", _line_text(source, line), message, remedy)


def _line_text(source: Source, line: int) -> str | None:
    lines = source.text.splitlines()
    if not 1 <= line <= len(lines) or not lines[line - 1].strip():
        return None
    return f"`{shown(lines[line - 1].strip())}`"
