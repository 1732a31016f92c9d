"""What is wrong with an input file, in terms its author can act on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from gelslim_core.errors import GelslimError

MAX_SHOWN = 60
"""Characters of a value or key that a message quotes before it is shortened."""

MAX_PROBLEMS = 100
"""Problems listed one by one; a file with more is counted, not listed."""


def shown(text: str, limit: int = MAX_SHOWN) -> str:
    """`text` safe for a terminal: one line, control characters escaped, long text shortened."""
    head = text[: limit + 1]
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in head)
    if len(text) <= limit and len(safe) <= 2 * limit:
        return safe
    return f"{safe[:limit]}... ({len(text)} characters)"


@dataclass(frozen=True)
class Problem:
    """One fault of an input file: where, what, and what to do about it."""

    path: str
    """The file, as the caller named it."""
    line: int | None
    """1-based, None where the file has no line to show."""
    column: int | None
    """1-based."""
    field: str
    """Dotted path of the field, empty for the file as a whole."""
    value: str | None
    """The value as written, shortened; None where there is none."""
    message: str
    """What is wrong, with the limit."""
    remedy: str
    """What to do."""

    def __str__(self) -> str:
        where = shown(self.path, 400) + ("" if self.line is None else f":{self.line}")
        what = self.field
        if self.value is not None:
            what = f"{what} = {self.value}" if what else self.value
        # A value or message may end in a mark of its own; the remedy follows a semicolon.
        parts = ": ".join(part for part in (what, self.message) if part)
        sep = " " if what and self.line is not None else ": "
        return f"{where}{sep}{parts}" + (f"; {self.remedy}" if self.remedy else "")


class InputError(GelslimError):
    """An input file was refused. `str()` prints one problem per line, in file order."""

    def __init__(self, problems: tuple[Problem, ...], omitted: int = 0) -> None:
        if not problems:
            raise ValueError("a InputError carries at least one problem")
        super().__init__(problems, omitted)
        self.problems = problems
        self.omitted = omitted
        """How many further problems the file has beyond those listed."""

    def __str__(self) -> str:
        lines = [str(problem) for problem in self.problems]
        if self.omitted:
            path = shown(self.problems[0].path, 400)
            lines.append(f"{path}: and {self.omitted} more problems; fix these first")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The error for programs: `{"error": "bad input", "problems": [...], "omitted": 0}`."""
        return {
            "error": self.kind,
            "problems": [asdict(problem) for problem in self.problems],
            "omitted": self.omitted,
        }


def listed(problems: Iterable[Problem], unread: int = 0) -> InputError:
    """The error with the first `MAX_PROBLEMS` of `problems` in file order; the rest are counted.

    `unread` further problems were never spelt out.
    """
    ordered = sorted(problems, key=lambda problem: (problem.line or 0, problem.column or 0))
    return InputError(tuple(ordered[:MAX_PROBLEMS]), unread + max(0, len(ordered) - MAX_PROBLEMS))


class FieldError(ValueError):
    """Raised by a model validator to blame one field of its model and say what to do.

    `field` is the path of the field below the model that is being validated
    (`youngs_modulus_mpa` or `gel.thickness_mm`), so that the message can name its line.
    """

    def __init__(self, field: str, message: str, remedy: str = "") -> None:
        super().__init__(message)
        self.field = field
        self.message = message
        self.remedy = remedy
