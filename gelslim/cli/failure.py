"""Message and exit status of a command that fails."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Callable
from importlib import metadata
from typing import Any

import typer

from gelslim.cli.answer import BAD_INPUT, FAULT, RULE_FAILED
from gelslim.ending import SAID, asked_to_end
from gelslim_core.errors import GelslimError
from gelslim_core.optional_library import extra_of, install_command

# typer brings its own click from 0.20 on and uses the installed one before: ask typer for it.
_USAGE_ERROR = typer.BadParameter.__mro__[1]
_COMMAND_ERROR = typer.BadParameter.__mro__[2]


class CommandError(GelslimError):
    """A command refuses its arguments or its output folder."""

    def __init__(self, message: str, status: int = BAD_INPUT) -> None:
        super().__init__(message)
        self.exit_status = status
        self.kind = "design rule failed" if status == RULE_FAILED else GelslimError.kind


def explain_failure(error: BaseException, as_json: bool) -> int:
    """Print the message of an error and return the exit status. It never raises an error itself.

    If GELSLIM_DEBUG is set, the traceback of an unexpected error follows.
    """
    if isinstance(error, _USAGE_ERROR) and not as_json:
        _show_usage(error)
        return BAD_INPUT
    status, message = _judge(error)
    if as_json:
        print(_as_json(error, message, status))
    else:
        print(message, file=sys.stderr)
    if status == FAULT and os.environ.get("GELSLIM_DEBUG"):
        traceback.print_exception(error, file=sys.stderr)
    return status


def _show_usage(error: BaseException) -> None:
    text = _first_line(error)
    if text.startswith("Usage:"):
        print(text, file=sys.stderr)
        return
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else "gelslim"
    usage = f"{context.get_usage()}\n" if context is not None else ""
    print(f"{usage}{path}: {text}\nTry `{path} --help`.", file=sys.stderr)


def _first_line(error: BaseException) -> str:
    text: str = error.format_message() if hasattr(error, "format_message") else str(error)
    return text.strip() or type(error).__name__


def _judge(error: BaseException) -> tuple[int, str]:
    """Return exit status and message."""
    name = type(error).__name__
    # Libraries turn Ctrl-C into errors of their own, such as a failed import.
    number = signal.SIGINT if name == "Abort" else asked_to_end(error)
    if number is not None:
        return 128 + number, SAID[signal.Signals(number)][1]
    if isinstance(error, GelslimError):
        return error.exit_status, str(error)
    for kind, answer in _ANSWERS.items():
        if isinstance(error, kind):
            return answer(error)
    return FAULT, (
        f"gelslim: unexpected {name}: {_one_line(str(error))}\n"
        "This is a fault of gelslim and not of your spec. Please report it with the spec; "
        "GELSLIM_DEBUG=1 shows where it happened."
    )


def _missing(error: ImportError) -> tuple[int, str]:
    top = (error.name or "").partition(".")[0]
    extra = extra_of(top)
    if extra and isinstance(error, ModuleNotFoundError):
        return BAD_INPUT, (
            f"gelslim: this command needs {top}, which is not installed; "
            f"run: {install_command(extra)} (`gelslim doctor` lists all extras)"
        )
    if top == "OCP" and "cannot import name" in str(error):
        return BAD_INPUT, (
            f"gelslim: {top} cannot be loaded ({_one_line(str(error))}); another package, such as "
            "build123d, has replaced its files by those of another CAD kernel; "
            f"run: pip install --force-reinstall --no-deps {_kernel()}"
        )
    if extra or ".so" in str(error):
        return BAD_INPUT, (
            f"gelslim: {top or 'a library'} cannot be loaded ({_one_line(str(error))}); "
            "on Debian or Ubuntu: apt-get install libgl1 libx11-6 libxrender1 libegl1"
        )
    return FAULT, f"gelslim: a module is missing ({_one_line(str(error))}); install gelslim again"


def _kernel() -> str:
    """The package of OCP with CadQuery, in its version."""
    name = "cadquery-ocp"
    try:
        return f"{name}=={metadata.version(name)}"
    except metadata.PackageNotFoundError:
        return name


def _os_message(error: OSError) -> str:
    # Our own errors are sentences; those of the system have a file and a reason.
    if error.strerror is None:
        return str(error)
    place = f"{error.filename}: " if error.filename else ""
    return f"{place}{error.strerror.lower()}; check the path, its permissions and free space"


def _one_line(text: str) -> str:
    return " ".join(text.split())[:300]


_ANSWERS: dict[type[BaseException], Callable[[Any], tuple[int, str]]] = {
    _COMMAND_ERROR: lambda error: (BAD_INPUT, f"gelslim: {_first_line(error)}"),
    ImportError: _missing,
    OSError: lambda error: (BAD_INPUT, f"gelslim: {_os_message(error)}"),
    MemoryError: lambda error: (
        BAD_INPUT,
        "gelslim: not enough memory; use fewer mesh cells or fewer --jobs",
    ),
}
"""Errors of other libraries, with the function that gives exit status and message."""


def _as_json(error: BaseException, message: str, status: int) -> str:
    if isinstance(error, GelslimError):
        return json.dumps(error.to_dict(), indent=2)
    kinds = {BAD_INPUT: "bad input"}
    kinds |= {128 + number: kind for number, (kind, _) in SAID.items()}
    return json.dumps({"error": kinds.get(status, "internal error"), "message": message}, indent=2)
