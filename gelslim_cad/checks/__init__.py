"""Design rules: value, limit, margin, reason, and the parameter to change."""

from gelslim_cad.checks.apply import check, margins_batch
from gelslim_cad.checks.rule import RULES, Check, Checks, Finding

__all__ = ["RULES", "Check", "Checks", "Finding", "check", "margins_batch"]
