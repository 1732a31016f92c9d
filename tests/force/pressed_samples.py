"""Pictures of a pad under known tractions, for forces without a known shape.

Tractions are given, not solved for: random patches that push and shear within the friction cone.
The pad of the truth has half the pitch and eight layers. What such a mesh has wrong of the motion
near a force, 1 to 2 % of a contact's depth, is taken off: it is that of an endless layer, solved
without cells along the plane (`layer_waves`). Slopes come from splines through the surface, and the
light is that of `shaded_frames`: Lambert's law at 40 degrees over a third of ambient light, red
from -y, green from +y and blue from the tip.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache

import numpy as np
from camera_rig import off_centre_view
from near_forces import NearForces
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline
from sensor_samples import sensor_bundle, sensor_grid
from shaded_frames import AMBIENT, ELEVATION, lines_of_sight, shaded
from synthetic import Frame, moved_rims

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_optics.light.light_map import LightMap, light_arrays
from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.ladder import lumped, refined
from ifem_export.operators.surface_operator import SurfaceOperator, surface_operator

Array = NDArray[np.float64]
FRICTION = 0.6
SIZE_MM = (22.0, 20.5)
CONVERGED_MM, RIM_MM = 1e-5, 0.2
_ROUND = 0.75
"""Exponent of the pressure of a ball: Hertz's is 0.5 on a thick gel, and 1 holds on a very thin
one."""
KINDS = ("disc", "rod", "ring", "tilted", "texture", "edge")
_TIP = 0.4
"""Of the blue light: its slope over that of the others."""


@dataclass(frozen=True, eq=False)
class Pressed:
    """A picture with the forces that it shows."""

    image: NDArray[np.uint8]
    force_n: Array
    """(c, 3) on the nodes of the bundle."""
    wrench: Array
    """(6,) about the origin."""
    moved_mm: Array
    """(c, 3) motion of the nodes of the bundle."""


@cache
def lit_bundle(sources: int = 2) -> Bundle:
    """The sensor with its light: two sides, or also the tip."""
    return replace(sensor_bundle(), light=light_arrays(light_map(sources)))


def light_map(sources: int = 2) -> LightMap:
    """Even light whose effective elevation gives the slope sensitivity of the drawn pictures."""
    steep = (1 - AMBIENT) / np.tan(ELEVATION) * np.array([1.0, 1.0, _TIP])[:sources]
    x, y = (np.linspace(-s / 2, s / 2, 5) for s in SIZE_MM)
    return LightMap(
        x,
        y,
        np.ones((5, 5, sources)),
        np.array([90.0, -90.0, 180.0])[:sources],
        np.degrees(np.arctan(1 / steep)),
        np.eye(3)[:sources],
    )


@cache
def reference() -> Frame:
    """The picture without contact."""
    return shaded(camera=off_centre_view(), seed=5)


@cache
def calibration() -> Calibration:
    """Of the sensor, by that picture."""
    return calibrate(lit_bundle(), reference().image)


@dataclass(frozen=True, eq=False)
class FinePad:
    """A pad of the truth."""

    mesh: PadMesh
    gel: Material
    operator: SurfaceOperator

    @property
    def points_mm(self) -> Array:
        """(n, 3) surface nodes."""
        return np.asarray(self.mesh.surface_mm)

    @property
    def cell_mm2(self) -> float:
        """Area of a cell of the surface."""
        return float(np.prod(self.mesh.cell_size_mm[:2]))

    @cached_property
    def near(self) -> NearForces:
        """What the mesh leaves out near a force."""
        return NearForces(self.mesh, self.gel)

    def displacement(self, force_n: Array) -> Array:
        """Motion (n, 3) of the surface nodes under forces (n, 3) on them.

        Each force is a traction that falls to zero at the next nodes.
        """
        return self.operator.displacement(force_n) + self.near.missing(force_n)

    def by_edges(self, force_n: Array) -> Array:
        """What the pad moves more than an endless one under forces (n, 3)."""
        return self.operator.displacement(force_n) - self.near.endless(force_n)


@lru_cache(maxsize=32)
def fine_pad(thickness: float = 1.0, poissons_ratio: float | None = None) -> FinePad:
    """Half the pitch and eight layers, with a thickness relative to the design."""
    gel = sensor_bundle().material
    if poissons_ratio is not None:
        gel = replace(gel, poissons_ratio=poissons_ratio)
    mesh = refined(sensor_bundle().mesh.stretched(thickness))
    return FinePad(mesh, gel, surface_operator(mesh, gel, "bbar", "pcg"))


def tractions(points_mm: Array, rng: np.random.Generator) -> Array:
    """Tractions (n, 3) in MPa: one or two patches, round or long, with hard or soft rims."""
    total = np.zeros((len(points_mm), 3))
    x0, y0 = rng.uniform(-5, 5, 2)
    for number in range(1 if rng.random() < 0.7 else 2):
        angle, away = rng.uniform(0, np.pi), 5.0 * number
        x = points_mm[:, 0] - x0 - away * np.cos(angle)
        y = points_mm[:, 1] - y0 - away * np.sin(angle)
        along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        half = np.array([rng.uniform(1.3, 3.5), rng.uniform(1.3, 2.5)])
        inside = 1 - (along / half[0]) ** 2 - (across / half[1]) ** 2
        pressure = rng.uniform(0.008, 0.03) * np.maximum(inside, 0) ** rng.choice([0.25, 0.5, 1.0])
        shear, turn = rng.uniform(0, 0.5 * FRICTION), rng.uniform(0, 2 * np.pi)
        twist = rng.uniform(-0.1, 0.1)
        total[:, 0] += pressure * (shear * np.cos(turn) - twist * y)
        total[:, 1] += pressure * (shear * np.sin(turn) + twist * x)
        total[:, 2] -= pressure
    return total


def shaped(seed: int) -> Pressed:
    """The picture of an object of one of the kinds in `KINDS`, which take turns."""
    rng = np.random.default_rng([12, seed])
    kind = KINDS[seed % len(KINDS)]
    return pressed_by(_traction_of(kind, fine_points_mm(), rng), seed)


def _traction_of(kind: str, points_mm: Array, rng: np.random.Generator) -> Array:
    """Tractions (n, 3) in MPa of one object at a random place and angle."""
    reach = np.array([8.5, 8.0]) if kind == "edge" else np.array([5.0, 5.0])
    middle, angle = rng.uniform(-reach, reach), rng.uniform(0, np.pi)
    if kind == "edge":
        side = int(rng.integers(2))
        middle[side] = rng.choice([-1.0, 1.0]) * rng.uniform(reach[side], SIZE_MM[side] / 2)
    x, y = (points_mm[:, :2] - middle).T
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    half = (rng.uniform(3.5, 6.0), rng.uniform(0.9, 1.4)) if kind == "rod" else (3.0, 2.5)
    away = np.sqrt((along / half[0]) ** 2 + (across / half[1]) ** 2)
    pressure = np.maximum(1 - away**2, 0.0) ** rng.choice([0.5, 1.0])
    if kind == "ring":
        pressure = np.maximum(1 - ((away - 0.75) / 0.35) ** 2, 0.0)
    elif kind == "tilted":
        pressure = (away < 1) * np.maximum(0.5 + 0.6 * along / half[0], 0.0)
    elif kind == "texture":
        pressure *= 0.5 + 0.5 * np.cos(2 * np.pi * along / rng.uniform(1.8, 2.6))
    pressure *= rng.uniform(0.012, 0.035)
    shear, turn = rng.uniform(0, 0.5 * FRICTION), rng.uniform(0, 2 * np.pi)
    twist = rng.uniform(-0.1, 0.1)
    tangential = (shear * np.cos(turn) - twist * y, shear * np.sin(turn) + twist * x)
    return np.column_stack([pressure * tangential[0], pressure * tangential[1], -pressure])


def pressed(
    seed: int, *, share: float = 1.0, frame: int = 0, noise: float = 2.5, brightness: float = 1.0
) -> Pressed:
    """The picture of a share of random tractions; frames differ by their noise."""
    traction = share * tractions(fine_points_mm(), np.random.default_rng([11, seed]))
    return pressed_by(traction, seed + 1000 * frame, noise=noise, brightness=brightness)


def pressed_by(
    traction_mpa: Array, seed: int, *, noise: float = 2.5, brightness: float = 1.0
) -> Pressed:
    """The picture of tractions (n, 3) on the finer pad's nodes; the seed is that of its noise."""
    pad = fine_pad()
    force = traction_mpa * pad.cell_mm2
    return drawn(force, pad.displacement(force), seed, noise=noise, brightness=brightness)


