"""What an exporter says when it cannot write what it was asked for."""

from __future__ import annotations


class ExportError(ValueError):
    """A shape or part that cannot be written; the message names it, the limit and a remedy."""
