"""Pictures of the light: ray paths, irradiance of the coat, brightness against bend radius."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from gelslim_cad.geometry.led_strips import has_tip_light, strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import guide_profile
from gelslim_cad.light.scene import light_scene
from gelslim_cad.light.study import LightStudy
from gelslim_core.figure import as_png, new_figure
from gelslim_optics.guide.profile import GuideProfile, Segment
from gelslim_optics.light.trace import trace_paths

PATHS = 35
"""Of each strip, in the picture."""
SHOWN_PATHS = 12
"""Of each strip, in the 3D view."""
ACRYLIC, GEL, INK = "#cfe6f5", "#f4efe2", "#333a44"
RAY_COLOURS = {
    "red": "#d0342c",
    "green": "#1c9a3d",
    "blue": "#1f5fc4",
    "left": "#8a5a00",
    "right": "#5a4a8a",
    "tip": "#2f6f6f",
}
SHADES = {
    "red": "Reds",
    "green": "Greens",
    "blue": "Blues",
    "left": "Greys",
    "right": "Greys",
    "tip": "Greys",
}
Paths = tuple[tuple[str, np.ndarray], ...]


def paths_png(d: Lookup, title: str | None = None, seed: int = 3) -> bytes:
    """Light paths of the sides in the cross-section and, below it, of the tip along the finger.

    `title` goes into the file's text.
    """
    profile, colours = guide_profile(d), list(strip_wavelengths_nm(d))
    paths = trace_paths(light_scene(d, profile), PATHS * len(colours), seed=seed)
    if has_tip_light(d):
        figure, (axes, below) = new_figure(9.0, 4.6, rows=2)
        _draw_along(below, d, tuple(p for p in paths if p[0] == colours[-1]), colours[-1])
    else:
        figure, axes = new_figure(9.0, 3.2)
    _draw_across(axes, d, profile, tuple(p for p in paths if p[0] in colours[:2]))
    axes.set_title("Light paths; where light splits, one branch is followed by chance", fontsize=10)
    return as_png(figure, title)


def _draw_across(axes: Any, d: Lookup, profile: GuideProfile, paths: Paths) -> None:
    """The cross-section with paths and the LEDs of both sides."""
    for medium, colour in (("acrylic", ACRYLIC), ("gel", GEL)):
        outline = outline_points(profile, medium)
        axes.fill(outline[:, 0], outline[:, 1], colour, ec=INK, lw=1.0, zorder=1)
    for colour, points in paths:
        axes.plot(points[:, 1], points[:, 2], color=RAY_COLOURS[colour], lw=0.5, alpha=0.5)
    half, package = d["led.y_mm"], d["design.leds.package_mm"]
    for side, colour in zip((-1, 1), strip_wavelengths_nm(d), strict=False):
        low = d["led.top_z_mm"] - d["design.leds.height_mm"]
        corner = (side * half - package / 2, low)
        axes.add_patch(_box(corner, package, d["design.leds.height_mm"], RAY_COLOURS[colour]))
    axes.set_aspect("equal")
    axes.set_xlabel("y across the finger, mm")
    axes.set_ylabel("z, mm")


def _draw_along(axes: Any, d: Lookup, paths: Paths, colour: str) -> None:
    """The section along the finger through window and gel, with paths and LEDs of the tip.

    Where a path is in a bend or a leg, it is not drawn.
    """
    half, bottom = d["design.gel.length_mm"] / 2, d["stack.gel_bottom_z_mm"]
    first, last = d["guide.proximal_end_x_mm"], d["guide.distal_end_x_mm"]
    thick = d["design.light_guide.thickness_mm"]
    for low, high, base, top, shade in (
        (first, last, bottom - thick, bottom, ACRYLIC),
        (-half, half, bottom, 0.0, GEL),
    ):
        axes.fill([low, high, high, low], [base, base, top, top], shade, ec=INK, lw=1.0, zorder=1)
    for _, points in paths:
        over_window = np.abs(points[:, 1:2]) <= d["guide.flat_width_mm"] / 2
        x, _, z = np.where(over_window, points, np.nan).T
        axes.plot(x, z, color=RAY_COLOURS[colour], lw=0.5, alpha=0.5)
    package, height = d["design.leds.package_mm"], d["design.leds.height_mm"]
    corner = (d["led.tip_face_x_mm"], d["led.tip_z_mm"] - package / 2)
    axes.add_patch(_box(corner, height, package, RAY_COLOURS[colour]))
    axes.set_ylim(bottom - thick - 0.6, 0.6)
    axes.set_aspect("equal")
    axes.set_xlabel("x along the finger, mm; the tip is at the right")
    axes.set_ylabel("z, mm")


def shown_paths(d: Lookup, seed: int = 3) -> dict[str, Any]:
    """Some light paths as plain data: for each its colour and its points (k, 3) in mm."""
    scene = light_scene(d, guide_profile(d))
    paths = trace_paths(scene, SHOWN_PATHS * len(scene.sources), seed=seed)
    return {
        "format": "gelslim-light-paths/1",
        "paths": [{"colour": c, "points_mm": np.round(p, 4).tolist()} for c, p in paths],
    }


def irradiance_png(d: Lookup, study: LightStudy) -> bytes:
    """Irradiance of the coat by each strip, over its mean, and profiles across.

    With a strip at the tip also profiles along, and the change of each light per unit slope.
    """
    if has_tip_light(d):
        figure, (axes, below) = new_figure(10.0, 7.2, columns=3, rows=2)
        _draw_maps(figure, axes, below[0], d, study)
        _draw_profiles_along(below[1], d, study)
        _draw_slopes(below[2], study)
    else:
        figure, axes = new_figure(10.0, 3.6, columns=3)
        _draw_maps(figure, axes, axes[2], d, study)
    return as_png(figure)


def _draw_maps(figure: Any, axes: Any, across_panel: Any, d: Lookup, study: LightStudy) -> None:
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
        across_panel.plot(places, across, color=RAY_COLOURS[colour], label=colour)
    across_panel.set_ylim(bottom=0)
    across_panel.set_xlabel("y, mm")
    across_panel.set_title("mean along x, over its mean", fontsize=10)
    across_panel.legend(frameon=False)


def _draw_profiles_along(panel: Any, d: Lookup, study: LightStudy) -> None:
    """Mean across of each light over its mean, along the finger."""
    half = d["design.gel.length_mm"] / 2
    for colour in study.light.colours:
        along = study.light.irradiance(colour).mean(axis=1)
        places = (np.arange(len(along)) + 0.5) / len(along) * 2 * half - half
        panel.plot(places, along / along.mean(), color=RAY_COLOURS[colour], label=colour)
    panel.set_ylim(bottom=0)
    panel.set_xlabel("x, mm; the tip is at the right")
    panel.set_title("mean across y, over its mean", fontsize=10)
    panel.legend(frameon=False)


def _draw_slopes(panel: Any, study: LightStudy) -> None:
    """Relative change of each light per unit slope of the gel, along x and along y."""
    colours = study.light.colours
    places = np.arange(len(colours))
    shades = [RAY_COLOURS[c] for c in colours]
    axes: tuple[tuple[Literal["x", "y"], float, str], ...] = (("x", -0.2, ""), ("y", 0.2, "///"))
    for axis, shift, hatch in axes:
        found = [study.light.slope_sensitivity(c, axis).value for c in colours]
        style = {"color": shades, "edgecolor": INK, "hatch": hatch, "alpha": 0.75}
        panel.bar(places + shift, found, 0.38, label=f"slope along {axis}", **style)
    panel.axhline(0.0, color=INK, lw=0.8)
    panel.set_xticks(places, colours)
    panel.set_title("relative change per unit slope", fontsize=10)
    for handle in panel.legend(frameon=False, fontsize=8).get_patches():
        handle.set_facecolor("white")


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
