"""How the light on the gel changes from the reference to a frame, in coarse bins.

The change is logarithmic. Where red and green light come from opposite sides, log R/G follows the
slope of the surface across the finger, independent of the paint and of the fall-off of the light.
The remaining change of brightness follows the slope along the finger, and more so the change of a
third colour that comes from the tip, against the others. Nothing here depends on which colour comes
from where: the layers are combinations of the channels that the picture has.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from gelslim_core.errors import GelslimError
from gelslim_force.contact.light_baseline import without_baseline
from gelslim_force.contact.noise_grain import noise_grain
from gelslim_force.contact.noise_law import NoiseLaw
from gelslim_force.contact.reflections import reflecting
from gelslim_force.frames.read_only import read_only

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
LEAST_LEVEL = 8.0
"""Smallest mean grey value of the reference with which a channel is used."""
FLOOR = 5.0
LEAST_FREE = 0.34
"""Smallest share of a bin's pixels that must be free of ink and glare."""
_SAMPLE_PX = 8
_GREY, _LEAST_GREY = 2, 0.95
"""Difference of the channels, in grey values, up to which a pixel has no colour, and the share of
such pixels in a picture without colour: noise alone gives the pixels of a colour camera more."""
_BLACK, _WHITE, _LEAST_LIT = 5, 250, 0.05
"""Grey values outside of which a pixel does not tell its colour, and the least share of others."""
_OPAQUE = 0.75
"""Share of its light that every colour keeps at a tilt of the gel: light from two sides loses less
than this in the brighter of the two. Darker is dirt on the gel or on the window."""

_ROWS = 4
"""Rows of bins for one that is read for their usual noise."""
_CLEAR = 0.02
"""Noise of a bin up to which the light shows what it shows in pictures that are not compressed. At
0.05 to 0.08 presses of 0.08 to 0.11 N are not seen."""
_EXACT, _JUMPS = 5e-4, 0.005
"""Noise of a single bin below which most are what they were in the reference, and that of blocks
from which these jump: what was rounded in both pictures is not known to be right between jumps."""
MOST_FAINT = 2.0
"""Value of `ShadingChange.faint` beyond which a contact may be hidden."""
TOO_FAINT = (
    "whole blocks of the picture err in common, as if it were compressed so strongly that its "
    "light may hide a contact or a part of one: let the camera compress less, or, where an object "
    "covers nearly all of the gel, press less of it"
)


class LostColourError(GelslimError, ValueError):
    """A grey picture of a camera whose reference has colour."""


@dataclass(frozen=True, eq=False)
class ShadingChange:
    """Change of log R/G and of log brightness in the used channels, one layer per combination."""

    change: NDArray[np.floating]
    """(c, rows, columns) about the median and the trend over the pad; 0 where not valid."""
    valid: Mask
    """(rows, columns) bins on the pad with enough free pixels."""
    noise: NDArray[np.floating]
    """(c, rows, columns) standard deviation of each bin, from the spread outside the patch; it is
    larger where there is little light, or few free pixels, and by `grain`."""
    hidden: Mask | None = None
    """(rows, columns) bins on the pad that a reflection hides; None without one."""
    grain: Array | None = None
    """(c,) the noise over that of a single bin: with it means over many bins hold, also where bins
    share their errors as in compressed pictures; see `noise_grain`. None for 1."""

    @property
    def faint(self) -> float:
        """Least change of the light that shows a contact, over the usual one.

        It is above 1 only where bins share their errors, and infinite where these are not known.
        """
        if self.grain is None or not self.grain[:2].max() > 1:
            return 1.0
        some = self.noise[:2, ::_ROWS][:, self.valid[::_ROWS]]
        noise = np.median(some, axis=1)
        if (noise < _EXACT * self.grain[:2]).any() and noise.max() > _JUMPS:
            return np.inf
        return max(1.0, float(noise.max()) / _CLEAR)


