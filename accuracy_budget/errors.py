"""Refusals about budgets; every message says what is wrong and what is nearest to it."""


class BudgetError(ValueError):
    """A budget that cannot be read, or that no rung keeps."""
