"""Areas of the surface nodes on pads whose cells are not square."""

from __future__ import annotations

import numpy as np
import pytest

from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.mesh.surface_lattice import surface_share_mm2


@pytest.mark.parametrize(("hx", "hy"), [(0.5, 0.8), (0.9, 0.3), (0.4, 0.4)])
def test_a_node_has_a_quarter_of_every_cell_around_it(hx: float, hy: float) -> None:
    cells = np.ones((5, 3, 2), dtype=bool)
    cells[4, 2] = False
    mesh = PadMesh.from_occupancy(cells, (hx, hy, 0.7), (0.0, 0.0, -1.4))
    share = surface_share_mm2(mesh)
    x, y = mesh.nodes_mm[mesh.surface, :2].T
    counts = np.array(
        [
            sum(
                abs(cx - at_x) < hx and abs(cy - at_y) < hy
                for cx, cy in (np.argwhere(cells[:, :, 1]) + 0.5) * (hx, hy)
            )
            for at_x, at_y in zip(x, y, strict=True)
        ]
    )
    assert set(counts) == {1, 2, 3, 4}
    assert share == pytest.approx(counts * hx * hy / 4)


def test_the_areas_of_a_long_thin_pad_sum_to_its_outline() -> None:
    outline = RoundedRectangle(24.0, 4.2)
    mesh, _ = build_pad_mesh(outline, 1.5, pitch_mm=(0.8, 0.6), layers=2)
    share = surface_share_mm2(mesh)
    assert share.sum() == pytest.approx(24.0 * 4.2)
    assert share.max() == pytest.approx(0.48)
