"""Contacts of known force on pads that the force pipeline does not have, for outside renderers.

The finger is `gelslim2`. Forces are given tractions on a pad of half the pitch and eight layers,
without what such a mesh has wrong near a force, or balls whose contact is solved by axisymmetric
finite elements with shear by given tractions; both come from tests/force. Modulus, thickness and
Poisson's ratio are drawn within the tolerances that the bundle states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import see_tests
from ifem_export.bundle.bundle import Bundle
from ifem_export.operators.ladder import refined
from ifem_export.operators.surface_operator import surface_operator

see_tests("force")

from ball_motion import Motion, ball_motion, round_share, through  # noqa: E402
from pressed_disc import PressedDisc, pressed_disc  # noqa: E402
from pressed_samples import FRICTION, FinePad, tractions  # noqa: E402

Array = NDArray[np.float64]
GELS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
"""Thickness and Poisson's ratio of the built gels, in standard deviations."""
CALIBRATION_BALL_MM = 8.0
_RADII_MM, LEAST_N = (4.0, 5.0, 6.35, 8.0), 0.2
_SIZES, _PLACES_MM = (0.4, 1.3), 5.0


@dataclass(frozen=True, eq=False)
class OutsideContact:
    """A contact with what it does to the gel.

    Attributes:
        name: Kind and number.
        motion: Places (n, 2) at rest to motions (n, 3) of the surface in mm.
        wrench: (6,) force in N and torque about the origin in N mm, on the gel.
        centre_mm: (2,) centre of pressure.
        gel: Number of its gel, see `OutsidePads.gel`.
        law: That of the gel: `linear` or `neo_hookean`.
    """

    name: str
    motion: Motion
    wrench: Array
    centre_mm: Array
    gel: int
    law: str = "linear"


@dataclass(frozen=True, eq=False)
class OutsidePads:
    """The pads of the truth of a sensor."""

    bundle: Bundle

    def press(self, seed: int) -> OutsideContact:
        """Random tractions: one or two patches that push, shear and twist."""
        for attempt in range(100):
            rng = np.random.default_rng([61, seed, attempt])
            gel = self.gel(seed)
            size = np.exp(rng.uniform(*np.log(_SIZES)))
            points = gel.points_mm
            force = tractions(points, rng) * gel.pad.cell_mm2 * size
            if -force[:, 2].sum() >= LEAST_N:
                return OutsideContact(
                    f"press {seed}",
                    gel.motion(force),
                    contact_wrench(points, force),
                    pressure_centre(points, force),
                    seed,
                )
        raise AssertionError("no contact of sufficient force in a hundred draws")

    def ball(self, seed: int) -> OutsideContact:
        """A ball that pushes, sticking or not, and shears by friction.

        The motion under the push is that of an endless layer, and what the edges of the pad add.
        """
        gel = self.gel(seed)
        rng = np.random.default_rng([62, seed])
        radius = float(rng.choice(_RADII_MM))
        disc = pressed_disc(radius, gel.thickness_mm, gel.poissons_ratio, bool(rng.random() < 0.5))
        least = np.interp(LEAST_N / gel.young_mpa, disc.force_n, disc.contact_mm)
        largest = min(2.8, float(np.sqrt(2 * radius * 0.3 * gel.thickness_mm)))
        contact, place = rng.uniform(max(1.2, least), largest), rng.uniform(-6, 6, 2)
        push = gel.young_mpa * float(np.interp(contact, disc.contact_mm, disc.force_n))
        share = round_share(gel.points_mm, place, contact)
        turn, friction = rng.uniform(0, 2 * np.pi), rng.uniform(0, FRICTION)
        shear = friction * push * np.array([np.cos(turn), np.sin(turn)])
        sheared = gel.motion(np.outer(share, [*shear, 0.0]))
        pressed = ball_motion(disc, gel.pad, place, push, gel.young)

        def motion(places_mm: Array) -> Array:
            return pressed(places_mm) + sheared(places_mm)

        force = np.array([*shear, -push])
        wrench = np.concatenate([force, np.cross([*place, 0.0], force)])
        return OutsideContact(f"ball {seed}", motion, wrench, place, seed)

    def calibration_press(self, number: int) -> OutsideContact:
        """A ball of `CALIBRATION_BALL_MM` pressed straight down in a quarter of the gel.

        The elements are linear: their surface has the shape of the ball by its places at rest, and
        is drawn towards the middle by some percent. The ball that they have is therefore larger by
        twice as much, so that the surface as it is seen has the size of the ball.
        """
        gel, rng = self.gel(0), np.random.default_rng([63, number])
        contact = rng.uniform(1.2, 2.1)
        radius = CALIBRATION_BALL_MM / 2
        for _ in range(2):
            disc = pressed_disc(round(radius, 3), gel.thickness_mm, gel.poissons_ratio)
            stretch = 1 + _strain(disc, contact)
            radius = CALIBRATION_BALL_MM / 2 / stretch**2
        push = gel.young_mpa * float(np.interp(contact, disc.contact_mm, disc.force_n))
        quarter = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])[number % 4]
        place = quarter * rng.uniform(1.0, 8.0, 2)
        wrench = np.array([0, 0, -push, -push * place[1], push * place[0], 0])
        motion = ball_motion(disc, gel.pad, place, push, gel.young)
        return OutsideContact(f"calibration {number}", motion, wrench, place, 0)

    def gel(self, seed: int) -> BuiltGel:
        """The gel of a contact; four thicknesses and ratios take turns, the modulus is drawn."""
        tolerances = self.bundle.tolerances
        sigma = tolerances["youngs_modulus_mpa"] / self.bundle.material.youngs_modulus_mpa
        young = float(np.exp(sigma * np.random.default_rng([64, seed]).normal()))
        return replace(_built_gel(self.bundle, seed % len(GELS)), young=young)


