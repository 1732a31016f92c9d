"""What the picture of each step shows: parts in place, moving parts drawn back, arrows.

Parts in place are pale, moving ones orange, their screws, inserts and nuts blue. Moving parts are
drawn on their way, before their seat, and an arrow behind them points along it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.assembly.order import Step, Way
from gelslim_cad.pictures.mesh_scene import View
from gelslim_cad.pictures.shaded_mesh import ShadedMesh
from gelslim_cad.pictures.step_pictures import Arrow, Colour, Drawn, StepScene

Floats = NDArray[np.float64]
PALE = (0.80, 0.82, 0.84)
MOVING = (0.96, 0.50, 0.08)
FASTENER = (0.08, 0.38, 0.80)
PALE_SHARE, STRONG_SHARE = 0.80, 0.72
"""Shares of these colours in that of a part."""
LEAST_WAY_MM, MOST_WAY_MM = 7.0, 26.0
GROUP_SHARE = 1.5
"""Way before its seat of a group that closes another, over its height: what it holds is seen."""
FASTENER_WAY_MM = 12.0
GAP_MM = 1.5
"""Between a part and the tip of its arrow."""
RISING_GAP = 0.14
"""The same below a part that rises, over its size: its front edge hides what is closer."""
ABOVE, BELOW = View(-62.0, 34.0), View(-62.0, -30.0)
LEVEL = View(-62.0, 16.0)
BEHIND = View(-124.0, -24.0)


def step_scene(
    step: Step, meshes: Mapping[str, ShadedMesh], colours: Mapping[str, Colour]
) -> StepScene:
    """The picture of a step.

    Args:
        step: The step, with the way that is free.
        meshes: Meshes of the parts, by name.
        colours: Colours of the parts, by name.

    Returns:
        What to draw.
    """
    drawn = [Drawn(meshes[n], np.zeros(3), _mixed(colours[n], PALE, PALE_SHARE, 1.0))
             for n in step.stays]  # fmt: skip
    arrows: list[Arrow] = []
    if step.moves:
        back, way_arrows = _on_its_way([meshes[n] for n in step.moves], step.way)
        arrows += way_arrows
        drawn += [Drawn(meshes[n], back, _mixed(colours[n], MOVING, STRONG_SHARE, 1.6))
                  for n in step.moves]  # fmt: skip
    for fastener in step.fasteners:
        mesh = meshes[fastener.part]
        back, screw_arrows = _on_its_way([mesh], fastener.way, FASTENER_WAY_MM)
        if step.moves and fastener.way[-1].direction == step.way[-1].direction:
            # The screws follow the part: they are drawn behind it.
            back = back + _on_its_way([meshes[n] for n in step.moves], step.way)[0]
        drawn.append(Drawn(mesh, back, (*FASTENER, 1.0)))
        if not step.moves:
            arrows += screw_arrows
    return StepScene(tuple(drawn), tuple(arrows), _view(step))


def _view(step: Step) -> View:
    """From where the parts come; level where a group closes from below, to show what it holds."""
    if len(step.way) > 1:
        return BEHIND
    ways = [step.way] if step.moves else [f.way for f in step.fasteners]
    rise = [way[0].direction[2] for way in ways]
    if step.moves and step.fasteners:
        rise += [f.way[0].direction[2] for f in step.fasteners]
    if min(rise) > 0:
        return LEVEL if len(step.moves) > 1 else BELOW
    return LEVEL if max(rise) > 0 else ABOVE


def _on_its_way(
    meshes: Sequence[ShadedMesh], way: Way, length_mm: float | None = None
) -> tuple[Floats, list[Arrow]]:
    """How far parts are drawn back from their seat, and the arrows behind them."""
    points = np.concatenate([m.vertices_mm for m in meshes])
    back, arrows = np.zeros(3), []
    for leg in reversed(way):
        along = np.asarray(leg.direction)
        heights = points @ along
        extent = float(np.ptp(heights))
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        run = leg.length_mm
        if math.isinf(run):
            run = length_mm or min(max(0.8 * extent, LEAST_WAY_MM), MOST_WAY_MM)
            if len(meshes) > 3:
                run = GROUP_SHARE * extent
        back = back - run * along
        if math.isinf(leg.length_mm) or len(way) > 1:
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            gap = GAP_MM + (RISING_GAP * size if along[2] > 0 else 0.0)
            rear = middle + (float(heights.min()) - float(middle @ along) - gap) * along
            length = min(max(0.25 * size, 4.0), 14.0)
            arrows.append(Arrow(rear + back, along, length, 0.14 * length))
    return back, arrows


def _mixed(own: Colour, other: tuple[float, float, float], share: float, solid: float) -> Colour:
    """A colour mixed with another; `solid` multiplies its opacity."""
    red, green, blue = (
        round((1 - share) * a + share * b, 3) for a, b in zip(own, other, strict=False)
    )
    return red, green, blue, min(1.0, own[3] * solid)
