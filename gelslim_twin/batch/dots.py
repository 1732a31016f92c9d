"""Dots of many displaced surfaces as the camera sees them, and the ink in each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gelslim_optics.camera.back_projection import HeightGrid
from gelslim_twin.batch.coverage import blurred, covered, drawn
from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.projection import BatchedCamera
from gelslim_twin.batch.surfaces import BatchedSurfaces
from gelslim_twin.render.defocus import LARGEST_PX, LEFT_OUT, SUNKEN_MM, TABLE, kernel_table
from gelslim_twin.render.frame_renderer import FrameRenderer
from gelslim_twin.render.printed_dots import CORNERS, RIM_POINTS, rim_scale, series


@dataclass(frozen=True, eq=False)
class BatchedDots:
    """Draws the dots of one renderer.

    Attributes:
        engine: Where they are drawn.
        camera: The camera.
        renderer: What is printed, and how the lens blurs it.
    """

    engine: Engine
    camera: BatchedCamera
    renderer: FrameRenderer

    @cached_property
    def _rim_mm(self) -> Tensor:
        """Points (m 8, 2) on the rims at rest."""
        rim = self.renderer.dots.rim_mm(RIM_POINTS, rim_scale(CORNERS))
        return self.engine.double(rim.reshape(-1, 2))

    @cached_property
    def _series(self) -> Tensor:
        return self.engine.double(series(RIM_POINTS, CORNERS))

    @cached_property
    def _centres_mm(self) -> Tensor:
        return self.engine.double(self.renderer.dots.centres_mm)

    @cached_property
    def _weight(self) -> Tensor:
        dots = self.renderer.dots
        return self.engine.double(dots.opacity * dots.present)

    def ink(self, surfaces: BatchedSurfaces) -> Tensor:
        """Share (b, h, w) of each pixel that ink covers."""
        engine, poses = self.engine, len(surfaces.displacement_mm)
        outlines = self._outlines_px(surfaces)
        doubled = _doubled_area(outlines)
        seen = doubled * self.renderer.orientation > 0
        weight = (self._weight * seen).flatten()
        area = doubled.abs() / 2
        sigma = self._sigma_px(surfaces, area)
        if sigma is None:
            windows = covered(engine, outlines.flatten(0, 1), 0)
        else:
            taps = self._taps(sigma.flatten())
            windows = covered(engine, outlines.flatten(0, 1), taps.shape[1] - 1)
            windows = blurred(engine, windows, taps)
        size = self.camera.camera.image_height_px, self.camera.camera.image_width_px
        return drawn(engine, windows, weight, poses, size)

    def _outlines_px(self, surfaces: BatchedSurfaces) -> Tensor:
        """Outlines (b, m, corners, 2), as `outlines_px`."""
        points = surfaces.at(self._rim_mm).double()
        points[..., :2] += self._rim_mm
        rim = self.camera.project(points).unflatten(1, (-1, RIM_POINTS))
        return self._series @ rim

    def _sigma_px(self, surfaces: BatchedSurfaces, area: Tensor) -> Tensor | None:
        """Standard deviation (b, m) of the blur; None for a sharp picture."""
        lens = self.renderer.look.defocus
        if lens is None or lens.is_null:
            return None
        moved = surfaces.at(self._centres_mm).double()
        places = self._centres_mm + moved[..., :2]
        axes = self.engine.double(self.renderer.dots.semi_axes_mm.prod(axis=1))
        scale = (area / (np.pi * axes)).sqrt()
        field = self.renderer.blur_field
        level = self._grid(field.level, places)
        sunken = self._grid(field.sunken, places)
        blur = (level - moved[..., 2] / SUNKEN_MM * (sunken - level)).clamp(min=0.0)
        return (lens.still_px**2 + (blur * scale / 4) ** 2).sqrt().clamp(max=LARGEST_PX)

    def _taps(self, sigma: Tensor) -> Tensor:
        """Half kernels (n, t) of the blurs (n,), centre first, as `kernel_taps`."""
        torch, most = self.engine.torch, float(sigma.amax())
        if most == 0:
            return torch.ones_like(sigma)[:, None]
        most = np.ceil(2 * most) / 2
        table = self.engine.double(kernel_table(float(most)))
        place = sigma**2 / most**2 * (TABLE - 1)
        low = place.long().clamp(max=TABLE - 2)
        part = (place - low)[:, None]
        taps = (1 - part) * table[low] + part * table[low + 1]
        inside = 2 * torch.nn.functional.pad(taps[:, 1:], (1, 0)).cumsum(dim=1)
        reach = ((1 - taps[:, :1] - inside > LEFT_OUT).sum(dim=1) * (sigma > 0))[:, None]
        taps = taps.masked_fill(torch.arange(taps.shape[1], device=sigma.device) > reach, 0.0)
        taps = taps[:, : int(reach.amax()) + 1]
        return taps / (taps[:, :1] + 2 * taps[:, 1:].sum(dim=1, keepdim=True))

    def _grid(self, grid: HeightGrid, places: Tensor) -> Tensor:
        """Values of an even grid at places (..., 2), as `HeightGrid`."""
        z, cells, parts = self.engine.double(grid.z_mm), [], []
        for k, axis in enumerate((grid.x_mm, grid.y_mm)):
            at = (places[..., k] - float(axis[0])) * ((len(axis) - 1) / float(np.ptp(axis)))
            at = at.clamp(0, len(axis) - 1)
            cell = at.floor().clamp(max=len(axis) - 2)
            cells.append(cell.long())
            parts.append(at - cell)
        (i, j), (u, v) = cells, parts
        low = z[j, i] * (1 - u) + z[j, i + 1] * u
        high = z[j + 1, i] * (1 - u) + z[j + 1, i + 1] * u
        return low * (1 - v) + high * v


def _doubled_area(outlines: Tensor) -> Tensor:
    """Twice the signed area (b, m) of outlines (b, m, k, 2)."""
    local = outlines - outlines[..., :1, :]
    ahead = local.roll(-1, dims=2)
    return (local[..., 0] * ahead[..., 1] - ahead[..., 0] * local[..., 1]).sum(dim=-1)
