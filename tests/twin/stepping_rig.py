"""Small sensors on disk, closed meshes, and motions for the tests of steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from contact_pads import small_pad
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_twin.stepping.twin import Twin
from ifem_export.bundle.files import write_bundle

Array = NDArray[np.float64]
LINEAR = {"nonlinearity": "off"}
DT_S = 0.002


def pad_folder(folder: Path, **pad: float) -> Path:
    """The bundle of a square pad without camera; see `contact_pads.small_pad`."""
    write_bundle(folder / "pad", small_pad(**pad))  # type: ignore[arg-type]
    return folder / "pad"


def linear_twin(bundle: Path, force: str = "0.2%", friction: float = 0.0) -> Twin:
    """A twin with a linear gel."""
    return Twin(bundle, tolerance={"force": force}, friction=friction, effects=LINEAR)


def at(x: float, y: float, z: float, turn: Rotation | None = None) -> Array:
    """A rigid motion (4, 4)."""
    found = np.eye(4)
    found[:3, 3] = x, y, z
    if turn is not None:
        found[:3, :3] = turn.as_matrix()
    return found


def turned(axis: str, degrees: float) -> Rotation:
    """A rotation about a coordinate axis."""
    return Rotation.from_euler(axis, degrees, degrees=True)


def box_facets(length: float, width: float, height: float) -> Array:
    """Facets (12, 3, 3) of a box about the origin, seen from outside anticlockwise."""
    half = np.array([length, width, height]) / 2
    corners = half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    facets = [corners[[q[0], q[k], q[k + 1]]] for q in quads for k in (1, 2)]
    return np.array(facets)


def ball_facets(radius: float, rings: int = 40) -> Array:
    """Facets of a ball by latitude and longitude."""
    theta, phi = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1)
    phi[-1] = 0.0
    ring = np.sin(theta)
    ring[0] = ring[-1] = 0.0
    points = radius * np.stack(
        [np.outer(ring, np.cos(phi)), np.outer(ring, np.sin(phi)),
         np.outer(np.cos(theta), np.ones_like(phi))], axis=2
    )  # fmt: skip
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    lower = np.stack([a, b, c], axis=2)[:-1].reshape(-1, 3, 3)
    upper = np.stack([a, c, d], axis=2)[1:].reshape(-1, 3, 3)
    return np.concatenate([lower, upper])


def write_stl(path: Path, facets: Array) -> Path:
    """A binary STL file."""
    rows = np.zeros(len(facets), dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    rows["c"] = facets
    path.write_bytes(bytes(80) + len(facets).to_bytes(4, "little") + rows.tobytes())
    return path
