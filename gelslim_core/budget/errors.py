"""Refusals about budgets; every message says what is wrong and what is nearest to it."""

from __future__ import annotations

from gelslim_core.errors import GelslimError


class BudgetError(GelslimError, ValueError):
    """A budget that cannot be read, or that no rung keeps."""
