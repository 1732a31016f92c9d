"""From a drawn frame to depth, motion and push, against the layer's exact solution."""

from __future__ import annotations

import numpy as np
import pytest
from pad_samples import depth_sigma_mm, node_forces_n
from shaded_frames import CAMERA, PAD_MM, contact, pressed_heights, shaded

from gelslim_force.contact.indenter import Sphere
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch_finder import PatchFinder
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.surface_operator import surface_operator

BALL = Sphere(10.0)


@pytest.mark.slow
def test_depth_and_push_of_drawn_presses():
    cells = (44, 42, 4)
    mesh = PadMesh.from_occupancy(
        np.ones(cells, dtype=bool), (0.5, 0.5, 0.5), (-PAD_MM[0], -PAD_MM[1], -2.0)
    )
    operator = surface_operator(mesh, Material(0.147, 0.48, 1000.0), "bbar", "pcg")
    nodes = mesh.nodes_mm[mesh.surface]
    model = NormalModel(operator, nodes)
    still = shaded(seed=0)
    finder = PatchFinder(
        CAMERA,
        still.image,
        still.centres_px,
        marker_radius_px=still.diameter_px / 2,
        surface_mm=nodes,
        indenter=BALL,
    )
    off = []
    for k, (radius, centre) in enumerate(
        [(1.8, (2.0, 1.0)), (2.4, (-3.0, 2.5)), (3.0, (1.0, -4.0)), (2.4, (0.1, 0.2))]
    ):
        sx, sy, _ = pressed_heights(centre, radius, 10.0)
        patch = finder.find(shaded((sx, sy), seed=60 + k, noise=4.0).image)
        motion = model.motion(patch, BALL)
        truth = contact(radius, 10.0)
        r = np.hypot(*(nodes[:, :2] - centre).T)
        exact = np.where(r < radius, BALL.profile(r, 0 * r) - truth.depth_mm, -truth.sinking(r))
        sigma = depth_sigma_mm(model, motion, patch.centre_mm)
        assert abs(motion.depth_mm - truth.depth_mm) < 3 * sigma
        assert sigma < 0.12 * truth.depth_mm
        error = np.linalg.norm(motion.w_mm - exact) / np.linalg.norm(exact)
        paper = model.cap_only(patch, BALL).w_mm
        assert error < 0.1
        assert np.linalg.norm(paper - exact) / np.linalg.norm(exact) > 2 * error
        push = node_forces_n(model, motion).sum()
        off.append([motion.depth_mm / truth.depth_mm - 1, push / truth.force_n - 1])
    assert np.abs(off).max() < 0.12
    assert np.abs(np.mean(off, axis=0)).max() == pytest.approx(0, abs=0.06)
