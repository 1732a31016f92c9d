"""The gel of a spec as the stiffness needs it: material, what covers it, tolerances."""

from __future__ import annotations

from gelslim_cad.spec import Spec
from gelslim_cad.spec.spec import SkinLayer
from ifem_export.elements.material import Material
from ifem_export.elements.skin import Membrane, Skin

LAYERS = ("coat", "fabric")
"""Layers on the gel, the lowest first."""


def gel_material(spec: Spec) -> Material:
    """The gel as the stiffness needs it."""
    gel = spec.material.gel
    return Material(gel.youngs_modulus_mpa, gel.poissons_ratio, gel.density_kg_m3)


def bare(spec: Spec) -> set[str]:
    """The layers of which the spec says nothing."""
    return {name for name in LAYERS if getattr(spec.material, name) == SkinLayer()}


def gel_skin(spec: Spec) -> Skin | None:
    """Coat and fabric on the gel; None where the spec says nothing of them."""
    if len(bare(spec)) == len(LAYERS):
        return None
    layers = [getattr(spec.material, name) for name in LAYERS]
    coat, fabric = (
        None
        if one.stiffness_n_per_mm is None
        else Membrane(one.stiffness_n_per_mm, one.poissons_ratio)
        for one in layers
    )
    known = [one.friction for one in layers if one.friction is not None]
    return Skin(coat, fabric, known[-1] if known else None)


def tolerances(spec: Spec) -> dict[str, float]:
    """Standard deviations of what the spec states of the gel, by name of the bundle."""
    gel = spec.material.gel
    return {
        "youngs_modulus_mpa": gel.youngs_modulus_tolerance_ratio * gel.youngs_modulus_mpa,
        "poissons_ratio": gel.poissons_ratio_tolerance,
        "thickness_mm": spec.manufacturing.gel_thickness_tolerance_mm,
    }
