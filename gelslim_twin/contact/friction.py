"""Coulomb friction: the cone that the solver's sweeps project on."""

from __future__ import annotations

from dataclasses import replace

from gelslim_twin.contact.solver import ContactSettings


def apply(settings: ContactSettings, friction: float, tolerance: float) -> ContactSettings:
    """Settings with friction; 0 is the frictionless contact bit for bit."""
    tighter = min(settings.tolerance, tolerance)
    return replace(settings, friction=friction, tolerance=tighter)
