"""Public names of a package that load their module when they are first used (PEP 562)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any


def lazy_exports(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Make the `__getattr__` and `__dir__` of a package.

    The package imports its public names under `if TYPE_CHECKING:`, where type checkers read them.
    These lines never run; the functions read from them which module defines a name.

    Args:
        package: Name of the package, its `__name__`.

    Returns:
        The two functions, to be bound to these names in the package's `__init__`.
    """

    def get(name: str) -> Any:
        if name not in _defining_modules(package):
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(_defining_modules(package)[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *_defining_modules(package)})

    return get, names


@cache
def _defining_modules(package: str) -> Mapping[str, str]:
    """Module by name, from the imports inside an `if` at the top level of the package."""
    import ast

    loader: Any = sys.modules[package].__loader__
    return {
        imported.name: line.module
        for block in ast.parse(loader.get_source(package)).body
        if isinstance(block, ast.If)
        for line in block.body
        if isinstance(line, ast.ImportFrom) and line.module
        for imported in line.names
    }
