"""Whether a casting comes out of its mould along a straight line."""

from __future__ import annotations

import cadquery as cq
import numpy as np

from gelslim_cad.export.patch import face_patches

LINEAR_MM = 0.02
ANGLE_DEG = 5.0
SLOPE = 1e-4
"""Walls inclined by less than this (0.006°) count as parallel to the pull."""
OPENING_MM = 1e-6


def undercut_area_mm2(
    casting: cq.Shape, pull: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> float:
    """Area (mm²) of the casting's surface that is undercut when the casting is pulled out.

    The casting fills the cavity, whose opening is the plane farthest along `pull`. A surface whose
    outward normal has a component along `pull` lies under a part of the mould, unless it is the
    opening itself. The surface is sampled on a mesh within 0.02 mm, with the exact normals of the
    CAD faces: the facets of an upright cylinder may be inclined although the cylinder is not.
    """
    axis = np.asarray(pull, dtype=float)
    axis = axis / np.linalg.norm(axis)
    patches = face_patches(casting, LINEAR_MM, ANGLE_DEG)
    corners = np.concatenate([p.nodes_mm[p.triangles] for p in patches])
    normals = np.concatenate([p.normals[p.triangles].mean(axis=1) for p in patches])
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    height = corners @ axis
    opening = height.min(axis=1) >= height.max() - OPENING_MM
    inclined = normals @ axis > SLOPE
    return float(area[inclined & ~opening].sum())
