"""Errors of the mesh, the stiffness and the bundle. Each message names the fault and the remedy."""

from __future__ import annotations

from typing import Any

from gelslim_core.errors import GelslimError


class IfemError(GelslimError, ValueError):
    """Base of every error that this package raises for input it cannot use.

    Attributes:
        field: Name of the argument, array or setting at fault; empty where no single one is.
        value: The value at fault, or None.
    """

    def __init__(self, message: str = "", *, field: str = "", value: Any = None) -> None:
        super().__init__(message)
        self.field = field
        self.value = value

    def to_dict(self) -> dict[str, Any]:
        """The error for programs; with `field` where one argument or setting is at fault."""
        return {**super().to_dict(), **({"field": self.field} if self.field else {})}


class MaterialError(IfemError):
    """A material constant outside the range of linear elasticity."""


class OutlineError(IfemError):
    """An outline or outer surface with impossible dimensions."""


class MeshError(IfemError):
    """A pad that cannot be meshed or computed as requested."""


class MarkerGridError(IfemError):
    """A marker grid that cannot be made or whose arrays do not agree."""


class InterpolationError(IfemError):
    """Marker positions or values that do not determine a displacement field."""


class BundleError(IfemError):
    """A bundle that cannot be written, read or trusted.

    Attributes:
        file: Name of the file at fault inside the bundle, or the path of the bundle itself.
        reason: What is wrong with it.
        remedy: What the user should do.
    """

    def __init__(self, file: str, reason: str, remedy: str) -> None:
        super().__init__(f"{file}: {reason}; {remedy}")
        self.file = file
        self.reason = reason
        self.remedy = remedy

    def __reduce__(self) -> tuple[type[BundleError], tuple[str, str, str]]:
        """Pickle the three parts, because the message alone cannot make the error again."""
        return (type(self), (self.file, self.reason, self.remedy))

    def to_dict(self) -> dict[str, Any]:
        """The error for programs, with `file`, `reason` and `remedy`."""
        parts = {"file": self.file, "reason": self.reason, "remedy": self.remedy}
        return {**super().to_dict(), **parts}
