"""Curved guide over a glued 45° mirror, against R/t, in several settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from bench.bench_data import ROOT
from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import curved_guide, gel_section, straight_guide
from gelslim_cad.light.scene import MIRROR_REFLECTANCE, dark_faces, light_scene
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)
from gelslim_optics.light.result import paired_ratio
from gelslim_optics.light.scene import LightScene, Surface
from gelslim_optics.light.source import LedRow
from gelslim_optics.light.trace import trace_light

SPEC = ROOT / "designs" / "gelslim2.yaml"
RAYS = 1 << 16
QUANTITIES = ("arrived", "entered_gel")
RATIOS = (0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
EARLIER = {1.0: (0.74, 0.77), 2.05: (0.92, 0.95), 3.0: (1.10, 1.14), 4.0: (1.10, 1.14)}
"""Ranges an earlier prototype tracer gave, for a 20 mm pad and mirrors of 0.88 to 0.95."""


OPEN: dict[str, Any] = {
    "pad_mm": 20.0,
    "window_mm": 20.0,
    "thickness_mm": 2.0,
    "leg_mm": 0.5,
    "gap_mm": 0.0,
}
CHANGES: dict[str, dict[str, Any]] = {
    "plain setting": {},
    "black housing": {"black": True},
    "legs of 1 mm, gap 0.2 mm": {"leg_mm": 1.0, "gap_mm": 0.2},
    "legs of 5 mm": {"leg_mm": 5.0},
    "LEDs of 1.6 mm": {"led_mm": 1.6},
    "window 1 mm wider than the gel at each side": {"window_mm": 22.0},
    "coat scatters half": {"coat": Surface(0.5, diffuse=True)},
    "pad of 28 mm": {"pad_mm": 28.0, "window_mm": 28.0},
}
"""What differs between the plain setting and a finger, one at a time."""


def ratios() -> dict[str, Any]:
    """Curves over R/t: gelslim2 as it is and with short legs, and the plain setting."""
    d = derive(read_spec(SPEC).spec)
    t, gap = d["design.light_guide.thickness_mm"], d["design.housing.fit_clearance_mm"]
    leg = d["design.light_guide.leg_length_mm"]
    legs = {"own": (leg, gap), "short": (t / 4, 0.0)}
    rows = []
    for name, (leg_mm, gap_mm) in legs.items():
        rows += _curve(f"gelslim2, {name} legs", leg_mm, gap_mm, _finger(d, leg_mm, gap_mm))
    rows += _curve("plain, short legs", 0.5, 0.0, partial(_open, **OPEN))
    longer = {**OPEN, "leg_mm": leg, "gap_mm": gap}
    rows += _curve("plain, legs of gelslim2", leg, gap, partial(_open, **longer))
    return {
        "design": SPEC.name,
        "own_bend_ratio": d["guide.bend_ratio"],
        "mirror_reflectance": MIRROR_REFLECTANCE,
        "rays": RAYS,
        "rows": rows,
    }


def earlier() -> list[dict[str, Any]]:
    """The plain setting: 20 mm pad as wide as the window, legs of t/4, LEDs touch, no housing."""
    rows = _curve("plain", 0.5, 0.0, partial(_open, **OPEN), tuple(EARLIER))
    keys = ("bend_ratio", *QUANTITIES)
    return [
        {**{k: row[k] for k in keys}, "earlier_low": low, "earlier_high": high}
        for row, (low, high) in zip(rows, EARLIER.values(), strict=True)
    ]


def changes() -> list[dict[str, Any]]:
    """The plain setting with one change at a time."""
    rows = []
    for name, change in CHANGES.items():
        found = _curve(name, 0.0, 0.0, partial(_open, **{**OPEN, **change}), (1.0, 2.05, 3.0))
        row: dict[str, Any] = {"change": name}
        for quantity in QUANTITIES:
            row |= {f"{quantity} at {r['bend_ratio']:g}": r[quantity] for r in found}
        rows.append(row)
    return rows


Scene = Callable[[float | None], LightScene]
"""Scene of the curved guide of a ratio R/t, or None: of the straight guide."""


def _curve(
    setting: str, leg_mm: float, gap_mm: float, scene: Scene, at: tuple[float, ...] = RATIOS
) -> list[dict[str, Any]]:
    mirror, rows = trace_light(scene(None), RAYS), []
    for ratio in at:
        light = trace_light(scene(ratio), RAYS)
        row: dict[str, Any] = {
            "setting": setting,
            "leg_mm": leg_mm,
            "gap_mm": gap_mm,
            "bend_ratio": ratio,
        }
        for quantity in QUANTITIES:
            found = paired_ratio(light, mirror, quantity)
            row[quantity] = found.value
            row[f"{quantity}_low"], row[f"{quantity}_high"] = found.low, found.high
        rows.append(row)
    return rows


def _finger(d: Lookup, leg_mm: float, gap_mm: float) -> Scene:
    bent = replace(curved_guide(d), leg_mm=leg_mm)
    straight, gel = replace(straight_guide(d), leg_mm=leg_mm), gel_section(d)

    def scene(ratio: float | None) -> LightScene:
        if ratio is None:
            profile = mirror_profile(straight, gel)
        else:
            radius = ratio * bent.thickness_mm
            profile = curved_profile(replace(bent, inner_radius_mm=radius), gel)
        found = light_scene(d, profile)
        lamps = [s for s in found.sources if isinstance(s, LedRow)]
        return replace(found, sources=tuple(replace(s, gap_mm=gap_mm) for s in lamps))

    return scene


def _open(
    ratio: float | None,
    *,
    pad_mm: float,
    window_mm: float,
    thickness_mm: float,
    leg_mm: float,
    gap_mm: float,
    led_mm: float = 2.0,
    black: bool = False,
    coat: Surface = Surface(),  # noqa: B008 (frozen)
) -> LightScene:
    gel, t = GelSection(pad_mm, 2.0), thickness_mm
    if ratio is None:
        profile = mirror_profile(MirrorGuide(window_mm, t, leg_mm), gel)
    else:
        profile = curved_profile(CurvedGuide(window_mm, t, ratio * t, leg_mm), gel)
    places = (-7.5, -2.5, 2.5, 7.5)
    rows = tuple(LedRow(f"foot_{side}", places, led_mm, gap_mm) for side in ("left", "right"))
    half = pad_mm / 2
    found = LightScene(
        profile,
        (-half, half),
        (-half, half),
        rows,
        surfaces={"paint": coat, "mirror": Surface(MIRROR_REFLECTANCE)},
    )
    return replace(found, feet=dark_faces(profile)) if black else found
