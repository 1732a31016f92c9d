"""What changes in the stiffness bundle: pad mesh, element, markers, camera; nothing is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.sight import camera_record
from gelslim_cad.sensor.pad import marker_grid, pad_mesh
from ifem_export.errors import IfemError


@dataclass(frozen=True)
class BundleChange:
    """A block of the bundle that differs, in words before and after."""

    block: str
    before: str
    after: str


def bundle_changes(before: Dimensions, after: Dimensions) -> tuple[BundleChange, ...]:
    """Blocks that differ, in the bundle's order; their words may agree where they moved only."""
    old, new = _blocks(before), _blocks(after)
    return tuple(
        BundleChange(name, old[name][0], new[name][0])
        for name in old
        if not _same(old[name][1], new[name][1])
    )


def _blocks(d: Dimensions) -> dict[str, tuple[str, tuple[Any, ...]]]:
    """Per block its words and the arrays and values it holds."""
    e, nu = d["material.gel.youngs_modulus_mpa"], d["material.gel.poissons_ratio"]
    element = (d["mesh.element"], e, nu, d["material.gel.density_kg_m3"])
    return {
        **_pad(d),
        "element": (f"{element[0]}, E {e:g} MPa, ν {nu:g}", element),
        "camera": _camera(d),
    }


def _pad(d: Dimensions) -> dict[str, tuple[str, tuple[Any, ...]]]:
    # A design that breaks a rule may have no lattice or no mesh; that is a difference too.
    try:
        grid = marker_grid(d)
        markers = (f"{len(grid)} markers", (grid.positions_mm, grid.diameter_mm, list(grid.kind)))
        mesh, _ = pad_mesh(d, grid)
    except IfemError as error:
        return {"mesh": (f"none: {error}", ()), "markers": ("none", ())}
    size = " × ".join(f"{c:.4g}" for c in mesh.cell_size_mm)
    words = f"{mesh.n_elements} elements of {size} mm, {mesh.n_nodes} nodes"
    fill = () if mesh.fill is None else (np.asarray(mesh.fill),)
    return {"mesh": (words, (np.asarray(mesh.nodes_mm), *fill)), "markers": markers}


def _camera(d: Dimensions) -> tuple[str, tuple[Any, ...]]:
    record: dict[str, Any] = dict(camera_record(d))
    x, _, z = record["position_mm"]
    words = f"virtual camera at x {x:.2f}, z {z:.2f} mm, f {record['focal_px']:.1f} px"
    return words, tuple(_leaves(record))


def _leaves(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return [leaf for v in value.values() for leaf in _leaves(v)]
    if isinstance(value, list | tuple):
        return [leaf for v in value for leaf in _leaves(v)]
    return [value]


def _same(first: tuple[Any, ...], second: tuple[Any, ...]) -> bool:
    return len(first) == len(second) and all(map(_equal, first, second))


def _equal(first: Any, second: Any) -> bool:
    a, b = np.asarray(first), np.asarray(second)
    if a.shape != b.shape:
        return False
    if a.dtype.kind in "fi" and b.dtype.kind in "fi":
        return bool(np.allclose(a, b, rtol=1e-9, atol=1e-9, equal_nan=True))
    return bool(np.all(a == b))
