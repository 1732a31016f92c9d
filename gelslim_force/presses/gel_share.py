"""The share of a wrench's covariance that comes from what is not known of the gel.

The wrench is W = G S u. It is proportional to Young's modulus, so that its derivative by the
logarithm of the modulus is W. The derivatives of G S by thickness and by Poisson's ratio are
differences of two operators, computed once; where the normal motion follows from the size of a
patch, it depends on the gel too, and its derivative adds G S du/dh.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import Wrench, WrenchNoise
from gelslim_force.presses.gel_calibration import GelCalibration
from ifem_export.operators.surface_operator import SurfaceOperator

if TYPE_CHECKING:
    from gelslim_force.contact.normal_source import NormalReading
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
LN_THICKNESS_STEP, RATIO_STEP = 0.02, 0.002
"""Changes for differences."""


def varied_bundles(bundle: Bundle, gel: GelCalibration) -> list[tuple[Bundle, Bundle, float]]:
    """Sensors with a thicker and a thinner gel, and those of another Poisson's ratio if it varies.

    Returns:
        For each parameter the sensor with less and with more of it, and the size of this step.
    """
    step = LN_THICKNESS_STEP
    found = [(gel.varied(bundle, -step), gel.varied(bundle, step), step)]
    if gel.covariance[2, 2] > 0:
        step = min(RATIO_STEP, (0.5 - gel.poissons_ratio) / 2)
        found.append((gel.varied(bundle, 0.0, -step), gel.varied(bundle, 0.0, step), step))
    return found


@dataclass(frozen=True, eq=False)
class GelShare:
    """What an uncertain gel adds to the covariance of a wrench.

    Attributes:
        covariance: (1 + p, 1 + p) of ln modulus, ln thickness and, where it varies, of Poisson's
            ratio.
        by_normal: (6, c) product G S for the normal motion.
        derivative: (p, 6, c, 3) of G S by thickness and ratio.
    """

    covariance: Array
    by_normal: Array
    derivative: Array

    @classmethod
    def of(
        cls,
        bundle: Bundle,
        gel: GelCalibration,
        operator_of: Callable[[Bundle], SurfaceOperator],
    ) -> GelShare:
        """Make it for one sensor.

        Args:
            bundle: The sensor as designed.
            gel: Its gel as built.
            operator_of: The surface operator of a bundle.
        """
        points = np.asarray(bundle.mesh.surface_mm)

        def response(sensor: Bundle) -> Array:
            return WrenchNoise.of(operator_of(sensor), points).response

        pairs = varied_bundles(bundle, gel)
        derivative = [(response(more) - response(less)) / (2 * step) for less, more, step in pairs]
        size = 1 + len(pairs)
        by_normal = response(gel.varied(bundle))[:, :, 2]
        return cls(gel.covariance[:size, :size], by_normal, np.stack(derivative))

    def added(
        self, wrench: Wrench, displacement_mm: Array, reading: NormalReading | None = None
    ) -> Wrench:
        """The wrench with the share of the gel in its covariance.

        Args:
            wrench: With the covariance of everything else.
            displacement_mm: (c, 3) motion of the surface nodes; z is NaN where it is unknown.
            reading: The normal motion, with its derivative by thickness and ratio where it
                depends on the gel.
        """
        motion = np.nan_to_num(displacement_mm)
        parts = np.einsum("pwci,ci->pw", self.derivative, motion)
        if reading is not None and reading.by_gel_mm is not None:
            parts = parts + reading.by_gel_mm @ self.by_normal.T
        by_gel = np.vstack([np.nan_to_num(wrench.vector), parts])
        share = by_gel.T @ self.covariance @ by_gel
        return replace(wrench, covariance=wrench.covariance + share)
