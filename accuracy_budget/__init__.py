"""What accuracy costs in time: a budget, ladders of measured rungs, the times of this machine."""

from accuracy_budget.budget import Budget
from accuracy_budget.errors import BudgetError

__all__ = ["Budget", "BudgetError"]
