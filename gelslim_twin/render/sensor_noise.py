"""Shot noise and read noise of the image sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.random_stream import stream_key


@dataclass(frozen=True)
class SensorNoise:
    """Read noise `read_dn` in grey values and `electrons_per_dn`, both at gain 1.

    The variance of a value v is (gain · read)² + gain · v / electrons_per_dn; infinitely many
    electrons have no shot noise. Raises ValueError for values out of range.
    """

    read_dn: float = 0.0
    electrons_per_dn: float = float("inf")
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.read_dn <= 255:
            raise ValueError(f"read_dn = {self.read_dn}: must be in 0 ... 255")
        if not self.electrons_per_dn > 0:
            raise ValueError(f"electrons_per_dn = {self.electrons_per_dn}: must be positive")

    def apply(
        self, image: NDArray[np.float32], gain: float = 1.0, frame: int = 0, first: int = 0
    ) -> None:
        """Add the noise of frame number `frame` to `image` (h, w, 3), in place.

        A strip of a picture has the picture's noise if `first` is the number of its first pixel.
        """
        shot = gain / self.electrons_per_dn
        if self.read_dn == 0 and shot == 0:
            return
        from gelslim_twin.render.image_kernel import add_noise

        add_noise(
            image.reshape(-1, 3),
            first,
            stream_key(self.seed, "sensor noise", frame),
            normal_table(),
            np.float32((gain * self.read_dn) ** 2),
            np.float32(shot),
        )


@cache
def normal_table() -> NDArray[np.float32]:
    """Means of the normal distribution over 2¹⁴ equal shares, scaled to unit variance."""
    from scipy.special import ndtri

    from gelslim_twin.render.image_kernel import BITS

    edges = ndtri(np.arange(1, 2**BITS) / 2**BITS)
    density = np.concatenate([[0.0], np.exp(-(edges**2) / 2) / np.sqrt(2 * np.pi), [0.0]])
    means = (density[:-1] - density[1:]) * 2**BITS
    table = (means / means.std()).astype(np.float32)
    table.setflags(write=False)
    return table
