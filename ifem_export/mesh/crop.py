"""Which cells of a cropped lattice hold together, and what was dropped."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ifem_export.errors import MeshError


@dataclass(frozen=True)
class DroppedPart:
    """A group of cells that is not face-connected to the kept part.

    Args:
        n_cells: its size.
        touches: how it touches the kept part: "edge", "vertex" or "nothing". Two parts joined
            by an edge or a vertex only would hinge there without any stiffness.
        bonded: whether it has cells on the bonded face.
    """

    n_cells: int
    touches: str
    bonded: bool


@dataclass(frozen=True)
class CropReport:
    """What cropping the lattice to the outline did.

    Args:
        n_cells_inside: cells whose centre is inside the outline.
        n_cells_kept: cells of the largest face-connected part that reaches the bonded face.
        dropped: the other parts, largest first.
        outline_area_mm2: exact area of the outline.
        mesh_area_mm2: area of the kept cells seen from above.
        aligned_points: how many of the points to align with fall on surface nodes.
        alignment_error_mm: largest distance of such a point, along an axis, from the nearest
            lattice line (0 without alignment).
    """

    n_cells_inside: int
    n_cells_kept: int
    dropped: tuple[DroppedPart, ...]
    outline_area_mm2: float
    mesh_area_mm2: float
    aligned_points: int = 0
    alignment_error_mm: float = 0.0

    @property
    def area_error(self) -> float:
        """Relative error of the meshed area, (mesh - outline) / outline."""
        return (self.mesh_area_mm2 - self.outline_area_mm2) / self.outline_area_mm2


def keep_bonded_part(
    occupancy: NDArray[np.bool_],
) -> tuple[NDArray[np.bool_], tuple[DroppedPart, ...]]:
    """Keep the largest face-connected part that reaches the bonded face (lowest layer).

    Args:
        occupancy: (nx, ny, nz) bool.

    Returns:
        The occupancy of the kept part and the parts left out, largest first. Of equally large
        parts the first in lattice order is kept.

    Raises:
        MeshError: no cell lies on the bonded face.
    """
    labels, n_parts = ndimage.label(occupancy, ndimage.generate_binary_structure(3, 1))
    sizes = np.bincount(labels.ravel(), minlength=n_parts + 1)
    bonded = np.unique(labels[:, :, 0])
    bonded = bonded[bonded > 0]
    if len(bonded) == 0:
        raise MeshError(
            "no cell lies on the bonded face: use a finer pitch or check the outline against "
            "the lattice"
        )
    winner = int(bonded[np.argmax(sizes[bonded])])
    kept = labels == winner
    others = [label for label in range(1, n_parts + 1) if label != winner]
    if not others:
        return kept, ()
    by_edge = ndimage.binary_dilation(kept, ndimage.generate_binary_structure(3, 2))
    by_vertex = ndimage.binary_dilation(kept, ndimage.generate_binary_structure(3, 3))
    edge_labels = set(np.unique(labels[by_edge]).tolist())
    vertex_labels = set(np.unique(labels[by_vertex]).tolist())
    bonded_labels = set(bonded.tolist())
    parts = [
        DroppedPart(
            int(sizes[label]),
            "edge" if label in edge_labels else "vertex" if label in vertex_labels else "nothing",
            label in bonded_labels,
        )
        for label in others
    ]
    return kept, tuple(sorted(parts, key=lambda part: -part.n_cells))
