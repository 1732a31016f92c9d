"""The constant part of the picture: the rays of its pixels, the illuminated pad and its frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.random_stream import stream

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
_PROBE_MM = 0.5


@dataclass(frozen=True, eq=False)
class Sight:
    """Rays of a lattice of pixels: x, y = `rest_mm` (h, w, 2) + `slope` (h, w, 2) z.

    Within the gel a ray is straight, so that this form is exact. Column i and row j of the lattice
    are the pixels i and j times `pixel_step`.
    """

    rest_mm: Array
    slope: Array
    pixel_step: int

    @classmethod
    def of(cls, camera: VirtualCamera, pixel_step: int = 1) -> Sight:
        """Rays of every `pixel_step`-th pixel; the last ones lie beyond the picture's edge.

        Raises ValueError for pixels that look away from the window.
        """
        columns = -(-(camera.image_width_px - 1) // pixel_step) + 1
        rows = -(-(camera.image_height_px - 1) // pixel_step) + 1
        y, x = np.mgrid[:rows, :columns] * pixel_step
        pixels = np.column_stack([x.ravel(), y.ravel()]).astype(float)
        rest = camera.backproject(pixels, 0.0)[:, :2]
        below = camera.backproject(pixels, -_depth(camera))[:, :2]
        slope = (rest - below) / _depth(camera)
        return cls(rest.reshape(rows, columns, 2), slope.reshape(rows, columns, 2), pixel_step)

    def pixel_mm(self) -> Array:
        """Size (h, w) of a pixel on the gel in mm: the square root of its area."""
        du = np.gradient(self.rest_mm, axis=1) / self.pixel_step
        dv = np.gradient(self.rest_mm, axis=0) / self.pixel_step
        area: Array = np.sqrt(np.abs(du[..., 0] * dv[..., 1] - du[..., 1] * dv[..., 0]))
        return area


def _depth(camera: VirtualCamera) -> float:
    """A depth below the surface, within the gel."""
    if not camera.layers or camera.layers[-1].thickness_mm <= 0:
        raise ValueError("the camera has no gel layer: its last layer must be the gel")
    return min(_PROBE_MM, camera.layers[-1].thickness_mm / 2)


@dataclass(frozen=True)
class Pad:
    """Outline of the gel and appearance of its coat and of the frame around it.

    `frame_level` is the brightness of the frame next to the pad over that of the coat halfway to
    its centre; it decays as exp(-distance / frame_decay_mm). `mottle` is the relative standard
    deviation of the coat's brightness, in patches of `mottle_mm`. `vignetting` is the weight of the
    lens's cos⁴ law (0: none, 1: full).
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

    def beyond_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """Signed distance from the outline, negative on the pad."""
        r = self.corner_radius_mm
        a = np.abs(x_mm) - (self.length_mm / 2 - r)
        b = np.abs(y_mm) - (self.width_mm / 2 - r)
        outside = np.hypot(np.maximum(a, 0), np.maximum(b, 0))
        distance: Array = outside + np.minimum(np.maximum(a, b), 0) - r
        return distance

    def share_at(self, sight: Sight) -> NDArray[np.float32]:
        """Share (rows, columns, 1) of pad at each ray of a lattice, falling over 1 mm around it."""
        beyond = self.beyond_mm(sight.rest_mm[..., 0], sight.rest_mm[..., 1])
        return np.clip(1 - beyond, 0.0, 1.0).astype(np.float32)[..., None]


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
