"""From light to grey values: exposure time, gain, the camera's response curve, 8 bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Exposure:
    """Time and gain relative to the defaults, and the exponent 1/gamma of the response curve.

    A gamma above 1 brightens the grey values between black and white. Raises ValueError out of
    range.
    """

    time: float = 1.0
    gain: float = 1.0
    gamma: float = 1.0

    def __post_init__(self) -> None:
        for name, least, most in (("time", 0, 1e3), ("gain", 0, 1e3), ("gamma", 0.2, 5)):
            value = getattr(self, name)
            if not (np.isfinite(value) and least < value <= most):
                raise ValueError(f"exposure {name} = {value}: must be in {least} ... {most:g}")

    @property
    def scale(self) -> float:
        """Factor on the light."""
        return self.time * self.gain
