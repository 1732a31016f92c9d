"""A picture of the animation of `bench.force.press_slip`: camera, force field, forces over time."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray
from PIL import Image

from gelslim_force.forces.frame_result import FrameResult
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
WIDTH_PX, HEIGHT_PX, DPI = 960, 680, 100
BAND = 2.0
"""Half width of the bands in standard deviations."""
AXES = (("$F_x$", "#1f77b4"), ("$F_y$", "#2ca02c"), ("$F_z$", "#c23b22"))
STATES = {"no contact": "#ffffff", "sticks": "#dcebdc", "slips in part": "#fbe9c6",
          "slips": "#f6cfc6"}  # fmt: skip
MM_PER_KPA = 0.2
"""Length on the gel of the arrow of a shear traction."""
LEAST_KPA, KEY_KPA = 1.0, 10.0
"""Shear tractions below the first are not drawn; the second is that of the arrow in the key."""
FIELD_MM = 9.0
"""Half of the side of the part of the gel that is shown large."""
FEW = 1 / 3
"""Up to this share of slipping nodes, which lie at the rim, the contact counts as sticking."""
SCALED = {"angles": "xy", "scale_units": "xy", "scale": 1}
"""Arrows in the units of the axes."""
GREY = "0.45"


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame: its picture, what was measured in it, and how many nodes truly stick and slip."""

    picture: NDArray[np.uint8]
    result: FrameResult
    nodes: tuple[int, int]

    @property
    def state(self) -> str:
        """The true state of the contact, one of `STATES`."""
        sticking, slipping = self.nodes
        if not sticking + slipping:
            return "no contact"
        slipping_share = slipping / (sticking + slipping)
        return "sticks" if slipping_share <= FEW else "slips in part" if sticking else "slips"


@dataclass(frozen=True, eq=False)
class Cells:
    """Squares of 2 x 2 nodes of the gel, each of which has one arrow.

    Attributes:
        member: The cell (c,) of each node.
        centres_mm: Middles (k, 3) of the nodes of each cell.
        camera: Shows them in the picture.
    """

    member: NDArray[np.intp]
    centres_mm: Array
    camera: VirtualCamera

    @classmethod
    def of(cls, points_mm: Array, camera: VirtualCamera) -> Cells:
        """The cells of some nodes (c, 3)."""
        columns = [np.unique(points_mm[:, k].round(6), return_inverse=True)[1] for k in (0, 1)]
        square = np.column_stack(columns).reshape(-1, 2) // 2
        _, member = np.unique(square, axis=0, return_inverse=True)
        member = member.reshape(-1)
        return cls(member, _means(member, points_mm), camera)

    def shear_kpa(self, traction_mpa: Array) -> Array:
        """Mean shear traction (k, 2) of each cell, NaN where it is too small to be drawn."""
        mean = 1e3 * _means(self.member, traction_mpa[:, :2])
        return np.where(np.hypot(*mean.T)[:, None] < LEAST_KPA, np.nan, mean)

    def in_picture(self, arrows_mm: Array) -> tuple[Array, Array]:
        """Starts and lengths (k, 2) in px of arrows (k, 2) that lie on the gel."""
        start = self.camera.project(self.centres_mm)
        tip = self.centres_mm + np.pad(np.nan_to_num(arrows_mm), ((0, 0), (0, 1)))
        drawn = np.isfinite(arrows_mm).all(axis=1)[:, None]
        return start, np.where(drawn, self.camera.project(tip) - start, np.nan)


def _means(member: NDArray[np.intp], values: Array) -> Array:
    sums = np.zeros((member.max() + 1, values.shape[1]))
    np.add.at(sums, member, values)
    return sums / np.bincount(member)[:, None]


@dataclass(frozen=True, eq=False)
class Story:
    """All frames with their measured and true forces (n, 3) in N, and what all pictures share."""

    moments: Sequence[Moment]
    time_s: Array
    true_n: Array
    force_n: Array
    sigma_n: Array
    covariance_n2: Array
    friction: float
    cells: Cells
    most_kpa: float
    middle_mm: tuple[float, float]
    """Middle (x, y) of the part of the gel that is shown large."""

    @classmethod
    def of(
        cls,
        moments: Sequence[Moment],
        time_s: Array,
        true_n: Array,
        friction: float,
        camera: VirtualCamera,
    ) -> Story:
        """Collect the forces of the results, every one of which has a wrench and a field."""
        fields = [moment.result.field for moment in moments]
        wrenches = [moment.result.wrench for moment in moments]
        assert all(f is not None for f in fields)
        assert all(w is not None for w in wrenches)
        most = max(float(-1e3 * f.traction_mpa[:, 2].min()) for f in fields if f is not None)
        assert fields[0] is not None
        return cls(
            moments,
            time_s,
            true_n,
            np.array([w.force_n for w in wrenches if w is not None]),
            np.array([w.standard_deviation[:3] for w in wrenches if w is not None]),
            np.array([w.covariance[:3, :3] for w in wrenches if w is not None]),
            friction,
            Cells.of(fields[0].points_mm, camera),
            10.0 * np.ceil(most / 10.0),
            (0.0, 0.0),
        )


