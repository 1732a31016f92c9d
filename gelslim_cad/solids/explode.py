"""How far parts move apart in the exploded view, so that none hides another.

Each part gives its direction and, by the length of its `explode_mm`, its place in the order along
it. The distances follow from the finger: level by level, the next parts move on until enough of
every part is seen, with all silhouettes taken as those of bounding boxes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from gelslim_cad.export.brep import bounds_mm
from gelslim_cad.geometry.part import Part
from gelslim_cad.pictures.finger_pictures import ISO

SEEN_RATIO = 0.8
"""Least part of a silhouette that stays in sight."""
STEP_MM = 2.0
GAP_MM = 2.0
"""Least way of a level beyond its own height, by which it has left what it sits in."""
LONGEST_MM = 400.0
GRID_MM = 1.0
Mask = NDArray[np.bool_]


def spread(parts: Sequence[Part]) -> tuple[Part, ...]:
    """The parts with `explode_mm` of the lengths that the view from above at an angle needs.

    Parts move along z in two stacks, upwards and downwards; other components stay as they are.
    """
    scene = _Scene.of(parts)
    moved = {n: 0.0 for n, part in enumerate(parts) if part.explode_mm[2] == 0.0}
    for way in (1, -1):
        orders = {round(p.explode_mm[2] * way, 6) for p in parts if p.explode_mm[2] * way > 0}
        reach = 0.0
        for order in sorted(orders):
            level = [n for n, p in enumerate(parts) if round(p.explode_mm[2] * way, 6) == order]
            out = reach + max(scene.heights_mm[n] for n in level) + GAP_MM
            reach = _first_clear(scene, moved, level, way, out)
            moved.update(dict.fromkeys(level, way * reach))
    return tuple(
        replace(part, explode_mm=(*part.explode_mm[:2], moved[n])) for n, part in enumerate(parts)
    )


@dataclass(frozen=True)
class _Scene:
    """Silhouettes (k, 2) in mm on the screen, and which of them hide what lies behind."""

    outlines: tuple[NDArray[np.float64], ...]
    hides: tuple[bool, ...]
    heights_mm: tuple[float, ...]
    rise: float
    """Way on the screen of 1 mm along z."""
    low: NDArray[np.float64]
    shape: tuple[int, int]

    @classmethod
    def of(cls, parts: Sequence[Part]) -> _Scene:
        right, up, _ = ISO.axes()
        screen = np.stack([right, up])
        outlines, heights = [], []
        for part in parts:
            low, high = bounds_mm(part.solid)
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            corners[:, :2] += part.explode_mm[:2]
            heights.append(float(high[2] - low[2]))
            seen = corners @ screen.T
            outlines.append(seen[ConvexHull(seen, qhull_options="QJ").vertices])
        every = np.concatenate(outlines)
        room = np.array([0.0, LONGEST_MM])
        low = every.min(axis=0) - room
        size = every.max(axis=0) + room - low
        columns, rows = (int(n) for n in np.ceil(size / GRID_MM))
        hides = tuple(part.colour[3] > 0.9 for part in parts)
        return cls(tuple(outlines), hides, tuple(heights), float(up[2]), low, (rows, columns))

    def mask(self, number: int, shift_mm: float) -> Mask:
        """Cells of the screen (rows, columns) that a part moved along z covers."""
        outline = self.outlines[number] + (0.0, shift_mm * self.rise)
        start, stop = outline.min(axis=0), outline.max(axis=0)
        first = np.floor((start - self.low) / GRID_MM).astype(int)
        last = np.ceil((stop - self.low) / GRID_MM).astype(int) + 1
        x = self.low[0] + (np.arange(first[0], last[0]) + 0.5) * GRID_MM
        y = self.low[1] + (np.arange(first[1], last[1]) + 0.5) * GRID_MM
        inside = np.ones((len(y), len(x)), bool)
        for a, b in pairwise([*outline, outline[0]]):
            along = b - a
            inside &= along[0] * (y[:, None] - a[1]) - along[1] * (x[None, :] - a[0]) >= -GRID_MM
        whole = np.zeros(self.shape, bool)
        whole[first[1] : last[1], first[0] : last[0]] = inside[
            : self.shape[0] - first[1], : self.shape[1] - first[0]
        ]
        return whole


def _first_clear(
    scene: _Scene, moved: dict[int, float], level: list[int], way: int, start_mm: float
) -> float:
    """Least distance from `start_mm` at which the level hides nothing below it, nor is hidden."""
    placed = {n: scene.mask(n, shift) for n, shift in moved.items()}
    for reach in np.arange(start_mm, LONGEST_MM, STEP_MM):
        here = {n: scene.mask(n, way * float(reach)) for n in level}
        over, under = (here, placed) if way > 0 else (placed, here)
        cover = np.zeros(scene.shape, bool)
        for n, mask in over.items():
            if scene.hides[n]:
                cover |= mask
        if all((mask & ~cover).sum() >= SEEN_RATIO * mask.sum() for mask in under.values()):
            return float(reach)
    return LONGEST_MM
