"""One way to compute something: what it errs and how long it takes."""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_core.budget.budget import shown_share, shown_time


@dataclass(frozen=True)
class Rung:
    """One way.

    `work` orders the rungs of a ladder by cost and is counted, not timed: bytes gone through,
    rays, predicted operations. So it is the same on every machine and in every run.
    """

    name: str
    error: float
    """Relative."""
    time_ms: float
    work: float
    measured: bool = True
    """Whether error and time were measured; False where a law carries them on from others."""

    def __str__(self) -> str:
        return f"{self.name} ({shown_share(self.error)}, {shown_time(self.time_ms)})"
