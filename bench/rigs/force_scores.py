"""Scores of many contacts as the files of docs/data keep them: in mN, in four digits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


def recorded(scores: Iterable[Mapping[str, Any]], names: tuple[str, ...]) -> dict[str, Any]:
    """Number of contacts without a force, and values of the others.

    Args:
        scores: Fields of `Score` of tests/force/sigma_gate.py, forces in N; `error_n` is empty
            where no force was given.
        names: Fields without their unit, such as `error`.

    Returns:
        `refused`, and for each name `NAME_mn` with three values for each contact.
    """
    every = list(scores)
    given = [score for score in every if score["error_n"]]
    values = {
        f"{name}_mn": [[four_digits(1000 * one) for one in score[f"{name}_n"]] for score in given]
        for name in names
    }
    return {"refused": len(every) - len(given), **values}


def four_digits(value: float) -> float:
    """A value rounded to four digits."""
    return float(f"{value:.4g}")
