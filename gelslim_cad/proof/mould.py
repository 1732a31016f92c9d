"""The mould's cavity against the gel it shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_cad.proof.result import ProofResult, at_most

LIMIT = 1e-6


def prove_mould(cavity: Any, gel: Any, scale: float, *, file: str = "mould") -> list[ProofResult]:
    """Check that a cavity is the gel scaled by `scale` (1 / (1 - shrinkage)), to 1e-6.

    Compared are volume, area and the principal moments of inertia, relative to the gel's times
    `scale` to the 3rd, 2nd and 5th power; none depends on where the two solids lie. The largest
    relative difference of each is reported.
    """
    volume = _relative(cavity.Volume(), gel.Volume() * scale**3)
    area = _relative(cavity.Area(), gel.Area() * scale**2)
    moments = np.array(_moments(gel)) * scale**5
    inertia = max(_relative(c, g) for c, g in zip(_moments(cavity), moments, strict=True))
    shown = f"scale {scale:.9g}"
    return [
        at_most(file, "cavity volume = gel x scale^3", volume, LIMIT, shown),
        at_most(file, "cavity area = gel x scale^2", area, LIMIT, shown),
        at_most(file, "cavity inertia = gel x scale^5", inertia, LIMIT, shown),
    ]


def _relative(value: float, expected: float) -> float:
    return abs(value / expected - 1.0) if expected > 0 else float("inf")


def _moments(shape: Any) -> list[float]:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape.wrapped, properties)
    return sorted(properties.PrincipalProperties().Moments())