def round_patch(
    place_mm: tuple[float, float],
    radius_mm: float,
    pressure_mpa: float,
    shear: tuple[float, float] = (0.0, 0.0),
) -> Array:
    """Tractions (n, 3) of a round patch whose dent is that of a ball to 1 % of its depth.

    Args:
        place_mm: Its middle.
        radius_mm: Its radius.
        pressure_mpa: Pressure in the middle.
        shear: Tangential traction over the pressure, along x and y.
    """
    away = (fine_points_mm()[:, :2] - place_mm) / radius_mm
    pressure = pressure_mpa * np.maximum(1 - (away**2).sum(axis=1), 0.0) ** _ROUND
    return pressure[:, None] * np.array([*shear, -1.0])


def fine_points_mm() -> Array:
    """(n, 3) surface nodes of the finer pad."""
    return fine_pad().points_mm


@cache
def _sight() -> tuple[Array, Array]:
    return lines_of_sight(off_centre_view())


def _material(splines: list[RectBivariateSpline]) -> Array:
    """(n, 2) places at rest of what the pixels see, by iteration to convergence.

    Pixels at the rim may alternate between the pad and what is beside it, and those beside it are
    not looked at.
    """
    rest, lean = _sight()
    material, left = rest.copy(), np.arange(len(rest))
    for _ in range(20):
        u, v, w = (s.ev(*material[left].T) for s in splines)
        found = rest[left] + lean[left] * w[:, None] - np.column_stack([u, v])
        off = np.abs(found - material[left]).max(axis=1)
        material[left] = found
        left = left[off > CONVERGED_MM]
    rim = (np.array(SIZE_MM) / 2 - np.abs(material[left])).min(axis=1)
    far = np.abs(material[left] - rest[left]).max(initial=0.0)
    assert (rim < RIM_MM + far).all()
    return material


