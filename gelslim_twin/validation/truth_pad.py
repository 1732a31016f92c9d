"""The pad that makes the frames: finer through the thickness than the pipeline's own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.mesh.pad_mesh import PadMesh

LAYERS = 8


def truth_pad(bundle: Bundle) -> Bundle:
    """The bundle's pad in eight layers of B-bar cells on the same surface nodes.

    Crowned or weighted pads come back as they are: their layers are not free to choose.
    """
    mesh = bundle.mesh
    uniform = mesh.fill is None and mesh.surface_shift is None
    if not uniform or mesh.layers >= LAYERS:
        return bundle
    hx, hy, hz = mesh.cell_size_mm
    plan = np.asarray(mesh.occupancy)[:, :, :1]
    cells = np.ascontiguousarray(np.repeat(plan, LAYERS, axis=2))
    finer = PadMesh.from_occupancy(cells, (hx, hy, hz * mesh.layers / LAYERS), mesh.origin_mm)
    made = build_bundle(finer, bundle.material, "bbar", with_stiffness=False)
    return replace(made, camera=bundle.camera, spec_hash=bundle.spec_hash)
