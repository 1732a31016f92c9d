"""Libraries that only some tasks need; they are imported when such a task begins."""

from __future__ import annotations

import importlib
from typing import Any

from gelslim_core.errors import GelslimError
from gelslim_core.extras import extra_of, install_command


class MissingLibraryError(GelslimError, ImportError):
    """A task needs a library that is not installed or cannot be loaded.

    Attributes:
        name: The package that is missing.
        extra: The extra of gelslim-cad that brings it.
    """

    def __init__(self, purpose: str, module: str, error: ImportError) -> None:
        name = module.partition(".")[0]
        self.extra = extra_of(name)
        super().__init__(
            f"{purpose} needs the Python package {name!r} ({error}); "
            f"install it with: {install_command(self.extra)}"
        )
        self.name = name


def load(module: str, purpose: str) -> Any:
    """Import an optional module.

    Args:
        module: Name of the module, such as "pyarrow.parquet".
        purpose: What needs it; the message begins with this.

    Returns:
        The module.

    Raises:
        MissingLibraryError: The module cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingLibraryError(purpose, module, error) from error