@dataclass(frozen=True, eq=False)
class BuiltGel:
    """A gel on a mesh of half the pitch; its modulus is `young` times the design's.

    Attributes:
        pad: Mesh, material and how it yields, for the modulus of the design.
        thickness_mm: Its thickness.
        young: Modulus over that of the design.
    """

    pad: FinePad
    thickness_mm: float
    young: float = 1.0

    @property
    def young_mpa(self) -> float:
        """Young's modulus."""
        return self.young * self.pad.gel.youngs_modulus_mpa

    @property
    def poissons_ratio(self) -> float:
        """Poisson's ratio."""
        return self.pad.gel.poissons_ratio

    @property
    def points_mm(self) -> Array:
        """(n, 3) surface nodes."""
        return self.pad.points_mm

    def motion(self, force_n: Array) -> Motion:
        """Motion of the surface under forces (n, 3) on its nodes."""
        return through(self.pad, self.pad.displacement(force_n / self.young))


@cache
def _built_gel(bundle: Bundle, number: int) -> BuiltGel:
    thicker, softer = GELS[number]
    designed = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    thickness = designed + thicker * bundle.tolerances["thickness_mm"]
    ratio = bundle.material.poissons_ratio + softer * bundle.tolerances["poissons_ratio"]
    mesh = refined(bundle.mesh.stretched(thickness / designed))
    gel = replace(bundle.material, poissons_ratio=ratio)
    return BuiltGel(FinePad(mesh, gel, surface_operator(mesh, gel, "bbar", "pcg")), thickness)


def _strain(disc: PressedDisc, contact_mm: float) -> float:
    """Mean of the radial motion over the radius within a contact, by area."""
    state = int(np.argmin(np.abs(disc.contact_mm - contact_mm)))
    inside = (disc.r_mm > 0) & (disc.r_mm <= disc.contact_mm[state])
    r = disc.r_mm[inside]
    return float(np.average(disc.outward_mm[state][inside] / r, weights=r))


def contact_wrench(points_mm: Array, force_n: Array) -> Array:
    rest = points_mm * [1.0, 1.0, 0.0]
    return np.concatenate([force_n.sum(axis=0), np.cross(rest, force_n).sum(axis=0)])


def pressure_centre(points_mm: Array, force_n: Array) -> Array:
    push = force_n[:, 2]
    return np.asarray((points_mm[:, :2] * push[:, None]).sum(axis=0) / push.sum())
