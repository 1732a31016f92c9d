"""Motions of the print for the matching tests: pushes, stretches and twists of a patch of gel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from camera_rig import finger_view
from numpy.typing import NDArray
from synthetic import grid_of_dots

from gelslim_force.lattice.reference_lattice import ReferenceLattice

KINDS = ("shear", "radial", "twist", "both")
PITCH_MM = 1.1
GRID = grid_of_dots()
CAMERA = finger_view()


def seen_at(moved_mm: NDArray[np.float64] | float = 0.0) -> NDArray[np.float64]:
    """Places (n, 2) px of the grid's markers, moved by (n, 2) mm."""
    flat = GRID.positions_mm + moved_mm
    return CAMERA.project(np.column_stack([flat, np.zeros(len(flat))]))


REST_PX = seen_at()
REFERENCE = ReferenceLattice(
    sites=np.column_stack([GRID.row, GRID.column]),
    positions_px=REST_PX,
    markers=np.arange(len(GRID)),
)


def motion(rng: np.random.Generator, kind: str, peak_pitch: float) -> NDArray[np.float64]:
    """Displacements (n, 2) mm around a random place, at most `peak_pitch` pitches."""
    centre, width = rng.uniform(-5, 5, 2), rng.uniform(2.5, 6)
    off = (GRID.positions_mm - centre) / width
    bump = np.exp(-np.sum(off**2, axis=1) / 2)[:, None]
    angle = rng.uniform(0, 2 * np.pi)
    push = np.array([np.cos(angle), np.sin(angle)])
    moved = {
        "shear": bump * push,
        "radial": off * bump,
        "twist": off[:, ::-1] * [1, -1] * bump,
        "both": bump * push + 0.5 * off * bump,
    }[kind]
    return moved * PITCH_MM * peak_pitch / np.hypot(*moved.T).max()


@dataclass(frozen=True, eq=False)
class Shot:
    """Dots (k, 2) of one frame in random order, with the marker (k,) of each or -1."""

    dots_px: NDArray[np.float64]
    marker: NDArray[np.int64]


def shot(
    rng: np.random.Generator,
    moved_mm: NDArray[np.float64] | float,
    missing: float = 0.05,
    spurious: float = 0.01,
    noise_px: float = 0.1,
) -> Shot:
    """What a detector would make of the moved markers."""
    places = seen_at(moved_mm) + rng.normal(0, noise_px, (len(GRID), 2))
    there = np.flatnonzero(rng.random(len(GRID)) >= missing)
    extra = rng.binomial(len(GRID), spurious)
    false = rng.uniform(REST_PX.min(axis=0), REST_PX.max(axis=0), (extra, 2))
    dots = np.vstack([places[there], false])
    marker = np.concatenate([there, np.full(extra, -1)])
    order = rng.permutation(len(dots))
    return Shot(dots[order], marker[order])
