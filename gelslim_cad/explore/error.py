"""What is wrong with a request to explore."""

from __future__ import annotations

from gelslim_core.errors import GelslimError


class ExploreError(GelslimError, ValueError):
    """The space cannot be explored as asked; the message says what, why and what to do."""
