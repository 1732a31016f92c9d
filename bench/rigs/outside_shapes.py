"""Rigid shapes pressed deeply into neo-Hookean gels that the force pipeline does not have.

Shapes, depths, friction and drag are drawn as for the deep contacts of tests/force, whose Newton
method solves them on half the pitch; what such a mesh has wrong of the motion near a force is taken
off. The gel ends so far from the contact that its edge does not
move, so that the motion may be put anywhere on a pad that is as far from its edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.bench_data import see_tests
from bench.rigs.outside_contacts import (
    LEAST_N,
    OutsideContact,
    OutsidePads,
    contact_wrench,
    pressure_centre,
)

see_tests("force")

from deep_contacts import (  # noqa: E402
    KINDS,
    THICKNESS_MM,
    DeepCase,
    DeepContact,
    deep_case,
    finer_pad,
    solve,
)
from near_forces import NearForces  # noqa: E402
from pressed_samples import surface_splines  # noqa: E402
from sensor_samples import sensor_bundle  # noqa: E402

Array = NDArray[np.float64]
_FIRST = 1000
"""Seeds from here on are not those of the tests."""
_PLACES_MM = 5.0
_STILL = 0.03
"""Largest motion of the gel's edge over the depth."""


@dataclass(frozen=True, eq=False)
class OutsideShapes:
    """Contacts of rigid shapes on the finger of some pads.

    Attributes:
        pads: Whose gels these are.
        folder: Where solved contacts are kept.
    """

    pads: OutsidePads
    folder: Path

    def shape(self, number: int) -> OutsideContact:
        """The contact of a number; kinds take turns, all else is drawn.

        Contacts that are too weak, or so wide that the edge of the gel moves, are drawn again.
        """
        for attempt in range(100):
            case = self._case(number, attempt)
            contact = self._solved(f"{number}_{attempt}", case)
            push_n = -self._modulus(number) * contact.force_n[:, 2].sum()
            if push_n >= LEAST_N and edge_motion(contact) < _STILL:
                return self._placed(number, contact)
        raise AssertionError("no contact of sufficient force in a hundred draws")

    def _case(self, number: int, attempt: int) -> DeepCase:
        """One in the middle of the pad, on the gel of the number."""
        gel = self.pads.gel(number)
        seed = _FIRST + len(KINDS) * (100 * number + attempt) + number % len(KINDS)
        case = deep_case(seed)
        thickness = gel.thickness_mm / THICKNESS_MM
        return replace(
            case, poissons_ratio=gel.poissons_ratio, thickness=thickness, place_mm=(0.0, 0.0)
        )

    def _solved(self, name: str, case: DeepCase) -> DeepContact:
        path = self.folder / f"shape_{name}.npz"
        if not path.exists():
            found = solve(case)
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh = path.with_suffix(".new.npz")
            np.savez_compressed(fresh, moved=found.moved_mm, force=found.force_n)
            fresh.replace(path)
        with np.load(path) as kept:
            return DeepContact(case, kept["moved"], kept["force"])

    def _modulus(self, number: int) -> float:
        """That of the gel over the one that contacts are solved for."""
        return self.pads.gel(number).young_mpa / sensor_bundle().material.youngs_modulus_mpa

    def _placed(self, number: int, contact: DeepContact) -> OutsideContact:
        mesh = finer_pad(contact.case.thickness)
        points = np.asarray(mesh.surface_mm)
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        ratio = contact.case.poissons_ratio
        material = replace(sensor_bundle().material, poissons_ratio=ratio)
        missing = NearForces(mesh, material).missing(contact.force_n)
        splines = surface_splines(points, contact.moved_mm + missing)
        place = np.random.default_rng([66, number]).uniform(-_PLACES_MM, _PLACES_MM, 2)

        def motion(places_mm: Array) -> Array:
            at = places_mm - place
            inside = ((at >= low) & (at <= high)).all(axis=1)
            found = np.zeros((len(at), 3))
            found[inside] = np.column_stack([s.ev(*at[inside].T) for s in splines])
            return found

        force, there = self._modulus(number) * contact.force_n, points + np.append(place, 0.0)
        return OutsideContact(
            f"shape {number}: {contact.case.kind}",
            motion,
            contact_wrench(there, force),
            pressure_centre(there, force),
            number,
            "neo_hookean",
        )


def edge_motion(contact: DeepContact) -> float:
    """Largest motion of the gel's edge over the largest of all."""
    points = np.asarray(finer_pad(contact.case.thickness).surface_mm)[:, :2]
    edge = ((points == points.min(axis=0)) | (points == points.max(axis=0))).any(axis=1)
    moved = np.abs(contact.moved_mm)
    return float(moved[edge].max() / moved.max())
