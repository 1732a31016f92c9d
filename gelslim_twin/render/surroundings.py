"""The constant part of the picture: the illuminated pad at rest and the frame around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.random_stream import stream

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_optics.light.light_map import LightMap
    from gelslim_twin.render.sight import Sight

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pad:
    """Outline of the gel and appearance of its coat and of the frame around it.

    `frame_level` is the brightness of the frame next to the pad over that of the coat halfway to
    its centre; it decays as exp(-distance / frame_decay_mm). `mottle` is the relative standard
    deviation of the coat's brightness, in patches of `mottle_mm`. `vignetting` is the weight of the
    lens's cos⁴ law (0: none, 1: full).
    Raises ValueError for values out of range.
    """

    length_mm: float
    width_mm: float
    corner_radius_mm: float = 0.0
    frame_level: float = 0.5
    frame_decay_mm: float = 6.0
    mottle: float = 0.0
    mottle_mm: float = 1.5
    vignetting: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("length_mm", "width_mm", "frame_decay_mm", "mottle_mm"):
            if not getattr(self, name) > 0:
                raise ValueError(f"the pad's {name} = {getattr(self, name)} must be positive")
        if not 0 <= self.corner_radius_mm <= min(self.length_mm, self.width_mm) / 2:
            raise ValueError(
                f"a corner radius of {self.corner_radius_mm} mm: must be at most half a side"
            )
        for name, most in (("frame_level", 10.0), ("mottle", 0.5), ("vignetting", 1.0)):
            if not 0 <= getattr(self, name) <= most:
                raise ValueError(f"the pad's {name} = {getattr(self, name)}: in 0 ... {most:g}")

    def beyond_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """Signed distance from the outline, negative on the pad."""
        r = self.corner_radius_mm
        a = np.abs(x_mm) - (self.length_mm / 2 - r)
        b = np.abs(y_mm) - (self.width_mm / 2 - r)
        outside = np.hypot(np.maximum(a, 0), np.maximum(b, 0))
        distance: Array = outside + np.minimum(np.maximum(a, b), 0) - r
        return distance


def still_irradiance(
    camera: VirtualCamera,
    sight: Sight,
    light: LightMap,
    pad: Pad,
    seen_mm: Array | None = None,
) -> NDArray[np.float32]:
    """Light (h, w, k) that each pixel receives from each source, pad at rest, no dots.

    `seen_mm` (h, w, 2) is where each pixel's ray meets the gel: at z = 0 where None.
    """
    seen = sight.rest_mm if seen_mm is None else seen_mm
    x, y = seen[..., 0], seen[..., 1]
    beyond = pad.beyond_mm(x, y)
    on_pad = np.clip(0.5 - beyond / sight.pixel_mm(), 0.0, 1.0)
    frame = pad.frame_level * np.exp(-np.maximum(beyond, 0) / pad.frame_decay_mm)
    coat = light.at(x, y) * (on_pad * _mottled(pad, x, y))[..., None]
    halfway = [np.clip(v, -s / 2, s / 2) / 2 for v, s in ((x, pad.length_mm), (y, pad.width_mm))]
    lit = coat + light.at(*halfway) * ((1 - on_pad) * frame)[..., None]
    if pad.vignetting > 0:
        lit = lit * (1 - pad.vignetting * (1 - _cos4(camera)))[..., None]
    return np.ascontiguousarray(lit, dtype=np.float32)


def _mottled(pad: Pad, x: Array, y: Array) -> Array:
    """Relative brightness of the coat at each pixel: smoothed white noise."""
    if pad.mottle == 0:
        return np.ones_like(x)
    from scipy.ndimage import gaussian_filter, map_coordinates

    step = pad.mottle_mm / 3
    shape = [int(np.ceil(size / step)) + 13 for size in (pad.width_mm, pad.length_mm)]
    noise = stream(pad.seed, "coat mottle").standard_normal(shape)
    smooth = gaussian_filter(noise, 1.5, mode="wrap") + 0.5 * gaussian_filter(noise, 5, mode="wrap")
    smooth *= pad.mottle / smooth.std()
    rows = (y + pad.width_mm / 2) / step + 6
    columns = (x + pad.length_mm / 2) / step + 6
    seen = map_coordinates(smooth, [rows, columns], order=1, mode="nearest")
    return np.asarray(np.maximum(1 + seen, 0))


def _cos4(camera: VirtualCamera) -> Array:
    """Fall-off of a lens, cos⁴ of the angle to its axis (h, w)."""
    y, x = np.mgrid[: camera.image_height_px, : camera.image_width_px]
    u = (x - camera.principal_px[0]) / camera.focal_px
    v = (y - camera.principal_px[1]) / camera.focal_px
    fall: Array = (1 + u * u + v * v) ** -2
    return fall
