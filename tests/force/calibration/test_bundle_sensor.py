"""Print and camera read back from a bundle."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from calibration_samples import small_bundle

from gelslim_force.calibration.design import bundle_camera, bundle_grid
from ifem_export.errors import IfemError
from ifem_export.markers.grid import build_marker_grid

ARRAYS = ("positions_mm", "row", "column", "diameter_mm", "kind", "omitted")


def _rounded(corner_mm):
    def contains(points):
        over = np.maximum(np.abs(points) - (6.5 - corner_mm), 0)
        return np.hypot(*over.T) <= corner_mm

    return contains


@pytest.mark.parametrize("anchors", ["odd_sized", "omitted", "none"])
@pytest.mark.parametrize("shape", [(11, 10), (9, 11)])
def test_bundle_tells_the_print(anchors, shape):
    printed = build_marker_grid(*shape, 1.1, 0.45, anchors=anchors).clipped(_rounded(6.0))
    assert len(printed) + len(printed.omitted) < shape[0] * shape[1]
    found = bundle_grid(small_bundle(printed))
    assert found.lattice_shape == printed.lattice_shape
    assert found.pitch_mm == pytest.approx(printed.pitch_mm, rel=1e-12)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(printed, name))


def test_bundle_tells_the_camera():
    grid = build_marker_grid(9, 9, 1.1, 0.45)
    bundle = small_bundle(grid)
    camera = bundle_camera(bundle)
    assert camera.to_record() == {k: bundle.camera[k] for k in camera.to_record()}
    assert bundle_grid(bundle).anchor_sites.tolist() == grid.anchor_sites.tolist()


def test_bundles_without_print_or_camera_are_refused():
    bundle = small_bundle(build_marker_grid(9, 9, 1.1, 0.45))
    with pytest.raises(IfemError, match="markers"):
        bundle_grid(dataclasses.replace(bundle, markers=None))
    arrays = {k: v for k, v in bundle.markers.arrays.items() if k != "kind"}
    bare = dataclasses.replace(bundle.markers, arrays=arrays)
    with pytest.raises(IfemError, match="kind"):
        bundle_grid(dataclasses.replace(bundle, markers=bare))
    moved = dataclasses.replace(bundle.markers, positions_mm=bundle.markers.positions_mm + 0.05)
    with pytest.raises(IfemError, match="site"):
        bundle_grid(dataclasses.replace(bundle, markers=moved))
    with pytest.raises(IfemError, match="camera"):
        bundle_camera(dataclasses.replace(bundle, camera={}))
    with pytest.raises(IfemError, match="focal_px"):
        bundle_camera(dataclasses.replace(bundle, camera={**bundle.camera, "focal_px": -3.0}))