def frame_picture(story: Story, number: int) -> Image.Image:
    """The picture of one frame, of `WIDTH_PX` by `HEIGHT_PX`."""
    figure = Figure(figsize=(WIDTH_PX / DPI, HEIGHT_PX / DPI), dpi=DPI, facecolor="white")
    grid = figure.add_gridspec(
        2, 2, left=0.07, right=0.955, top=0.945, bottom=0.08, hspace=0.25, wspace=0.22,
        height_ratios=(1.42, 1), width_ratios=(1.2, 1),
    )  # fmt: skip
    _draw_camera(figure.add_subplot(grid[0, 0]), story, number)
    _draw_field(figure, figure.add_subplot(grid[0, 1]), story, number)
    _draw_forces(figure.add_subplot(grid[1, 0]), story, number)
    _draw_ratio(figure.add_subplot(grid[1, 1]), story, number)
    with io.BytesIO() as stream:
        figure.savefig(stream, format="png", dpi=DPI)
        return Image.open(stream).convert("RGB")


def _draw_camera(axes: Axes, story: Story, number: int) -> None:
    """What the camera sees, with the shear traction on the gel."""
    moment = story.moments[number]
    assert moment.result.field is not None
    axes.imshow(moment.picture, interpolation="antialiased")
    shear = story.cells.shear_kpa(moment.result.field.traction_mpa)
    start, length = story.cells.in_picture(MM_PER_KPA * shear)
    axes.quiver(
        *start.T, *length.T, color="#ffe24a", edgecolor="black", linewidth=0.4, width=0.0055,
        headwidth=3.8, headlength=4.2, headaxislength=3.8, **SCALED,
    )  # fmt: skip
    height, width = moment.picture.shape[:2]
    axes.set(xticks=[], yticks=[], xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    _titled(axes, "Camera picture, measured shear")


def _draw_field(figure: Figure, axes: Axes, story: Story, number: int) -> None:
    """Pressure in colours and shear as arrows on the gel, turned as in the picture."""
    field = story.moments[number].result.field
    assert field is not None
    x, y = field.points_mm[:, 0], field.points_mm[:, 1]
    colours = axes.tripcolor(
        Triangulation(y, x), np.maximum(-1e3 * field.traction_mpa[:, 2], 0.0), shading="gouraud",
        cmap="OrRd", vmin=0, vmax=story.most_kpa,
    )  # fmt: skip
    shear = story.cells.shear_kpa(field.traction_mpa)
    centres = story.cells.centres_mm
    arrows = axes.quiver(
        centres[:, 1], centres[:, 0], *(MM_PER_KPA * shear.T[::-1]), color="#16324f", width=0.007,
        **SCALED,
    )  # fmt: skip
    axes.quiverkey(
        arrows, 0.8, 1.045, MM_PER_KPA * KEY_KPA, f"{KEY_KPA:g} kPa", labelpos="E",
        fontproperties={"size": 9},
    )  # fmt: skip
    middle_x, middle_y = story.middle_mm
    axes.set(xlim=(middle_y - FIELD_MM, middle_y + FIELD_MM), aspect="equal")
    axes.set(ylim=(middle_x + FIELD_MM, middle_x - FIELD_MM))
    axes.set(xticks=range(-10, 11, 5), yticks=range(-10, 11, 5))
    axes.set(xlim=(middle_y - FIELD_MM, middle_y + FIELD_MM))
    axes.set(ylim=(middle_x + FIELD_MM, middle_x - FIELD_MM))
    axes.set_xlabel("y, mm", fontsize=9, labelpad=1)
    axes.set_ylabel("x, mm", fontsize=9, labelpad=-4)
    bar = figure.colorbar(colours, ax=axes, fraction=0.05, pad=0.04)
    bar.set_label("pressure, kPa", fontsize=9)
    for part in (axes, bar.ax):
        part.tick_params(labelsize=8, color=GREY)
    _titled(axes, "Force field")


def _draw_forces(axes: Axes, story: Story, number: int) -> None:
    """The force until now, with its band, and the true force of all frames."""
    now, time = slice(None, number + 1), story.time_s
    for k, (name, colour) in enumerate(AXES):
        found, sigma = story.force_n[now, k], story.sigma_n[now, k]
        axes.plot(time, story.true_n[:, k], "--", color=colour, linewidth=0.9, alpha=0.75)
        axes.fill_between(
            time[now], found - BAND * sigma, found + BAND * sigma, color=colour, alpha=0.2,
            linewidth=0,
        )  # fmt: skip
        axes.plot(time[now], found, color=colour, linewidth=1.8)
        axes.text(
            0.33 * k, 1.035, f"{name} {found[-1]:+.2f} N".replace("-", "\u2212"), color=colour,
            fontsize=10.5, transform=axes.transAxes,
        )  # fmt: skip
    low, high = story.true_n.min(), story.true_n.max()
    axes.set(xlim=(0, time[-1]), ylim=(low - 0.15, high + 0.12))
    axes.set_ylabel("force on the gel, N", fontsize=9, labelpad=2)
    _timed(axes, time[number])
    axes.text(
        0.5, 0.42, f"measured with ± {BAND:g} σ; dashed: true", fontsize=8.5, color=GREY,
        ha="center", transform=axes.transAxes,
    )  # fmt: skip


def _draw_ratio(axes: Axes, story: Story, number: int) -> None:
    """Tangential over normal force beside the friction, before the true states of the contact."""
    time, now = story.time_s, story.moments[number].state
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    for k, moment in enumerate(story.moments):
        axes.axvspan(edges[k], edges[k + 1], color=STATES[moment.state], linewidth=0)
    for state, (start, end) in longest_runs(story.moments).items():
        if state != "no contact":
            middle_s = (edges[start] + edges[end]) / 2
            axes.text(
                middle_s, 1.27 * story.friction, state.removeprefix("slips "), fontsize=9,
                ha="center", color="0.25",
            )  # fmt: skip
    axes.axhline(story.friction, color="0.3", linewidth=1, linestyle=":")
    axes.text(
        0.02 * time[-1], 1.02 * story.friction, f"friction {story.friction:g}", color="0.3",
        fontsize=8.5,
    )  # fmt: skip
    true, _ = ratio(story.true_n, np.zeros((len(time), 3, 3)))
    axes.plot(time, true, "--", color="#5b3a86", linewidth=0.9, alpha=0.75)
    found, sigma = ratio(story.force_n, story.covariance_n2)
    until = slice(None, number + 1)
    axes.fill_between(
        time[until], (found - BAND * sigma)[until], (found + BAND * sigma)[until],
        color="#5b3a86", alpha=0.2, linewidth=0,
    )  # fmt: skip
    axes.plot(time[until], found[until], color="#5b3a86", linewidth=1.8)
    axes.set(xlim=(0, time[-1]), ylim=(0, 1.4 * story.friction))
    axes.set_ylabel("tangential / normal force", fontsize=9, labelpad=2)
    _timed(axes, time[number])
    _titled(axes, "No contact" if now == "no contact" else f"The ball {now}")


def longest_runs(moments: Sequence[Moment]) -> dict[str, tuple[int, int]]:
    """The longest run of frames (first, one after the last) with each state of the contact."""
    found: dict[str, tuple[int, int]] = {}
    start = 0
    for k in range(1, len(moments) + 1):
        state = moments[start].state
        if k == len(moments) or moments[k].state != state:
            before = found.get(state, (0, 0))
            if k - start > before[1] - before[0]:
                found[state] = (start, k)
            start = k
    return found


def ratio(force_n: Array, covariance_n2: Array) -> tuple[Array, Array]:
    """Tangential over normal force.

    Args:
        force_n: Forces (n, 3) in N.
        covariance_n2: Their covariances (n, 3, 3).

    Returns:
        The ratio (n,) and its standard deviation to first order (n,); NaN below 10 mN of normal
        force.
    """
    tangential = np.hypot(force_n[:, 0], force_n[:, 1])
    normal = np.where(-force_n[:, 2] < 0.01, np.nan, -force_n[:, 2])
    share = tangential / normal
    along = force_n[:, :2] / np.maximum(tangential, 1e-12)[:, None]
    slope = np.column_stack([along / normal[:, None], share / normal])
    variance = np.einsum("ni,nij,nj->n", slope, covariance_n2, slope)
    return share, np.sqrt(np.maximum(variance, 0.0))


def _timed(axes: Axes, now_s: float) -> None:
    axes.axvline(now_s, color="0.2", linewidth=0.8)
    axes.set_xlabel("time, s", fontsize=9, labelpad=1)
    axes.tick_params(labelsize=8, color=GREY)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _titled(axes: Axes, text: str) -> None:
    axes.set_title(text, fontsize=10.5, loc="left", pad=5)
