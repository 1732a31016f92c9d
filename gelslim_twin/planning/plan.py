"""A plan: which effects the simulation of a scene includes, how finely, and why."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from gelslim_twin.effects.effect import Bound, combined, unit_of

FORMAT = "gelslim-plan/2"
TITLES = ("effect", "", "if left out", "found by", "rung", "ms", "why")


@dataclass(frozen=True)
class Choice:
    """Whether one effect is simulated, how finely, and why."""

    effect: str
    included: bool
    why: str
    size: Bound
    """Error of leaving it out: what a probe found with a safety factor, or else its bound."""
    shares: tuple[tuple[str, float], ...]
    """Per observable, the share of the tolerance that the effect may use up. It is empty where
    nothing observed depends on the effect."""
    error: Bound
    """Its size where it is left out, the error of its rung where it is simulated."""
    probed: bool = False
    """Whether a probe found the size."""
    formula: str = ""
    rung: str = ""
    rung_parameters: tuple[tuple[str, Any], ...] = ()
    predicted_ms: float = 0.0
    """Per pose."""
    implementation: str = ""
    """Module to import; empty where left out."""
    saved_ms: float = 0.0
    """Per pose, what it would take by its cheapest sufficient rung, where it is left out."""
    is_scattered: bool = False
    """Whether its error adds to that of others as `combined` says of scattered ones."""

    @property
    def spent_ms(self) -> float:
        """Milliseconds per pose that it takes, negative where leaving it out saves them."""
        return self.predicted_ms if self.included else -self.saved_ms

    @property
    def found_by(self) -> str:
        """How its size was found: `probe` or `bound`."""
        return "probe" if self.probed else "bound"

    @property
    def over_share(self) -> tuple[str, ...]:
        """Observables whose error by this effect exceeds its share."""
        return tuple(o for o, share in self.shares if self.error.of(o) > share)

    def cells(self) -> tuple[str, ...]:
        """The cells of its row under `TITLES`; saved milliseconds are negative."""
        value, unit = self.most_relevant(self.size)
        return (
            self.effect,
            "in" if self.included else "out",
            f"{value:.3g} {unit}" if value else "0",
            self.found_by if value else "",
            self.rung,
            f"{self.spent_ms:+.3g}" if self.spent_ms else "",
            self.why,
        )

    def most_relevant(self, bound: Bound) -> tuple[float, str]:
        """The value of `bound` that is largest relative to its share, with its unit, N or px."""
        if not self.shares:
            value = bound.force_n
            pixels = max(bound.displacement_px, bound.markers_px, bound.image_px)
            return (value, "N") if value > 0 and pixels == 0 else (pixels, "px")
        observable, _ = max(self.shares, key=lambda pair: bound.of(pair[0]) / (pair[1] or 1.0))
        return bound.of(observable), "N" if unit_of(observable) == "n" else "px"

    def to_record(self) -> dict[str, Any]:
        """The values as they are written to JSON."""
        return {
            "effect": self.effect,
            "included": self.included,
            "why": self.why,
            "size": self.size.to_record(),
            "found_by": self.found_by,
            "formula": self.formula,
            "share": dict(self.shares),
            "error": self.error.to_record(),
            "rung": self.rung,
            "rung_parameters": dict(self.rung_parameters),
            "predicted_ms": self.predicted_ms,
            "saved_ms": self.saved_ms,
            "implementation": self.implementation,
        }


def summed_error(choices: Iterable[Choice], observable: str) -> float:
    """The errors of those choices on which something observed depends, combined, in N or px."""
    return combined((c.error.of(observable), c.is_scattered) for c in choices if c.shares)


@dataclass(frozen=True)
class Plan:
    """The choice for every effect, and the order in which those included are applied.

    Attributes:
        scene: Name of the scene.
        observe: Observables that the scene asks for.
        force_n: Tolerance of forces in N.
        image_px: Tolerance of displacements, markers and pictures in px.
        choices: One entry per effect.
        order: Names of the included effects, in the order of application.
        poses: Number of poses.
        probe_ms: Predicted time of the probe, 0 where there was none.
    """

    scene: str
    observe: tuple[str, ...]
    force_n: float
    image_px: float
    choices: tuple[Choice, ...]
    order: tuple[str, ...]
    poses: int
    probe_ms: float = 0.0

    @property
    def included(self) -> tuple[Choice, ...]:
        """The effects that are simulated, in order."""
        by_name = {choice.effect: choice for choice in self.choices}
        return tuple(by_name[name] for name in self.order)

    def choice(self, effect: str) -> Choice:
        """The choice about one effect. Raises KeyError."""
        for choice in self.choices:
            if choice.effect == effect:
                return choice
        raise KeyError(effect)

    @property
    def predicted_ms(self) -> float:
        """Per pose."""
        return sum(choice.predicted_ms for choice in self.included)

    def error(self, observable: str) -> float:
        """The errors of all effects in one observable, combined, in N or px."""
        return summed_error(self.choices, observable)

    @property
    def over_tolerance(self) -> tuple[tuple[str, float], ...]:
        """Observables whose combined error exceeds the tolerance, with that error."""
        allowed = {o: self.force_n if unit_of(o) == "n" else self.image_px for o in self.observe}
        # The shares add up to the tolerance but for rounding.
        return tuple(
            (o, self.error(o)) for o in self.observe if self.error(o) > allowed[o] * (1 + 1e-12)
        )

    def to_record(self) -> dict[str, Any]:
        """The values as they are written to JSON."""
        return {
            "format": FORMAT,
            "scene": self.scene,
            "observe": list(self.observe),
            "tolerance": {"force_n": self.force_n, "image_px": self.image_px},
            "poses": self.poses,
            "order": list(self.order),
            "predicted_ms_per_pose": self.predicted_ms,
            "probe_ms": self.probe_ms,
            "error": {f"{o}_{unit_of(o)}": self.error(o) for o in self.observe},
            "over_tolerance": [o for o, _ in self.over_tolerance],
            "effects": [choice.to_record() for choice in self.choices],
        }

    def to_json(self) -> str:
        """The record as JSON text; equal plans give equal bytes."""
        return self._json

    @cached_property
    def _json(self) -> str:
        return json.dumps(self.to_record(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    def __str__(self) -> str:
        """A table as text."""
        rows = [TITLES, *(choice.cells() for choice in self.choices)]
        widths = [max(len(row[k]) for row in rows) for k in range(len(TITLES) - 1)]
        lines = [
            "  ".join(cell.ljust(w) for cell, w in zip(row[:-1], widths, strict=True))
            + f"  {row[-1]}"
            for row in rows
        ]
        return "\n".join([*lines, self.time_text()])

    def time_text(self) -> str:
        """The time predicted of a pose, of all poses and of the probe."""
        text = (
            f"{self.predicted_ms:.3g} ms per pose, {self.poses} poses: "
            f"{self.predicted_ms * self.poses / 1000:.3g} s"
        )
        return f"{text}; probe {self.probe_ms / 1000:.2g} s" if self.probe_ms else text
