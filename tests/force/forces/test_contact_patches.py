"""Separate contacts of a field: which nodes, which force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.contact_patches import contact_patches
from gelslim_force.forces.frame_result import ForceField

PICTURE = np.array(
    [
        [1, 1, 0, 0, 0],
        [1, 0, 0, 0, 1],
        [0, 1, 0, 0, 1],
        [0, 0, 0, 0, 0],
        [0, 0, 1, 0, 0],
    ],
    dtype=bool,
)
"""Contacts at the places of a lattice; the first holds a diagonal step."""
STEP_MM = 0.7, 0.9


def field(order: NDArray[np.intp], normal_n: float = -0.1) -> ForceField:
    """Nodes of the lattice in some order, of which those in contact bear (0.02, 0, normal) each."""
    i, j = (axis.ravel()[order] for axis in np.mgrid[:5, :5])
    touched = PICTURE[i, j]
    force = touched[:, None] * np.array([0.02, 0.0, normal_n])
    return ForceField(
        points_mm=np.column_stack([i * STEP_MM[0], j * STEP_MM[1], np.zeros(25)]),
        displacement_mm=np.zeros((25, 3)),
        force_n=force,
        traction_mpa=force / np.prod(STEP_MM),
        contact=touched,
        centre_of_pressure_mm=np.zeros(2),
        slip_margin=0.0,
    )


def test_contacts_are_told_apart_and_their_forces_add_up() -> None:
    for seed in range(3):
        whole = field(np.random.default_rng(seed).permutation(25))
        found = contact_patches(whole)
        assert [len(patch.nodes) for patch in found] == [4, 2, 1]
        for patch in found:
            np.testing.assert_allclose(patch.force_n, len(patch.nodes) * np.array([0.02, 0, -0.1]))
            at = whole.points_mm[patch.nodes].mean(axis=0)
            np.testing.assert_allclose(patch.centre_of_pressure_mm, at[:2])
            np.testing.assert_allclose(patch.torque_nmm, np.cross(at, patch.force_n), atol=1e-12)
        assert sorted(np.concatenate([p.nodes for p in found])) == sorted(
            np.flatnonzero(whole.contact)
        )


def test_unknown_normal_forces_stay_unknown() -> None:
    found = contact_patches(field(np.arange(25), np.nan))
    assert sorted(len(patch.nodes) for patch in found) == [1, 2, 4]
    for patch in found:
        np.testing.assert_allclose(patch.force_n[0], 0.02 * len(patch.nodes))
        assert np.isnan(patch.force_n[2])
        assert np.isnan(patch.centre_of_pressure_mm).all()


def test_no_contact_has_no_patch() -> None:
    whole = field(np.arange(25))
    free = np.zeros(25, dtype=bool)
    assert contact_patches(ForceField(**{**vars(whole), "contact": free})) == ()
