"""A certificate of total internal reflection in plain words."""

from __future__ import annotations

import math
from typing import Any


class TirWords:
    """Gives a certificate its `sentences`."""

    def sentences(self) -> tuple[str, ...]:
        """The certificate in words, verdict first."""
        return (*_guiding(self), *_reservations(self), *_gel(self))


def _light(na: float) -> str:
    if na == 0:
        return "collimated light"
    return "a bare LED's light (NA 1)" if na == 1 else f"light of NA {na:g}"


def share_words(share: float, at_least: bool = False) -> str:
    """A share in per cent, never rounded up to all of it; with `at_least` never up at all."""
    if share >= 1:
        return "100%"
    if share <= 0 and at_least:
        return "an unknown share"
    if share > 0.999:
        return f"all but {100 * (1 - share):.1g}%"
    return f"at least {math.floor(share * 1000) / 10:.1f}%" if at_least else f"{share:.1%}"


def _guiding(c: Any) -> list[str]:
    light = _light(c.na)
    if c.verdict == "refused":
        return [f"Not certified: {'; '.join(c.reasons)}."]
    if c.verdict == "mirror_corners":
        return [
            f"Mirrors turn the light: they are no total reflection and what their corners lose is "
            f"not certified here; the walls keep {light} by {c.margin_deg:.2f}°."
        ]
    kept = share_words(c.guided, c.tapers or not all(b.exact for b in c.bends))
    if not c.bends:
        if c.fully_guided:
            return [f"Fully guided: the flat walls keep {light} by {c.margin_deg:.2f}°; no bends."]
        return [
            f"Not fully guided: there are no bends, but the flat walls keep {kept} of {light}; the "
            f"worst ray misses the critical angle by {-c.margin_deg:.2g}°."
        ]
    worst = min(c.bends, key=lambda b: b.margin_deg)
    needs = "no R/t guides all of it"
    if worst.least_ratio is not None:
        needs = f"full guidance needs R/t >= {math.ceil(worst.least_ratio * 100 - 1e-6) / 100:.2f}"
    has = f"R/t = {worst.ratio:.3g}"
    margin = f"{abs(c.margin_deg):.2g}°"
    if c.fully_guided:
        return [f"Fully guided: {light} keeps {margin} at the worst wall ({has}; {needs})."]
    legs = " The legs' walls leak too." if c.straight_margin_deg < 0 else ""
    return [
        f"Not fully guided: {kept} of {light} stays in at the bend ({has}; {needs}; the worst ray "
        f"misses the critical angle by {margin}).{legs}"
    ]


def _reservations(c: Any) -> list[str]:
    if c.verdict == "refused":
        return []
    said = []
    if c.mirrors and c.verdict == "not_fully_guided":
        said.append("What the mirrors' corners lose besides is not certified.")
    if c.tapers:
        said.append(
            f"The legs taper: light reaches the bends with NA {c.bend_na:.3g} at most, and shares "
            "are lower bounds."
        )
    short = [b for b in c.bends if not b.exact]
    if short:
        said.append(
            f"A bend of {short[0].sweep_deg:.3g}° is short: only from "
            f"{short[0].full_sweep_deg:.3g}° on does every ray that can leak meet the outer wall, "
            "so less leaks than stated."
        )
    if c.verdict == "not_fully_guided":
        said.append(
            "Not even collimated light is fully guided here."
            if c.largest_na is None
            else f"Light up to NA {math.floor(c.largest_na * 1000) / 1000:.3f} is fully guided."
        )
    return said


def _gel(c: Any) -> list[str]:
    if c.gel_critical_deg is None or c.verdict == "refused":
        return []
    if c.gel_critical_deg == 0:
        return [
            "The gel is at least as dense as the guide: no total reflection at their face, all "
            "light that meets it enters but for partial reflection."
        ]
    rise, reach = c.gel_critical_deg, c.top_elevation_deg
    if c.enters_gel:
        return [
            f"Light enters the gel from {rise:.1f}° above the face; the guide brings up to "
            f"{reach:.1f}°."
        ]
    remedy = "use a wider cone or a gel of higher index"
    if c.largest_entry_ratio is not None:
        remedy = f"bend tighter than R/t = {c.largest_entry_ratio:.3g} or use a gel of higher index"
    return [
        f"No guided light enters the gel: it must rise {rise:.1f}° above the face and at most "
        f"{reach:.1f}° arrives; {remedy}."
    ]
