"""Pictures of the deep contacts, in the light of a guide, on sensors as they are built.

The renderer is that of the tests; dots are strained with the surface, and slopes are those of the
deformed surface. Modulus and gain of the light are drawn within the tolerances of `sigma_cases`,
and so were thickness and Poisson's ratio when the contacts were solved. What the mesh leaves out
of the motion near the forces is added, by the linear law.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np
from camera_rig import off_centre_view
from deep_contacts import DeepContact, deep_contact, finer_pad
from guided_light import guided_bundle, irradiance
from near_forces import NearForces
from numpy.typing import NDArray
from pressed_samples import Pressed, calibration, surface_splines
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import map_coordinates
from sensor_samples import sensor_bundle, sensor_grid
from shaded_frames import lines_of_sight, shaded
from sigma_cases import LIGHT_GAIN, MODULUS_SIGMA, with_tolerances
from synthetic import moved_rims
from traced_light import traced_bundle, traced_irradiance

from gelslim_force.calibration.sensor_calibration import Calibration
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import lumped

Array = NDArray[np.float64]
Light = Literal["guided", "traced", "one direction"]
"""What the bundle knows of the light: the directions that are drawn; those of another trace than
the one that is drawn; or of such a trace the mean directions alone."""
CELL_MM, HALF_MM = 0.1, (12.0, 11.3)
_ROUNDS = 8


@cache
def deep_bundle(designed_ratio: float, light: Light = "guided") -> Bundle:
    """The sensor as designed, with the tolerances of its gel."""
    if light == "guided":
        return with_tolerances(guided_bundle(designed_ratio))
    return with_tolerances(traced_bundle(designed_ratio, fans=light == "traced"))


def deep_calibration() -> Calibration:
    """Of both sensors: it does not depend on the gel."""
    return calibration()


def deep_picture(seed: int, light: Light = "guided") -> Pressed:
    """A stored contact as a camera without noise sees it, with forces for the modulus drawn."""
    rng = np.random.default_rng([42, seed])
    young, gain = np.exp(rng.normal(0, (MODULUS_SIGMA, LIGHT_GAIN)))
    contact = deep_contact(seed)
    mesh = finer_pad(contact.case.thickness)
    points = np.asarray(mesh.surface_mm)
    gel = replace(sensor_bundle().material, poissons_ratio=contact.case.poissons_ratio)
    missing = NearForces(mesh, gel).missing(contact.force_n)
    splines = surface_splines(points, contact.moved_mm + missing)

    def motion(places_mm: Array) -> Array:
        return np.column_stack([s.ev(*places_mm.T) for s in splines])

    frame = shaded(
        change=_change(contact, splines, light).reshape(480, 640, 3),
        noise=0.0,
        moved_mm=moved_rims(motion, sensor_grid()),
        camera=off_centre_view(),
        light_gain=np.full(3, gain),
    )
    force = young * contact.force_n
    rest = points * [1.0, 1.0, 0.0]
    wrench = np.concatenate([force.sum(axis=0), np.cross(rest, force).sum(axis=0)])
    nodes = np.asarray(sensor_bundle().mesh.surface_mm)[:, :2]
    on_nodes = lumped(force, finer_pad(), sensor_bundle().mesh)
    return Pressed(frame.image, on_nodes, wrench, motion(nodes))


def _change(contact: DeepContact, splines: list[RectBivariateSpline], light: Light) -> Array:
    """Light (n, 3) over that of the level surface at what the pixels see."""
    axes = [np.arange(-half, half + CELL_MM / 2, CELL_MM) for half in HALF_MM]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=2)
    shape, flat = places.shape[:2], places.reshape(-1, 2)
    material = flat.copy()
    for _ in range(_ROUNDS):  # which point of the gel is now at a place
        material = flat - np.column_stack([s.ev(*material.T) for s in splines[:2]])
    height = splines[2].ev(*material.T).reshape(shape)
    slope_x, slope_y = np.gradient(height, CELL_MM)
    drawn = irradiance if light == "guided" else traced_irradiance
    lit = drawn(height, (slope_x, slope_y), CELL_MM)
    rest, lean = lines_of_sight(off_centre_view())
    low = np.array([axis[0] for axis in axes])
    seen = rest.copy()
    for _ in range(_ROUNDS):  # where the lines of sight meet the deformed surface
        seen = rest + lean * map_coordinates(height, ((seen - low) / CELL_MM).T, order=1)[:, None]
    at = ((seen - low) / CELL_MM).T
    channels = [map_coordinates(lit[:, :, k], at, order=1, mode="nearest") for k in range(3)]
    return np.column_stack(channels)
