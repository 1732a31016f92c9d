"""The state that all open pages show, and how they are told of a change."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Board:
    """The latest state, shared between the thread that changes it and those of the pages.

    Attributes:
        state: What the pages show, as plain data.
        version: Counts the changes.
        glb: The latest solids, and the number of the design that they are of.
    """

    state: dict[str, Any] = field(default_factory=dict)
    version: int = 0
    glb: tuple[int, bytes] | None = None
    closed: bool = False
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def show(self, glb: tuple[int, bytes] | None = None, **changes: Any) -> None:
        """Change some entries of the state, and the solids where they are given."""
        with self._changed:
            self.state = {**self.state, **changes}
            self.glb = glb or self.glb
            self.version += 1
            self._changed.notify_all()

    def next(self, seen: int, wait_s: float) -> tuple[int, dict[str, Any]] | None:
        """The version and the state once they are newer than `seen`; None after `wait_s`."""
        with self._changed:
            self._changed.wait_for(lambda: self.closed or self.version > seen, wait_s)
            return (self.version, self.state) if self.version > seen else None

    def close(self) -> None:
        """Wake all who wait: there will be no more changes."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()
