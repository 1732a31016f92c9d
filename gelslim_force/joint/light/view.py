"""The light of a frame relative to a picture without contact, in bins whose places are known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.gel_bins import bin_positions, bin_sizes
from gelslim_force.contact.reflections import colours_oppose
from gelslim_force.contact.shading_change import (
    FLOOR,
    ShadingChange,
    ShadingReference,
    as_picture,
)
from gelslim_force.joint.light.calibration import LightCalibration
from gelslim_force.joint.node_lattice import NodeLattice
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_optics.light.light_law import LightLaw
from gelslim_optics.light.light_law_map import law_at
from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_BINS_ACROSS = 160
_SATURATED = 250
_SHOWN = 0.25
"""Share of the bins around a node that show its slope where they are seen."""
_QUIET, _ROWS = 3.0, 4
"""Standard deviations up to which a bin's change is noise, and rows of bins for one that is read
for the correlation of the noise."""
_BLUR_PX = 1.0
"""Standard deviation of the blur of a usual picture."""
_LEAST_ACROSS, _LEAST_SQUARE = 0.1, 0.1
"""Least change of the light by a slope along y that tells rises from falls, and the share of its
median square below which a place counts less."""
_DISC, _RIM_PX = 1.5, 1.0
"""A marker's pixels, over its radius and beyond it, that are left out."""


@dataclass(frozen=True, eq=False)
class SeenLight:
    """What one frame shows in the bins of the gel.

    Attributes:
        shading: Change of the light in all bins of the picture.
        log_change: (c, rows, columns) of the grey values of each channel.
        noise: (c, rows, columns) its standard deviation.
        saturated: (c, rows, columns) whether a pixel may be saturated.
        independent: Share of the noise that neighbouring bins do not have in common.
    """

    shading: ShadingChange
    log_change: Array
    noise: Array
    saturated: Mask
    independent: float


class LightView:
    """Bins of the pictures of one camera, where they are on the gel, and what lights them.

    Args:
        camera: The sensor's camera.
        reference: (h, w, 3) uint8 picture without contact.
        markers_px: (m, 2) markers in it.
        radius_px: (m,) their radii.
        lattice: The surface nodes; bins beyond them are not used.
        light: Light on the untouched gel.
        gamma: Exponent of the camera, as in `LightLaw`.
        built: Its gains as calibrated; None for light as traced.

    Attributes:
        rest_mm: (rows, columns, 2) where the bins meet the gel at rest.
        nearest: (rows * columns,) the node nearest to each bin.
        place: (rows, columns) number of the lattice's place nearest to each bin; see
            `NodeLattice.place_number`.
        lean: (rows, columns, 2) motion of that place along the line of sight per mm of height.
        area_mm2: (rows, columns) of a bin on the gel.
        blur_mm: Standard deviation of the places that a bin shows: its side, and the blur.
        level: (c, rows, columns) grey value of the reference over itself plus the floor.
        share: (k, c, rows, columns) share of each source in the light of each channel.
        law: Change of light with the slope, at each bin or everywhere.
        rising: (c, rows, columns) whose products with changes of light are, to a scale, a rise of
            the surface along y; None where no light tells it.
        gain: (c, rows, columns) gain of the light over the traced one; 1 where not calibrated.

    Raises:
        ValueError: The reference is dark, of another size, or no picture.
    """

    def __init__(
        self,
        camera: VirtualCamera,
        reference: NDArray[np.uint8],
        markers_px: Array,
        radius_px: Array,
        lattice: NodeLattice,
        light: LightMap,
        gamma: float,
        built: LightCalibration | None = None,
    ) -> None:
        picture = as_picture(reference)
        self._radius = np.ascontiguousarray(radius_px * _DISC + _RIM_PX)
        bin_px = max(2, round(picture.shape[1] / _BINS_ACROSS))
        self._light = ShadingReference(
            picture, markers_px, self._radius, bin_px, colours_oppose(light)
        )
        x, y, self.lean, _ = bin_positions(self._light, camera)
        self.rest_mm = np.stack([x, y], axis=-1)
        self.area_mm2 = bin_sizes(x, y) ** 2
        side_mm = math.sqrt(float(np.nanmedian(self.area_mm2)))
        self.blur_mm = side_mm * math.sqrt(1 / 12 + (_BLUR_PX / bin_px) ** 2)
        places = self.rest_mm.reshape(-1, 2)
        self._light.on_pad &= lattice.on(places).reshape(x.shape)
        self.nearest = lattice.nearest_node(places)
        self.place = lattice.place_number(places).reshape(x.shape)
        self.channels = source_channels(light)
        dark = [c for c in self.channels if c not in self._light.used]
        if dark:
            raise ValueError(f"channel {dark[0]} of the reference picture is dark")
        self.level, self.share = self._references(light)
        self.law = law_at(light, places, gamma)
        self.rising = _rising(self.law, self.share)
        self.gain = np.ones(self.level.shape)
        if built is not None:
            if list(built.channels) != self.channels:
                raise ValueError(
                    f"the light calibration has the channels {list(built.channels)}, the light of "
                    f"this sensor {self.channels}"
                )
            self.gain = built.gain_at(places).reshape(self.gain.shape)

    def _references(self, light: LightMap) -> tuple[Array, Array]:
        grey = np.stack([self._light.levels()[c] for c in self.channels]).astype(float)
        falling = light.at(self.rest_mm[..., 0], self.rest_mm[..., 1])
        share = light.colour[:, None, None, self.channels] * np.moveaxis(falling, -1, 0)[..., None]
        # In the order of the bins: each frame reads a part of them several times.
        share = np.ascontiguousarray(np.moveaxis(share, -1, 1))
        return grey / (grey + FLOOR), share / np.maximum(share.sum(axis=0), 1e-12)

    def rise(self, seen: SeenLight) -> Array | None:
        """Rise (rows, columns) along y, to a scale; None where no light tells it."""
        if self.rising is None:
            return None
        return np.asarray(np.einsum("cyx,cyx->yx", self.rising, seen.log_change))

    def look(self, image: NDArray[np.uint8], markers_px: Array) -> SeenLight:
        """Compare a frame with the reference.

        Args:
            image: The frame.
            markers_px: (m, 2) its markers, of which lost ones are NaN.

        Returns:
            The changes.

        Raises:
            ValueError: The frame has another shape.
        """
        radius = self._radius if len(markers_px) == len(self._radius) else None
        shading = self._light.change(image, markers_px, radius)
        logs, noise = _by_channel(shading, self._light.used, self.channels)
        saturated = self._saturated(as_picture(image))
        return SeenLight(shading, logs, noise, saturated, independent_noise(shading))

    def shown(self, seen: SeenLight, count: int) -> Mask:
        """(count,) nodes around which enough of the light is seen to show their slope."""
        near = self.nearest[self._light.on_pad.ravel()]
        valid = seen.shading.valid[self._light.on_pad]
        bins, free = (np.bincount(near, weight, count) for weight in (None, valid))
        return np.asarray((bins > 0) & (free >= _SHOWN * bins))

    def _saturated(self, picture: NDArray[np.uint8]) -> Mask:
        from gelslim_force.joint.kernels.light_kernel import saturated_bins

        found = np.zeros((len(self.channels), *self._light.shape), dtype=bool)
        # Most pictures have no such pixel, which the maximum shows much faster.
        if picture.max() >= _SATURATED:
            channels = np.array(self.channels)
            saturated_bins(picture, channels, self._light.bin_px, _SATURATED, found)
        return found


