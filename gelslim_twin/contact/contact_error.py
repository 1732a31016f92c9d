"""Error of a contact that did not converge."""

from __future__ import annotations

from ifem_export.errors import IfemError


class ContactError(IfemError):
    """A contact did not converge to the tolerance, or its input is invalid.

    Attributes:
        residual: Smallest residual reached, relative to the forces; NaN where there is none.
    """

    def __init__(self, message: str, residual: float = float("nan")) -> None:
        super().__init__(message)
        self.residual = residual

    def __reduce__(self) -> tuple[type[ContactError], tuple[str, float]]:
        """Parts for pickling, so that worker processes can raise it."""
        return (type(self), (str(self), self.residual))
