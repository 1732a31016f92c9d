"""What the other packages build on: errors, budgets, input files, output files and parallel jobs.

Nothing in it knows what a tactile finger is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_core.lazy import lazy_exports

if TYPE_CHECKING:
    from gelslim_core.budget.budget import Budget, BudgetError
    from gelslim_core.budget.ladder import Choice, Ladder, Rung, Wording
    from gelslim_core.errors import GelslimError
    from gelslim_core.jobs import Engine, EngineError
    from gelslim_core.yaml.base import Block
    from gelslim_core.yaml.errors import FieldError, InputError, Problem
    from gelslim_core.yaml.reader import Loaded, read_model
    from gelslim_core.yaml.schema import reference_markdown, schema_text

__version__ = "0.1.0"

__all__ = [
    "Block",
    "Budget",
    "BudgetError",
    "Choice",
    "Engine",
    "EngineError",
    "FieldError",
    "GelslimError",
    "InputError",
    "Ladder",
    "Loaded",
    "Problem",
    "Rung",
    "Wording",
    "__version__",
    "read_model",
    "reference_markdown",
    "schema_text",
]

__getattr__, __dir__ = lazy_exports(__name__)
