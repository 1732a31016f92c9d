"""Mass, centre of mass and inertia of solids and of what is made of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.materials import MATERIALS, density_g_cm3, material_of
from gelslim_cad.geometry.part import Part

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
UNKNOWN_G_CM3 = 1.2
"""Density of a part whose material is in no table: a solid plastic. Assumed."""
KG_PER_MM3 = 1e-6
"""Of 1 g/cm³."""


@dataclass(frozen=True)
class MassProperties:
    """Mass properties in SI units.

    Attributes:
        mass_kg: Mass.
        centre_m: Centre of mass (3,).
        inertia_kg_m2: Inertia tensor (3, 3) about the centre of mass, along the axes of the frame
            that `centre_m` is in.
    """

    mass_kg: float
    centre_m: Vector
    inertia_kg_m2: Matrix

    def moved(self, by_m: Vector) -> MassProperties:
        """The same body in a frame whose origin is moved by -`by_m`."""
        return MassProperties(self.mass_kg, self.centre_m + by_m, self.inertia_kg_m2)

    def without_noise(self) -> MassProperties:
        """The same without the last bits, in which a symmetric part may differ from run to run."""
        return MassProperties(
            self.mass_kg,
            self.centre_m.round(12) + 0.0,
            self.inertia_kg_m2.round(16) + 0.0,
        )

    def principal(self) -> tuple[Vector, Matrix]:
        """Principal moments (3,), rising, and a right-handed rotation (3, 3) of their axes.

        The largest component of the first two axes is positive, so that signs are the same on
        every machine.
        """
        moments, axes = np.linalg.eigh(self.inertia_kg_m2)
        largest = np.abs(axes).argmax(axis=0)
        axes = axes * np.sign(axes[largest, range(3)])
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return moments, axes


def mass_properties(solid: Any, density_g_cm3: float) -> MassProperties:
    """Mass properties of a solid in mm, by the exact integrals of the CAD kernel (OCCT)."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid.wrapped, found)
    centre, moments = found.CentreOfMass(), found.MatrixOfInertia()
    tensor = np.array([[moments.Value(i, k) for k in (1, 2, 3)] for i in (1, 2, 3)])
    scale = density_g_cm3 * KG_PER_MM3
    return MassProperties(
        found.Mass() * scale,
        np.array([centre.X(), centre.Y(), centre.Z()]) * 1e-3,
        tensor * scale * 1e-6,
    )


def combined_mass(bodies: Iterable[MassProperties]) -> MassProperties:
    """Mass properties of several bodies that move together, by the parallel-axis theorem."""
    each = tuple(bodies)
    mass = sum(b.mass_kg for b in each)
    centre = np.sum([b.mass_kg * b.centre_m for b in each], axis=0) / mass
    inertia = np.zeros((3, 3))
    for body in each:
        r = body.centre_m - centre
        inertia += body.inertia_kg_m2 + body.mass_kg * (r @ r * np.eye(3) - np.outer(r, r))
    return MassProperties(mass, centre, inertia).without_noise()


@dataclass(frozen=True)
class PartMass:
    """Mass of one part and where its density comes from."""

    name: str
    properties: MassProperties
    density_g_cm3: float
    source: str
    assumed: bool


def part_mass(part: Part, gel_density_kg_m3: float) -> PartMass:
    """Mass properties of a part in the sensor frame, with the source of its density."""
    density = density_g_cm3(part, gel_density_kg_m3)
    material = material_of(part)
    if density is None:
        density, source, assumed = UNKNOWN_G_CM3, "no table has this material", True
    elif part.density_g_cm3 is not None:
        source, assumed = "given with the part", False
    elif part.name == "gel_pad":
        source, assumed = "material.gel.density_kg_m3", False
    else:
        assert material is not None
        source, assumed = MATERIALS[material].source, MATERIALS[material].assumed
    return PartMass(part.name, mass_properties(part.solid, density), density, source, assumed)
