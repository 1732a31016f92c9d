"""What a twin is asked for: observables, and the errors allowed in them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from numbers import Real

import numpy as np

from gelslim_core.budget.budget import BudgetError, parse_share
from gelslim_core.yaml.suggest import closest
from gelslim_twin.effects.contact import MOST_FORCE, RUNGS
from gelslim_twin.effects.effect import OBSERVABLES
from gelslim_twin.stepping.step_error import StepError

FORCE_SHARE, IMAGE_PX = 0.02, 0.2
"""Errors allowed where none are given: of forces relative to their resultant, and in px."""
OVERESTIMATE = 2.0
"""Largest ratio of the estimated normal force to the solved one (`contact_estimate`)."""


@dataclass(frozen=True)
class Request:
    """What is observed, and how exactly.

    Attributes:
        observe: Observables, of `displacement`, `force`, `markers` and `image`.
        force_share: Error allowed of the resultant force, relative to it.
        image_px: Error allowed of markers and pictures.
    """

    observe: tuple[str, ...] = ("force",)
    force_share: float = FORCE_SHARE
    image_px: float = IMAGE_PX

    @classmethod
    def read(
        cls, observe: Iterable[str], tolerance: Mapping[str, str | float] | None = None
    ) -> Request:
        """Read what a caller asks for.

        Args:
            observe: Names of observables.
            tolerance: Error allowed per observable: of `force` relative to the resultant, as "2%"
                or 0.02; of the others in pixels, as 0.2 or "0.2px".

        Raises:
            StepError: A name is unknown or given twice, or an error is no number above 0.
        """
        names = (observe,) if isinstance(observe, str) else tuple(observe)
        for number, name in enumerate(names):
            _require_known("observe", name)
            if name in names[:number]:
                raise StepError(f"observe: {name} is listed twice; delete one")
        if not names:
            raise StepError(f"observe is empty; name one of {', '.join(OBSERVABLES)}")
        given = dict(tolerance or {})
        for name in given:
            _require_known("tolerance", name)
        share = _share(given.pop("force", FORCE_SHARE))
        pixels = [_pixels(name, value) for name, value in given.items()]
        return cls(names, share, min(pixels, default=IMAGE_PX))

    @property
    def solver_tolerance(self) -> float:
        """Tolerance of the contact: the largest whose error is below half of that allowed.

        The other half is left to the law of the gel.
        """
        for _, tolerance in RUNGS:
            if OVERESTIMATE * MOST_FORCE * tolerance**0.5 <= self.force_share / 2:
                return tolerance
        return RUNGS[-1][1]

    @property
    def seen(self) -> tuple[str, ...]:
        """The observables that a camera sees."""
        return tuple(name for name in self.observe if name in ("markers", "image"))

    def require_seen(self, what: str) -> None:
        """Raise StepError unless `markers` or `image`, whichever is asked for, are observed."""
        if what not in self.observe and "image" not in self.observe:
            seen = ", ".join(f'"{name}"' for name in (*self.observe, what))
            raise StepError(f"{what} are not observed by this twin; make it with observe=({seen})")


def _require_known(where: str, name: object) -> None:
    if name not in OBSERVABLES:
        near = closest(str(name), list(OBSERVABLES))
        hint = f"did you mean {near}?" if near else f"choose from {', '.join(OBSERVABLES)}"
        raise StepError(f"{where}: {name!r} is unknown; {hint}")


def _share(value: object) -> float:
    try:
        return parse_share(value if isinstance(value, str) else repr(_positive("force", value)))
    except BudgetError as error:
        raise StepError(f"tolerance of force: {error}") from None


def _pixels(name: str, value: object) -> float:
    if isinstance(value, str):
        try:
            return _positive(name, float(value.strip().removesuffix("px")))
        except ValueError:
            raise StepError(f"tolerance of {name}: {value!r}; give pixels, as 0.2px") from None
    return _positive(name, value)


def _positive(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise StepError(f"tolerance of {name}: {value!r} is not a number")
    found = float(value)
    if not (np.isfinite(found) and found > 0):
        raise StepError(f"tolerance of {name}: {found:g} must be above 0")
    return found