def drawn(
    force_n: Array, moved_mm: Array, seed: int, *, noise: float = 2.5, brightness: float = 1.0
) -> Pressed:
    """The picture of a motion (n, 3) of the finer pad's nodes under forces (n, 3)."""
    mesh, points = fine_pad().mesh, fine_pad().points_mm
    splines = surface_splines(points, moved_mm)
    material = _material(splines)
    inside = np.flatnonzero((np.abs(material) < np.array(SIZE_MM) / 2).all(axis=1))
    slopes = np.zeros((2, len(material)))
    for slope, order in zip(slopes, ((1, 0), (0, 1)), strict=True):
        slope[inside] = splines[2].ev(*material[inside].T, *order)

    def motion(places_mm: Array) -> Array:
        return np.column_stack([s.ev(*places_mm.T) for s in splines])

    frame = shaded(
        (slopes[0], slopes[1]),
        noise=noise,
        seed=seed + 100,
        moved_mm=moved_rims(motion, sensor_grid()),
        brightness=brightness,
        camera=off_centre_view(),
    )
    wrench = np.concatenate([force_n.sum(axis=0), np.cross(points, force_n).sum(axis=0)])
    nodes = np.asarray(sensor_bundle().mesh.surface_mm)[:, :2]
    return Pressed(
        frame.image,
        lumped(force_n, mesh, sensor_bundle().mesh),
        wrench,
        motion(nodes),
    )


def surface_splines(points_mm: Array, moved_mm: Array) -> list[RectBivariateSpline]:
    """Splines of a motion (n, 3) through the nodes (n, 3) of a lattice."""
    x, y = (np.unique(np.round(points_mm[:, k], 9)) for k in (0, 1))
    filled = np.zeros((3, len(x), len(y)))
    places = zip(np.round(points_mm[:, :2], 9).T, (x, y), strict=True)
    row, column = (np.searchsorted(axis, at) for at, axis in places)
    filled[:, row, column] = moved_mm.T
    return [RectBivariateSpline(x, y, part, kx=3, ky=3) for part in filled]
