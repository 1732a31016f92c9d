import numpy as np
import pytest

from gelslim_cad.markers.nodes import nearest_nodes
from gelslim_cad.markers.outline import Outline
from ifem_export.markers.grid import build_marker_grid


@pytest.fixture(scope="module")
def outline():
    return Outline.rounded_rectangle(24.0, 26.0, 3.0)


@pytest.fixture(scope="module")
def grid(outline):
    return build_marker_grid(25, 27, 0.93, 0.4).clipped(outline.contains)


@pytest.fixture(scope="module")
def nodes(grid):
    axis = np.linspace(-12, 12, 43)
    points = np.stack(np.meshgrid(axis, axis, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    return nearest_nodes(grid.positions_mm, points, 100 + np.arange(len(points)))
