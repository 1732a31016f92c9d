"""What shutter, image sensor and transmission do to a frame.

These are motion blur, exposure with the response curve, noise, and JPEG compression.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from gelslim_core.optional_library import load
from gelslim_twin.render.random_stream import stream_key

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MotionBlur:
    """Blur of dots that move while the shutter is open, the last `shutter_ms` before a frame.

    Dots move uniformly on straight lines. The blur is the mean of at most `most_poses` poses, no
    farther apart than `px_per_pose`.
    """

    shutter_ms: float = 5.0
    px_per_pose: float = 0.5
    most_poses: int = 16

    def start(self, before: Array, now: Array, step_s: float) -> Array:
        """Outlines (m, k, 2) when the shutter opens, from those `step_s` before `now`.

        The shutter is open for the whole step where it would be open for longer.
        """
        if self.shutter_ms == 0:
            return now
        open_share = 1.0 if step_s <= 0 else min(1.0, self.shutter_ms / 1000 / step_s)
        opened: Array = now + open_share * (before - now)
        return opened

    def poses(self, start: Array, now: Array) -> NDArray[np.int64]:
        """How many poses (m,) to draw of each dot; 1 for a dot that stands still."""
        away = now - start
        path = np.sqrt((away[..., 0] ** 2 + away[..., 1] ** 2).max(axis=1))
        wanted = np.ceil(path / self.px_per_pose)
        return np.clip(wanted, 1, self.most_poses).astype(np.int64)


@dataclass(frozen=True)
class Exposure:
    """Time and gain relative to the defaults, and the exponent 1/gamma of the response curve.

    A gamma above 1 brightens the grey values between black and white.
    """

    time: float = 1.0
    gain: float = 1.0
    gamma: float = 1.0

    @property
    def scale(self) -> float:
        """Factor on the light."""
        return self.time * self.gain


@dataclass(frozen=True)
class SensorNoise:
    """Read noise `read_dn` in grey values and `electrons_per_dn`, both at gain 1.

    The variance of a value v is (gain · read)² + gain · v / electrons_per_dn; infinitely many
    electrons have no shot noise. Where `grain_px` is above 0, the noise has the correlation of
    white noise behind a Gaussian filter of that standard deviation, as demosaicing and compression
    leave it; the variance stays.
    """

    read_dn: float = 0.0
    electrons_per_dn: float = float("inf")
    seed: int = 0
    grain_px: float = 0.0

    def grain(self, shape: tuple[int, int], frame: int = 0) -> NDArray[np.float32]:
        """Correlated noise (h, w, 3) of unit variance of frame number `frame`; empty for none."""
        if self.grain_px == 0:
            return np.zeros((0, 0, 3), dtype=np.float32)
        from scipy.ndimage import gaussian_filter

        from gelslim_twin.render.image_kernel import add_noise

        white = np.zeros((*shape, 3), dtype=np.float32)
        key, one, none = stream_key(self.seed, "sensor noise", frame), np.float32(1), np.float32(0)
        add_noise(white.reshape(-1, 3), 0, key, normal_table(), one, none)
        spread = (self.grain_px, self.grain_px, 0)
        return np.asarray(gaussian_filter(white, spread, mode="wrap") / _left(self.grain_px))

    def apply(
        self, image: NDArray[np.float32], gain: float = 1.0, frame: int = 0, first: int = 0
    ) -> None:
        """Add white noise of frame number `frame` to `image` (h, w, 3), in place.

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

    def add(self, image: NDArray[np.float32], gain: float, grain: NDArray[np.float32]) -> None:
        """Add `grain` (h, w, 3) with the variance of each value to `image` (h, w, 3), in place."""
        shot = np.float32(gain / self.electrons_per_dn)
        variance = np.float32((gain * self.read_dn) ** 2) + shot * np.maximum(image, 0)
        image += np.sqrt(variance) * grain


@cache
def _left(grain_px: float) -> np.float32:
    """Standard deviation of white noise of unit variance behind the Gaussian filter."""
    from scipy.ndimage import gaussian_filter1d

    impulse = np.zeros(2 * int(4 * grain_px + 2) + 1)
    impulse[len(impulse) // 2] = 1.0
    return np.float32((gaussian_filter1d(impulse, grain_px) ** 2).sum())


def noise_of_electrons(
    full_well_electrons: float, read_noise_electrons: float, seed: int, grain_px: float = 0.0
) -> SensorNoise:
    """Noise of a sensor whose white pixel holds `full_well_electrons`; none without electrons."""
    if full_well_electrons == 0:
        return SensorNoise()
    per_dn = full_well_electrons / 255
    return SensorNoise(read_noise_electrons / per_dn, per_dn, seed, grain_px)


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


@dataclass(frozen=True)
class Compression:
    """JPEG `quality` (1 ... 95), colour at half resolution as cameras send it; None for none."""

    quality: int | None = None

    def apply(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The picture (h, w, 3) or (h, w) after coding and decoding.

        Raises MissingLibraryError if Pillow is not installed.
        """
        if self.quality is None:
            return image
        pillow = load("PIL.Image", "the effect compression")
        store = io.BytesIO()
        pillow.fromarray(image).save(store, "JPEG", quality=self.quality, subsampling=2)
        return np.array(
            pillow.open(io.BytesIO(store.getvalue())).convert("L" if image.ndim == 2 else "RGB")
        )
