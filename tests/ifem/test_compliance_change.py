"""Derivatives of the motion of a pad's surface by its thickness, Poisson's ratio and skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from contact_pads import small_pad
from numpy.typing import NDArray

from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.compliance_change import ComplianceChange
from ifem_export.elements.skin import Membrane, Skin

Array = NDArray[np.float64]
STEP, LIMIT = 0.01, 0.1


def with_ratio(pad: Bundle, change: float) -> Bundle:
    ratio = pad.material.poissons_ratio + change
    return pad.with_gel(replace(pad.material, poissons_ratio=ratio), 1.0)


def thicker(pad: Bundle, share: float) -> Bundle:
    return pad.with_gel(pad.material, 1 + share)


def patch_n(pad: Bundle, place: tuple[float, float] = (0.0, 0.0)) -> Array:
    """(c, 3) push with shear on a round patch."""
    points = np.asarray(pad.mesh.surface_mm)
    near = np.hypot(*(points[:, :2] - place).T) < 2.0
    return near[:, None] * np.array([0.003, -0.001, -0.01])


def change_of(less: Bundle, more: Bundle, step: float, force_n: Array) -> Array:
    """By exact factors of both pads, skin included."""
    moved = [SurfaceCompliance(b, skin=b.membranes).whole(force_n) for b in (less, more)]
    return np.asarray((moved[1] - moved[0]) / step)


def apart(pad: Bundle, found: Array, exact: Array) -> float:
    """Difference of two motions around the patch in the middle, over the second of them."""
    near = np.hypot(*np.asarray(pad.mesh.surface_mm)[:, :2].T) < 4.0
    return float(np.linalg.norm((found - exact)[near]) / np.linalg.norm(exact[near]))


def test_the_change_of_an_endless_pad_is_that_of_a_pad_in_its_middle() -> None:
    pad = small_pad(0.35, 24, 2, 18.0)
    more = [(thicker(pad, STEP), STEP), (with_ratio(pad, STEP), STEP)]
    force = patch_n(pad)
    found = ComplianceChange.of(pad, more).motion(force)
    assert found.shape == (2, len(force), 3)
    for change, (varied, step) in zip(found, more, strict=True):
        assert apart(pad, change, change_of(pad, varied, step, force)) < LIMIT
        assert apart(pad, change, change_of(varied, pad, step, force)) > 1


def test_the_change_by_a_skin() -> None:
    pad = replace(small_pad(0.45, 24, 2, 18.0), skin=Skin(Membrane(0.3, 0.2)))
    stiffer = replace(pad, skin=Skin(Membrane(0.33, 0.2)))
    force = patch_n(pad)
    (found,) = ComplianceChange.of(pad, [(stiffer, 0.03)]).motion(force)
    assert apart(pad, found, change_of(pad, stiffer, 0.03, force)) < LIMIT


def test_a_change_is_per_unit_of_the_parameter() -> None:
    pad = small_pad(0.35, 12, 2)
    more = [(with_ratio(pad, STEP), STEP), (with_ratio(pad, STEP), 2 * STEP)]
    one, half = ComplianceChange.of(pad, more).motion(patch_n(pad))
    np.testing.assert_allclose(half, one / 2, atol=1e-12 * np.abs(one).max())