class ShadingReference:
    """Reference frame (h, w, 3) or (h, w) uint8 with its markers, and the bins' layout.

    The owner sets `on_pad` (rows, columns) once the positions of the bins on the gel are known.
    With `opposed`, each tilt of the gel takes light from some colour, and reflections are left out.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        markers_px: Array,
        radius_px: Array,
        bin_px: int,
        opposed: bool = False,
    ) -> None:
        self.image = as_picture(image)
        self.bin_px = bin_px
        height, width, channels = self.image.shape
        self.shape = (height // bin_px, width // bin_px)
        self.on_pad = np.ones(self.shape, dtype=bool)
        self._opposed = opposed
        self._radius = radius_px
        self._coloured = not is_grey(self.image)
        from gelslim_force.contact.shading_kernel import FREE, block_discs, glaring_bins

        self._mask = np.full((height, width), FREE, dtype=np.uint8)
        block_discs(self._mask, np.asarray(markers_px, dtype=float), radius_px)
        self._scratch = np.empty_like(self._mask)
        self._glaring = np.zeros((2, *self.shape), dtype=np.uint8)
        glaring_bins(self.image, bin_px, self._glaring[0])
        self._ratios = np.ones((channels, *self.shape), dtype=np.float32)
        self._counts = np.zeros(self.shape, dtype=np.int64)
        levels = self.levels()
        level = self.image.reshape(-1, channels).mean(axis=0)
        self.used = np.flatnonzero(level >= LEAST_LEVEL)
        if not len(self.used):
            raise ValueError(
                f"the reference picture is dark (mean {level.max():.0f} of 255) and has no shading"
            )
        self._noise = NoiseLaw.of(levels[self.used] + np.float32(FLOOR))
        free = np.maximum(np.arange(bin_px**2 + 1), 1)
        self._by_free = np.sqrt(bin_px**2 / free).astype(np.float32)

    def levels(self) -> NDArray[np.float32]:
        """Mean grey value (c, rows, columns) of the free pixels of each bin; 0 without any."""
        rows, columns = self.shape
        size = self.bin_px
        cut = slice(0, rows * size), slice(0, columns * size)
        free = (self._mask[cut] != 0).astype(np.float32)

        def summed(picture: NDArray[np.float32]) -> NDArray[np.float32]:
            return picture.reshape(rows, size, columns, size).sum(axis=(1, 3))

        count = np.maximum(summed(free), 1)
        channels = np.moveaxis(self.image[cut], 2, 0)
        return np.stack([summed(c * free) / count for c in channels])

    def centres_px(self) -> Array:
        """Centres (rows * columns, 2) of the bins."""
        y, x = np.mgrid[: self.shape[0], : self.shape[1]]
        indices = np.column_stack([x.ravel(), y.ravel()])
        return indices * self.bin_px + (self.bin_px - 1) / 2

    def change(
        self, image: NDArray[np.uint8], markers_px: Array | None, radius_px: Array | None = None
    ) -> ShadingChange:
        """Change from the reference to `image`, without the markers of either picture.

        Raises ValueError for an image of another shape, LostColourError for a grey one where the
        reference has colour.
        """
        from gelslim_force.contact.shading_kernel import block_discs, glaring_bins, light_ratios

        picture = as_picture(image)
        if picture.shape != self.image.shape:
            raise ValueError(
                f"the frame has shape {picture.shape}, the reference {self.image.shape}: "
                "use frames of one camera mode"
            )
        if self._coloured and is_grey(picture):
            raise LostColourError(
                "the picture is grey, the reference has colour, and contacts show by the colours: "
                "set the camera to colour"
            )
        mask = self._scratch
        np.copyto(mask, self._mask)
        if markers_px is not None and len(markers_px):
            radius = radius_px
            if radius is None:
                radius = np.full(len(markers_px), float(np.median(self._radius)))
            block_discs(mask, np.asarray(markers_px, dtype=float), radius)
        glaring_bins(picture, self.bin_px, self._glaring[1])
        glaring = self._glaring[0] | self._glaring[1]
        # The constant keeps a channel that turns black from dominating all others.
        light_ratios(
            self.image, picture, mask, glaring, self.bin_px, FLOOR, self._ratios, self._counts,
        )  # fmt: skip
        free = (self._counts >= LEAST_FREE * self.bin_px**2) & ~self._soiled()
        noise_level = self._noise.even * self._by_free[self._counts]
        change, valid = _combined(np.log(self._ratios[self.used])), free & self.on_pad
        noise = without_baseline(change, valid, noise_level)
        grown = self._noise.growth(change, noise, valid)
        if grown is not None:
            noise *= grown
        grain = noise_grain(change, noise, valid, self.bin_px)
        noise *= grain.astype(noise.dtype)[:, None, None]
        hidden = reflecting(change, noise, valid) if self._opposed and len(change) > 1 else None
        if hidden is None or not hidden.any():
            return ShadingChange(change, valid, noise, grain=grain)
        change *= ~hidden
        return ShadingChange(change, valid & ~hidden, noise, hidden & self.on_pad, grain)

    def _soiled(self) -> Mask:
        """(rows, columns) bins that something opaque covers, and those beside them.

        A tilt takes light from one colour and gives it to another; dirt takes it from all.
        """
        if len(self.used) < 2:
            return np.zeros(self.shape, dtype=bool)
        seen = self._counts > 0
        brightest = self._ratios[self.used].max(axis=0)
        usual = _median(brightest[seen & self.on_pad])
        dark = seen & (brightest < _OPAQUE * usual)
        return np.asarray(binary_dilation(dark, np.ones((3, 3)))) if dark.any() else dark


def _median(values: NDArray[np.float32]) -> np.float32:
    """The median of values (n,), as `np.median` gives it in three times the time; 1 without any."""
    if not len(values):
        return np.float32(1.0)
    middle = (len(values) - 1) // 2, len(values) // 2
    return np.float32(np.partition(values, middle)[list(middle)].mean())


def is_grey(picture: NDArray[np.uint8]) -> bool:
    """Whether a picture (h, w, c) has no colour, by a part of its pixels.

    Black and saturated pixels do not tell; a picture that has hardly any others is not grey.
    """
    some = picture[::_SAMPLE_PX, ::_SAMPLE_PX]
    # By channels: a reduction over the short last axis takes ten times as long.
    channels = [some[:, :, c] for c in range(some.shape[2])]
    low, high = reduce(np.minimum, channels), reduce(np.maximum, channels)
    tells = (high > _BLACK) & (low < _WHITE)
    apart = (high - low)[tells]
    return bool(tells.mean() >= _LEAST_LIT and (apart <= _GREY).mean() >= _LEAST_GREY)


def as_picture(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An (h, w, c) view. Raises ValueError for another shape or type."""
    picture = np.asarray(image)
    channels = 1 if picture.ndim == 2 else picture.shape[-1]
    if picture.dtype != np.uint8 or picture.ndim not in (2, 3) or channels not in (1, 3):
        raise ValueError(
            f"image of shape {picture.shape} and type {picture.dtype}: give (h, w, 3) or (h, w) "
            "uint8"
        )
    if min(picture.shape[:2]) < 32:
        raise ValueError(f"image of {picture.shape[1]} x {picture.shape[0]} px: 32 x 32 at least")
    return read_only(picture if picture.ndim == 3 else picture[:, :, None])


def _combined(log: NDArray[np.floating]) -> NDArray[np.floating]:
    """(c, rows, columns): log R/G, log brightness, then the further channels minus brightness."""
    if len(log) == 1:
        return log
    out = np.empty_like(log)
    np.subtract(log[0], log[1], out=out[0])
    np.add(log[0], log[1], out=out[1])
    out[1] *= 0.5
    np.subtract(log[2:], out[1], out=out[2:])
    return out
