"""Design rules: value, limit, margin, reason, and the parameter to change."""

from gelslim_cad.checks.apply import check, check_batch, margins_batch
from gelslim_cad.checks.gelslim1 import GelSlim1Fold, gelslim1_closed_form, gelslim1_length_mm
from gelslim_cad.checks.rule import RULES, Check, Checks, Finding

__all__ = [
    "RULES",
    "Check",
    "Checks",
    "Finding",
    "GelSlim1Fold",
    "check",
    "check_batch",
    "gelslim1_closed_form",
    "gelslim1_length_mm",
    "margins_batch",
]
