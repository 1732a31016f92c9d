"""Comparison of two fingers: their figures and the changes in per cent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.explore.brightness import RAYS, TRACED, Traced, light_columns, trace
from gelslim_cad.explore.force_error import MARKER_NOISE_PX, Patch, PatchError, patch_error
from gelslim_cad.explore.pareto import FIGURES, Figure
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.spec import Spec

SAME = 5e-4
"""Relative change below which a figure is the same: the solver stops near its limits."""
KEPT = 64
"""Number of traced guides and measured patches that are cached for similar fingers."""


@dataclass(frozen=True)
class Measured:
    """A finger's figures by name, None where a broken rule leaves none, and the rules it breaks."""

    figures: Mapping[str, float | None]
    failed: tuple[str, ...]


@dataclass(frozen=True)
class Price:
    """One figure of two fingers."""

    figure: Figure
    before: float | None
    after: float | None

    @property
    def change(self) -> float | None:
        """(after - before) / before; None where one is missing or the first is zero."""
        if self.before is None or self.after is None or self.before == 0:
            return None
        return (self.after - self.before) / self.before

    @property
    def verdict(self) -> str:
        """Whether the second finger is better or worse; empty where neither is, or unknown."""
        change = self.change
        if change is None or abs(change) < SAME or not self.figure.better:
            return ""
        less = change < 0
        if self.figure.better == "one":
            less = abs(math.log(self.after)) < abs(math.log(self.before))  # type: ignore[arg-type]
        return "worse" if less == (self.figure.better == "more") else "better"


def measured(spec: Spec, rays: int = RAYS, noise_px: float = MARKER_NOISE_PX) -> Measured:
    """The figures of one finger, its light traced and its force error measured: a second or two.

    Light and forces are left out where a rule fails, as `explore` does.
    """
    d = derive(spec)
    failed = tuple(c.id for c in check(d) if c.status == "fail")
    found: dict[str, float | None] = dict.fromkeys(f.name for f in FIGURES)
    found |= {n: float(d.values[n]) for n in found if n in d.values}
    found["gel.area_mm2"] = d["design.gel.length_mm"] * d["design.gel.width_mm"]
    found["marker.px"] = float(min(d["view.marker_along_px"], d["view.marker_across_px"]))
    if not d.feasible():
        found |= dict.fromkeys(n for n in found if n.startswith(("view.", "marker.")))
    if not failed:
        found |= _traced_and_pressed(d, rays, noise_px)
    return Measured(found, failed)


def _traced_and_pressed(d: Dimensions, rays: int, noise_px: float) -> dict[str, float]:
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):  # as the tasks of an exploration, so that both say the same
        light = light_columns(d, _lit(tuple(d.value(n) for n in TRACED), rays))
        error = _pressed(Patch.of(d))
    forces = {"force.error": error.total(d, noise_px)} if has_markers(d) else {}
    return {
        **{n: v for n, v in light.items() if n in {f.name for f in FIGURES}},
        **forces,
        "gel.stiffness_n_mm": error.stiffness(d),
    }


@lru_cache(maxsize=KEPT)
def _lit(values: tuple[Any, ...], rays: int) -> Traced:
    return trace(dict(zip(TRACED, values, strict=True)), rays)


@lru_cache(maxsize=KEPT)
def _pressed(patch: Patch) -> PatchError:
    return patch_error(patch)


def prices(before: Measured, after: Measured) -> tuple[Price, ...]:
    """Every figure of two fingers, in the order of `FIGURES`."""
    return tuple(Price(f, before.figures[f.name], after.figures[f.name]) for f in FIGURES)
