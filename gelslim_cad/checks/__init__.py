"""Design rules: value, limit, margin, reason, and the parameter to change."""

from gelslim_cad.checks.apply import check, check_batch
from gelslim_cad.checks.rule import RULES, Check, Finding

__all__ = ["RULES", "Check", "Finding", "check", "check_batch"]