def independent_noise(shading: ShadingChange) -> float:
    """Share of the noise of the brightness that neighbouring bins do not have in common.

    It is 1 for the noise of a sensor, and less where a picture was compressed.
    """
    layer = min(1, len(shading.change) - 1)
    change, noise = (a[layer, ::_ROWS] for a in (shading.change, shading.noise))
    grain = 1.0 if shading.grain is None else float(shading.grain[layer])
    noise = noise / grain
    quiet = shading.valid[::_ROWS] & (np.abs(change) < _QUIET * noise)
    noisy = np.where(quiet, change, 0.0)
    both = quiet[:, 1:] & quiet[:, :-1]
    common = float((noisy[:, 1:] * noisy[:, :-1]).sum()) / max(int(both.sum()), 1)
    own = float(np.square(noisy).sum()) / max(int(quiet.sum()), 1)
    return float(np.clip(1.0 - common / own, 0.0, 1.0)) / grain**2 if own > 0 else 1.0


def source_channels(light: LightMap) -> list[int]:
    """The channels of the camera in which one of the sources is brightest."""
    return sorted({int(np.argmax(colour)) for colour in light.colour})


def _by_channel(
    shading: ShadingChange, used: NDArray[np.intp], channels: list[int]
) -> tuple[Array, Array]:
    """Logarithmic changes of single channels, and their noise, from those of combinations.

    The combinations are those of `ShadingChange`: difference and mean of the first two channels,
    then each further channel less that mean.
    """
    change, noise = shading.change, shading.noise
    logs, sigma = np.empty((2, len(channels), *change.shape[1:]))
    for k, channel in enumerate(channels):
        number = int(np.flatnonzero(used == channel)[0])
        if len(used) == 1:
            logs[k], sigma[k] = change[0], noise[0]
            continue
        part = (0.5, -0.5)[number] * change[0] if number < 2 else change[number]
        own = noise[0] / 2 if number < 2 else noise[number]
        np.add(change[1], part, out=logs[k])
        np.sqrt(noise[1] * noise[1] + own * own, out=sigma[k])
    return logs, sigma


def _rising(law: LightLaw, share: Array) -> Array | None:
    """Factors (c, rows, columns) by which changes of light tell a rise along y, to a scale.

    They are those of least squares, with a limit for places where the light hardly changes.
    """
    steep = law.sensitivity[..., 1]
    if steep.ndim == 1:
        falling = np.einsum("k,kcyx->cyx", steep, share)
    else:
        falling = np.einsum("kyx,kcyx->cyx", steep.reshape(len(steep), *share.shape[2:]), share)
    square = (falling**2).sum(axis=0)
    whole = float(np.median(square))
    if whole < _LEAST_ACROSS**2:
        return None
    return np.ascontiguousarray(-falling / (square + _LEAST_SQUARE * whole))
