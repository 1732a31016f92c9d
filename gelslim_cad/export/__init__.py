"""Writers of CAD and mesh files: the same solid always gives the same bytes."""

from __future__ import annotations


class ExportError(ValueError):
    """A shape cannot be written. The message names the part, the limit and the remedy."""
