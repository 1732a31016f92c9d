"""Errors of the stiffness side: every one says what is wrong, the limit and what to do."""

from __future__ import annotations

from gelslim_core.errors import GelslimError


class IfemError(GelslimError, ValueError):
    """Base of every refusal in this package; its message is fit to show to a user."""


class MaterialError(IfemError):
    """A material constant outside the range linear elasticity allows."""


class OutlineError(IfemError):
    """An outline that does not bound a plane area."""


class MeshError(IfemError):
    """A pad that cannot be meshed as asked."""


class InterpolationError(IfemError):
    """Marker positions that carry no displacement field."""


class BundleError(IfemError):
    """A bundle that cannot be written, read or trusted.

    Attributes:
        file: name of the offending file inside the bundle (or the bundle's own path).
        reason: what is wrong with it.
        remedy: what the user should do.
    """

    def __init__(self, file: str, reason: str, remedy: str) -> None:
        super().__init__(f"{file}: {reason}; {remedy}")
        self.file = file
        self.reason = reason
        self.remedy = remedy

    def __reduce__(self) -> tuple[type[BundleError], tuple[str, str, str]]:
        """Pickle by its three parts, so that it crosses process boundaries."""
        return (type(self), (self.file, self.reason, self.remedy))
