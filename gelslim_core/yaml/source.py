"""The bytes of an input file as checked text."""

from __future__ import annotations

import codecs
import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from gelslim_core.yaml.errors import InputError, Problem, shown

MAX_BYTES = 1_000_000
MAX_LINE = 20_000
"""Characters in a line; longer lines slow the parser down and no input file needs them."""

_WIDE_MARKS = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}
_UNPRINTABLE = re.compile(
    "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
_LONG_LINE = re.compile(rf"[^\r\n]{{{MAX_LINE + 1}}}")
_LINE_BREAK = re.compile(r"\r\n|\n|\r")
_SAVE_UTF8 = "save the file as UTF-8"


class Position(NamedTuple):
    """A place in a text file; line and column are counted from 1."""

    line: int
    column: int


@dataclass(frozen=True)
class Source:
    """The text of an input file."""

    path: str
    """As the caller named it."""
    text: str
    sha256: str
    """Of the file's bytes, in hexadecimal."""


def refusal(
    path: str, message: str, remedy: str, position: Position | None = None, value: str | None = None
) -> InputError:
    """An `InputError` about the file as a whole."""
    line, column = position or (None, None)
    return InputError((Problem(path, line, column, "", value, message, remedy),))


def read_source(path: str | os.PathLike[str], max_bytes: int = MAX_BYTES) -> Source:
    """The text of the UTF-8 file at `path`; at most `max_bytes` are read.

    Raises `InputError` where the file cannot be read, is too long or is not UTF-8 text.
    """
    name = os.fspath(path)
    try:
        with Path(name).open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except FileNotFoundError:
        raise refusal(name, "no such file", "check the path") from None
    except IsADirectoryError:
        raise refusal(name, "is a directory", "name a file in it") from None
    except PermissionError:
        raise refusal(name, "may not be read", "give yourself permission to read it") from None
    except OSError as error:
        reason = (error.strerror or type(error).__name__).lower()
        raise refusal(name, f"cannot be read ({reason})", "check the path") from None
    except ValueError:
        raise refusal(name, "is not a valid file name", "check the path") from None
    return decode_source(name, data, max_bytes)


def decode_source(name: str, data: bytes, max_bytes: int = MAX_BYTES) -> Source:
    """`data` as text: UTF-8, printable, at most `max_bytes` long, no line above `MAX_LINE`.

    Raises `InputError`.
    """
    if len(data) > max_bytes:
        limit = f"larger than {max_bytes / 1e6:g} MB, the limit for such a file"
        raise refusal(name, limit, "check that this is the right file")
    for mark, encoding in _WIDE_MARKS.items():
        if data.startswith(mark):
            raise refusal(name, f"is {encoding} text, not UTF-8", _SAVE_UTF8, Position(1, 1))
    try:
        text = data.removeprefix(codecs.BOM_UTF8).decode("utf-8")
    except UnicodeDecodeError as error:
        offset = error.start + (len(codecs.BOM_UTF8) if data.startswith(codecs.BOM_UTF8) else 0)
        before = data[:offset].decode("utf-8", "replace")
        message = f"is not UTF-8 text: byte 0x{data[offset]:02x} at byte offset {offset}"
        raise refusal(name, message, _SAVE_UTF8, _position(before, len(before))) from None
    if found := _UNPRINTABLE.search(text):
        message = f"holds the control character U+{ord(found.group()):04X}"
        remedy = f"{_SAVE_UTF8} (it looks like UTF-16)" if found.group() == "\0" else "delete it"
        raise refusal(name, message, remedy, _position(text, found.start()))
    if found := _LONG_LINE.search(text):
        message, place = f"has a line of more than {MAX_LINE} characters", found.start()
        value = shown(found.group(), 20)
        raise refusal(name, message, "break the line", _position(text, place), value)
    return Source(name, text, hashlib.sha256(data).hexdigest())


def _position(text: str, offset: int) -> Position:
    breaks = [found.end() for found in _LINE_BREAK.finditer(text, 0, offset)]
    return Position(len(breaks) + 1, offset - (breaks[-1] if breaks else 0) + 1)
