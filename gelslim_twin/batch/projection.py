"""Images of points of many poses: refraction through flat layers and lens distortion.

The same equations as `gelslim_optics.camera.refraction_newton` and `radial_scale`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from gelslim_optics.camera.radial_scale import SMALLEST
from gelslim_optics.camera.refraction_newton import MAX_NEWTON_STEPS, RELATIVE_STEP, STEEP_SLOPE
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.batch.engine import Engine, Tensor


@dataclass(frozen=True, eq=False)
class BatchedCamera:
    """A camera on a device."""

    engine: Engine
    camera: VirtualCamera

    @cached_property
    def _axes(self) -> Tensor:
        return self.engine.double(self.camera.axes)

    @cached_property
    def _pinhole(self) -> Tensor:
        return self.engine.double(self.camera.position_mm)

    def project(self, points_mm: Tensor) -> Tensor:
        """Positions (..., 2) in px of points (..., 3), in double precision.

        Raises ValueError for points that the camera cannot project.
        """
        torch, camera = self.engine.torch, self.camera
        lateral = points_mm[..., :2] - self._pinhole[:2]
        reach = (lateral * lateral).sum(dim=-1).sqrt()
        slope = self._slopes(reach, points_mm[..., 2])
        scale = torch.where(reach > 0, slope / reach.clamp(min=1e-300), 0.0)
        planar = lateral * scale[..., None]
        ray = planar @ self._axes[:, :2].T + self._axes[:, 2]
        if bool((ray[..., 2] <= 0).any()) or not bool((points_mm[..., 2] > self._pinhole[2]).all()):
            raise ValueError("points lie behind the camera's image plane and have no image")
        image = ray[..., :2] / ray[..., 2:]
        if camera.lens is not None:
            image = self._distorted(image)
        return camera.focal_px * image + self.engine.double(camera.principal_px)

    def _slopes(self, reach: Tensor, z: Tensor) -> Tensor:
        """Slopes in air of the rays with lateral reaches `reach` to heights `z` (both ...)."""
        torch, stack = self.engine.torch, self.camera.stack
        heights, floor = [], stack.start_z_mm
        for top in stack.tops_mm:
            heights.append((z.clamp(max=top) - floor).clamp(min=0.0))
            floor = max(floor, top)
        paraxial, sideways, air = heights[0], 0.0, heights[0]
        for height, n in zip(heights[1:], stack.indices[1:], strict=True):
            paraxial = paraxial + height / n
            excess = (n - 1) * (n + 1)
            if excess > 0:
                sideways = sideways + height / excess**0.5
            else:
                air = air + height
        t = reach / paraxial
        bound = (reach - sideways) / air
        t = torch.where((t > STEEP_SLOPE) & (bound > t), bound, t)
        moving = torch.ones_like(t, dtype=torch.bool)
        for _ in range(MAX_NEWTON_STEPS):
            per_slope = growth = heights[0]
            for height, n in zip(heights[1:], stack.indices[1:], strict=True):
                ratio = 1 / (n * n + (n - 1) * (n + 1) * t * t).sqrt()
                per_slope = per_slope + height * ratio
                growth = growth + height * ratio * (n * n) * ratio * ratio
            step = (reach - t * per_slope) / growth
            again = moving & (step > RELATIVE_STEP * t)
            t = torch.where(moving, t + step, t)
            moving = again
            if not bool(moving.any()):
                break
        return t

    def _distorted(self, xy: Tensor) -> Tensor:
        torch, lens = self.engine.torch, self.camera.lens
        assert lens is not None
        x, y = xy[..., 0], xy[..., 1]
        s = x * x + y * y
        if bool((s.sqrt() >= lens.monotone_radius).any()):
            raise ValueError("points lie outside the domain of the lens distortion")
        turn, base = s, 1.0
        if lens.fisheye:
            radius = s.clamp(min=SMALLEST).sqrt()
            angle = radius.atan()
            turn, base = angle * angle, angle / radius
        f = base * (1 + turn * (lens.k1 + turn * (lens.k2 + turn * (lens.k3 + turn * lens.k4))))
        return torch.stack(
            [
                x * f + 2 * lens.p1 * x * y + lens.p2 * (s + 2 * x * x),
                y * f + lens.p1 * (s + 2 * y * y) + 2 * lens.p2 * x * y,
            ],
            dim=-1,
        )
