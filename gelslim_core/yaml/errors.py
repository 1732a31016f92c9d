"""What is wrong with an input file, in terms its author can act on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from gelslim_core.errors import GelslimError

MAX_SHOWN = 60
"""Characters of a value or key that a message quotes before it is shortened."""

MAX_PROBLEMS = 100
"""Problems listed one by one; further ones are only counted."""


def shown(text: str, limit: int = MAX_SHOWN) -> str:
    """`text` safe for a terminal: one line, control characters escaped, long text shortened."""
    head = text[: limit + 1]
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in head)
    if len(text) <= limit and len(safe) <= 2 * limit:
        return safe
    return f"{safe[:limit]}... ({len(text)} characters)"


@dataclass(frozen=True)
class Problem:
    """One fault of an input file: where it is, what is wrong, and what to do about it.

    Attributes:
        path: The file, as the caller named it.
        line: Line in the file, counted from 1; None where the file has no line to show.
        column: Column in that line, counted from 1.
        field: Dotted path of the field, such as `design.gel.length_mm`; empty where the problem
            concerns the whole file.
        value: The value as the file has it, shortened; None where there is none.
        message: What is wrong, with the limit and its unit.
        remedy: What to do.
    """

    path: str
    line: int | None
    column: int | None
    field: str
    value: str | None
    message: str
    remedy: str

    def __str__(self) -> str:
        where = shown(self.path, 400) + ("" if self.line is None else f":{self.line}")
        what = self.field
        if self.value is not None:
            what = f"{what} = {self.value}" if what else self.value
        parts = ": ".join(part for part in (what, self.message) if part)
        separator = " " if what and self.line is not None else ": "
        return f"{where}{separator}{parts}" + (f"; {self.remedy}" if self.remedy else "")


class InputError(GelslimError):
    """An input file was refused. `str()` prints one problem per line, in file order.

    Attributes:
        problems: At least one problem.
        omitted: Number of further problems of the file that are not listed.
    """

    def __init__(self, problems: tuple[Problem, ...], omitted: int = 0) -> None:
        if not problems:
            raise ValueError("an InputError needs at least one problem")
        super().__init__(problems, omitted)
        self.problems = problems
        self.omitted = omitted

    def __str__(self) -> str:
        lines = [str(problem) for problem in self.problems]
        if self.omitted:
            path = shown(self.problems[0].path, 400)
            lines.append(f"{path}: and {self.omitted} more problems; fix these first")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """The error for programs.

        Returns:
            `{"error": "bad input", "problems": [...], "omitted": 0}`; each problem is a mapping
            with the attributes of `Problem`.
        """
        return {
            "error": self.kind,
            "problems": [asdict(problem) for problem in self.problems],
            "omitted": self.omitted,
        }


def listed(problems: Iterable[Problem], uncounted: int = 0) -> InputError:
    """The error with the first `MAX_PROBLEMS` of `problems` in file order; the rest are counted.

    `uncounted` is the number of further problems for which no `Problem` was made.
    """
    ordered = sorted(problems, key=lambda problem: (problem.line or 0, problem.column or 0))
    omitted = uncounted + max(0, len(ordered) - MAX_PROBLEMS)
    return InputError(tuple(ordered[:MAX_PROBLEMS]), omitted)


class FieldError(ValueError):
    """Raised by the validator of a model to refuse the value of one field.

    Attributes:
        field: Path of the field below the model that is validated, such as
            `youngs_modulus_mpa` or `gel.thickness_mm`; empty for the model itself.
        message: What is wrong, with the limit.
        remedy: What to do.
        related: Further fields that the rule is about. The problem points at the first of
            `field` and `related` that the file gives.
    """

    def __init__(
        self, field: str, message: str, remedy: str = "", related: tuple[str, ...] = ()
    ) -> None:
        super().__init__(f"{field}: {message}" if field else message)
        self.field = field
        self.message = message
        self.remedy = remedy
        self.related = related
