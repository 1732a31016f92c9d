"""The error of a twin that is stepped with input that it cannot use."""

from __future__ import annotations

from gelslim_core.errors import GelslimError


class StepError(GelslimError, ValueError):
    """A body, a pose, a time step or a setting cannot be used; the twin keeps its state."""
