"""Refusal of a contact that was not found."""

from __future__ import annotations

from ifem_export.errors import IfemError


class ContactError(IfemError):
    """No contact within the tolerance; the message says how far it got and what to try.

    Attributes:
        residual: the best reached, relative to the forces; NaN where it does not apply.
    """

    def __init__(self, message: str, residual: float = float("nan")) -> None:
        super().__init__(message)
        self.residual = residual

    def __reduce__(self) -> tuple[type[ContactError], tuple[str, float]]:
        """Pickle by its parts, so that it crosses process boundaries."""
        return (type(self), (str(self), self.residual))
