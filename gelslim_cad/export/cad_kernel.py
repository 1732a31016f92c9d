"""The CAD kernel, loaded at once and in less time than `import cadquery` takes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from gelslim_core.files.held_interrupt import interrupts_held


def load_cad_kernel() -> None:
    """Import cadquery; Ctrl-C takes effect afterwards.

    OCP imports all of VTK only to learn whether it is installed, which takes longer than the rest
    of cadquery's own imports. cadquery itself imports the modules of VTK that it uses.
    """
    with interrupts_held(), _standing_in("vtk"):
        import cadquery  # noqa: F401


@contextmanager
def _standing_in(name: str) -> Iterator[None]:
    """An empty module of this name, unless it is loaded already; afterwards it can be imported."""
    if name in sys.modules:
        yield
        return
    sys.modules[name] = ModuleType(name)
    try:
        yield
    finally:
        del sys.modules[name]
