"""Libraries that only some outputs need, loaded when they are."""

from __future__ import annotations

import importlib
from typing import Any

from gelslim_core.extras import install_command
from gelslim_core.files.output_error import OutputError


def load(module: str, extra: str, purpose: str) -> Any:
    """Return an optional module.

    Raises OutputError naming the extra of gelslim-cad that brings it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise OutputError(
            f"{purpose} needs the Python package {module.partition('.')[0]!r} ({error}); "
            f"install it with: {install_command(extra)}"
        ) from error


def available(module: str) -> bool:
    """Whether a module can be imported."""
    try:
        importlib.import_module(module)
    except ImportError:
        return False
    return True
