"""Proofs of written files: each is read back by other code and compared with its part."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ProofResult:
    """One check of one file: the measured value, the limit it must keep, and the verdict."""

    file: str
    check: str
    value: float
    limit: float
    ok: bool
    detail: str = ""


def at_most(file: str, check: str, value: float, limit: float, detail: str = "") -> ProofResult:
    """A check that `value` does not exceed `limit`; NaN fails."""
    return ProofResult(file, check, float(value), float(limit), bool(value <= limit), detail)


def equal(file: str, check: str, value: float, expected: float, detail: str = "") -> ProofResult:
    """A check that `value` is exactly `expected`, for counts and truths."""
    return ProofResult(file, check, float(value), float(expected), value == expected, detail)


def unreadable(path: Path, error: Exception) -> list[ProofResult]:
    """The result of a file that its reader refuses."""
    return [equal(path.name, "readable", False, True, f"{type(error).__name__}: {error}")]
