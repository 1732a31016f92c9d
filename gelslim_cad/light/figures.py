"""Pictures of the light: ray paths, irradiance of the coat, brightness against bend radius."""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_cad.geometry.led_strips import strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.light.study import LightStudy
from gelslim_core.figure import as_png, new_figure
from gelslim_optics.guide.profile import GuideProfile, Segment
from gelslim_optics.light.trace import trace_paths

PATHS = 70
SHOWN_PATHS = 24
ACRYLIC, GEL, INK = "#cfe6f5", "#f4efe2", "#333a44"
RAY_COLOURS = {
    "red": "#d0342c",
    "green": "#1c9a3d",
    "blue": "#1f5fc4",
    "left": "#8a5a00",
    "right": "#5a4a8a",
}
SHADES = {"red": "Reds", "green": "Greens", "blue": "Blues", "left": "Greys", "right": "Greys"}


def paths_png(d: Lookup, title: str | None = None, seed: int = 3) -> bytes:
    """Cross-section with light paths from both LED rows; `title` goes into the file's text."""
    figure, axes = new_figure(9.0, 3.2)
    profile = guide_profile(d)
    for medium, colour in (("acrylic", ACRYLIC), ("gel", GEL)):
        outline = outline_points(profile, medium)
        axes.fill(outline[:, 0], outline[:, 1], colour, ec=INK, lw=1.0, zorder=1)
    for colour, points in trace_paths(light_scene(d, profile), PATHS, seed=seed):
        axes.plot(points[:, 1], points[:, 2], color=RAY_COLOURS[colour], lw=0.5, alpha=0.5)
    half, package = d["led.y_mm"], d["design.leds.package_mm"]
    for side, colour in zip((-1, 1), strip_wavelengths_nm(d), strict=True):
        low = d["led.top_z_mm"] - d["design.leds.height_mm"]
        corner = (side * half - package / 2, low)
        axes.add_patch(_box(corner, package, d["design.leds.height_mm"], RAY_COLOURS[colour]))
    axes.set_aspect("equal")
    axes.set_xlabel("y across the finger, mm")
    axes.set_ylabel("z, mm")
    axes.set_title("Light paths; where light splits, one branch is followed by chance", fontsize=10)
    return as_png(figure, title)


def shown_paths(d: Lookup, seed: int = 3) -> dict[str, Any]:
    """Some light paths as plain data: for each its colour and its points (k, 3) in mm."""
    paths = trace_paths(light_scene(d, guide_profile(d)), SHOWN_PATHS, seed=seed)
    return {
        "format": "gelslim-light-paths/1",
        "paths": [{"colour": c, "points_mm": np.round(p, 4).tolist()} for c, p in paths],
    }


def irradiance_png(d: Lookup, study: LightStudy) -> bytes:
    """Irradiance of the coat by each strip, over its mean, and profiles across."""
    figure, axes = new_figure(10.0, 3.6, columns=3)
    half_x, half_y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    for panel, colour in zip(axes, strip_wavelengths_nm(d), strict=False):
        bins = study.light.irradiance(colour)
        shown = panel.imshow(
            bins / bins.mean(),
            extent=(-half_y, half_y, half_x, -half_x),
            cmap=SHADES[colour],
            vmin=0,
            interpolation="nearest",
        )
        figure.colorbar(shown, ax=panel, shrink=0.8, label="over its mean")
        panel.set_title(f"{colour} on the coat", fontsize=10)
        panel.set_xlabel("y, mm")
        if panel is axes[0]:
            panel.set_ylabel("x, mm")
        across = bins.mean(axis=0) / bins.mean()
        places = (np.arange(len(across)) + 0.5) / len(across) * 2 * half_y - half_y
        axes[2].plot(places, across, color=RAY_COLOURS[colour], label=colour)
    axes[2].set_ylim(bottom=0)
    axes[2].set_xlabel("y, mm")
    axes[2].set_title("mean along x, over its mean", fontsize=10)
    axes[2].legend(frameon=False)
    return as_png(figure)


def ratio_png(study: LightStudy) -> bytes:
    """Light against a straight guide with glued mirrors over R/t, this finger marked."""
    figure, axes = new_figure(6.4, 4.0)
    ratios = [r for r, _ in study.curve]
    values = np.array([e.value for _, e in study.curve])
    low, high = (np.array([getattr(e, side) for _, e in study.curve]) for side in ("low", "high"))
    axes.fill_between(ratios, low, high, color="#9db8d9", alpha=0.6, label="95 % interval")
    axes.plot(ratios, values, color="#1f4e8c", marker="o", ms=3.5, label="other bend radii")
    own = study.comparisons[0].ratio
    error = [[own.value - own.low], [own.high - own.value]]
    here = [study.bend_ratio], [own.value], error
    axes.errorbar(*here, fmt="D", color="#c4580a", label="this finger")
    axes.axhline(1.0, color=INK, lw=0.8)
    axes.set_xlabel("bend radius over thickness, R/t")
    axes.set_ylabel("light on the coat over glued 45° mirrors")
    axes.set_xlim(left=0)
    axes.legend(frameon=False, fontsize=9)
    axes.grid(alpha=0.3)
    return as_png(figure)


def outline_points(profile: GuideProfile, medium: str, per_arc: int = 40) -> np.ndarray:
    """Points (n, 2) along a medium's outline, arcs in `per_arc` steps."""
    points = []
    for edge in profile.outline(medium):
        steps = 1 if isinstance(edge.curve, Segment) else per_arc
        points += [edge.curve.at(k / steps) for k in range(steps)]
    return np.array(points)


def _box(corner: tuple[float, float], width: float, height: float, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle(corner, width, height, fc=colour, ec=INK, lw=0.8, zorder=3)
