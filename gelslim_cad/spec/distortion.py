"""Distortion of the lens, as a data sheet or a calibration gives it."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gelslim_cad.spec.limits import between
from gelslim_core.yaml.base import Block
from gelslim_core.yaml.errors import FieldError
from gelslim_optics.camera.lens_distortion import LensDistortion

Real = float | NDArray[np.float64]
MOST = 20.0
"""Largest size of a coefficient; those of real lenses are below 2."""


class Distortion(Block):
    """Distortion of the lens, its coordinates over the image distance as in a calibration."""

    model: Literal["brown", "kannala_brandt"] = Field(
        default="brown",
        description="`brown`: r (1 + k1 r² + k2 r⁴ + k3 r⁶) for a ray of the tangent r, p1, p2; "
        "`kannala_brandt`: θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) for one at the angle θ",
    )
    k1: float = between(-MOST, MOST, "Radial coefficient k1", default=0.0)
    k2: float = between(-MOST, MOST, "Radial coefficient k2", default=0.0)
    k3: float = between(-MOST, MOST, "Radial coefficient k3", default=0.0)
    k4: float = between(-MOST, MOST, "Radial coefficient k4 of kannala_brandt", default=0.0)
    p1: float = between(-0.2, 0.2, "Tangential coefficient p1 of brown", default=0.0)
    p2: float = between(-0.2, 0.2, "Tangential coefficient p2 of brown", default=0.0)
    tv_percent: float | None = Field(
        default=None,
        ge=-40,
        le=40,
        description="TV distortion of the data sheet, 100 (A - B) / B of a rectangle that would "
        "fill the picture, A its height at the sides and B in the middle (SMIA 1.0 part 5, 5.20); "
        "negative for a barrel; instead of coefficients. A sheet that divides the bow of one edge "
        "by the height states half of it",
    )

    @model_validator(mode="after")
    def _one_description(self) -> Distortion:
        wide = self.model == "kannala_brandt"
        for name in ("p1", "p2") if wide else ("k4",):
            if getattr(self, name):
                raise FieldError(
                    name, f"does not belong to the model {self.model}", "leave it out", ("model",)
                )
        given = [n for n in ("k1", "k2", "k3", "p1", "p2") if getattr(self, n)]
        if self.tv_percent is not None and (wide or given):
            raise FieldError(
                "tv_percent",
                "cannot be combined with coefficients or the model kannala_brandt",
                "give the coefficients, which say more, or tv_percent alone",
                tuple(given),
            )
        return self

    @property
    def stated(self) -> str:
        """The first field that says how the lens distorts."""
        names = ("tv_percent", "k1", "k2", "k3", "k4", "p1", "p2")
        return next((n for n in names if getattr(self, n)), "model")

    def lens(self, side_tan: float, height_tan: float) -> LensDistortion:
        """The distortion of a lens whose sheet's half picture has these tangents."""
        k1 = self.k1
        if self.tv_percent is not None:
            k1 = float(k1_of_tv(self.tv_percent, side_tan, height_tan))
        return LensDistortion(k1, self.k2, self.p1, self.p2, self.k3, self.k4, self.model)


def k1_of_tv(tv_percent: Real, side_tan: Real, height_tan: Real) -> Real:
    """Brown's k1 of a lens with this TV distortion.

    The rectangle with the half sides X and Y, in image distances, has the height
    A = 2 Y (1 + k1 (X² + Y²)) at its sides and B = 2 Y (1 + k1 Y²) in the middle, so that
    D = (A - B) / B = k1 X² / (1 + k1 Y²).

    Args:
        tv_percent: 100 D.
        side_tan: X.
        height_tan: Y.

    Returns:
        k1 = D / (X² - D Y²).
    """
    part = tv_percent / 100
    return part / (side_tan**2 - part * height_tan**2)


def require_one_to_one(
    lens: LensDistortion, side_tan: float, height_tan: float, image_mm: float, field: str
) -> None:
    """Refuse a lens that folds the image over itself within the sensor, half sides given by tan.

    Raises:
        FieldError: For `field`, with how far from its middle the image is one-to-one.
    """
    if not lens.distorts:
        return
    corner = math.hypot(side_tan, height_tan)
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    try:
        lens.undistort(signs * (side_tan, height_tan))
    except ValueError:
        # A wide lens may be one-to-one for all rays, and the sensor larger than their picture.
        edge = min(lens.monotone_radius, 1e6)
        turn = np.linspace(0, 2 * np.pi, 64)
        rim = edge * (1 - 1e-9) * np.column_stack([np.cos(turn), np.sin(turn)])
        reach = float(np.hypot(*lens.distort(rim).T).min())
        raise FieldError(
            field,
            f"folds the image over itself {reach * image_mm:.3g} mm from its middle, within the "
            f"sensor, whose corner is at {corner * image_mm:.3g} mm",
            "coefficients hold for coordinates over the image distance, x / v: check their signs "
            "and units, and that the sensor is no larger than the picture they were found from",
            ("sensor_width_mm", "focal_length_mm"),
        ) from None
