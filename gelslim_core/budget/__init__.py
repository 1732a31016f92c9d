"""What accuracy costs in time: a budget, ladders of measured rungs, the times of this machine."""

from gelslim_core.budget.budget import Budget
from gelslim_core.budget.errors import BudgetError

__all__ = ["Budget", "BudgetError"]
