"""Pictures of many displaced surfaces: light, ink, noise and grey values.

The same equations as `gelslim_twin.render.frame_renderer`, without motion blur. What does not
change from picture to picture is that of the renderer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.batch.dots import BatchedDots
from gelslim_twin.batch.engine import Engine, Tensor
from gelslim_twin.batch.projection import BatchedCamera
from gelslim_twin.batch.shading import BatchedShading
from gelslim_twin.batch.surfaces import BatchedSurfaces
from gelslim_twin.render.frame_renderer import CURVE_STEPS, FrameRenderer
from gelslim_twin.render.image_kernel import BITS
from gelslim_twin.render.image_sensor import SensorNoise, normal_table
from gelslim_twin.render.random_stream import stream_key
from gelslim_twin.render.surface_state import NodeLattice

Array = NDArray[np.float64]
GOLDEN, FIRST, SECOND = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
"""Constants of SplitMix64, as in `image_kernel`."""


@dataclass(frozen=True, eq=False)
class BatchedFrames:
    """Draws the pictures of one renderer.

    Attributes:
        engine: Where they are drawn.
        renderer: Draws single pictures.
        lattice: Places of the surface nodes.
    """

    engine: Engine
    renderer: FrameRenderer
    lattice: NodeLattice

    @staticmethod
    def draws(renderer: FrameRenderer) -> bool:
        """Whether the pictures of a renderer can be drawn side by side.

        A crowned gel and correlated noise are left to the renderer itself.
        """
        noise = renderer.look.sensor_noise
        return renderer.top is None and (noise is None or noise.grain_px == 0)

    @cached_property
    def _dots(self) -> BatchedDots:
        camera = BatchedCamera(self.engine, self.renderer.camera)
        return BatchedDots(self.engine, camera, self.renderer)

    @cached_property
    def _shading(self) -> BatchedShading | None:
        shading, sight = self.renderer.look.shading, self.renderer.shading_sight
        if shading is None or sight is None:
            return None
        return BatchedShading(self.engine, shading, sight, self.renderer.light)

    @cached_property
    def _still(self) -> Tensor:
        """Light (k, h, w) at rest, without dots."""
        return self._single(self.renderer.still.transpose(2, 0, 1))

    @cached_property
    def _upsampled(self) -> tuple[Tensor, Tensor]:
        """Weights (h, rows) and (w, columns) of the lattice of the shading at the pixels."""
        assert self.renderer.look.shading is not None
        step = self.renderer.look.shading.pixel_step
        height, width = self.renderer.still.shape[:2]
        return self._linear(height, step), self._linear(width, step)

    def _linear(self, count: int, step: int) -> Tensor:
        values = -(-(count - 1) // step) + 1
        pixel = np.arange(count)
        before = np.minimum(pixel // step, max(values - 2, 0))
        share = (pixel - before * step) / step
        found = np.zeros((count, values))
        found[pixel, before] = 1 - share
        found[pixel, np.minimum(before + 1, values - 1)] += share
        return self._single(found)

    def pictures(self, displacement_mm: Array, numbers: NDArray[np.intp]) -> NDArray[np.uint8]:
        """Pictures (b, h, w, 3), or (b, h, w) of a mono camera, of displacements (b, c, 3).

        `numbers` (b,) say which noise each one has.
        """
        surfaces = BatchedSurfaces.of(self.engine, self.lattice, displacement_mm)
        values = self._values(surfaces, self._dots.ink(surfaces).float())
        noise, exposure = self.renderer.look.sensor_noise, self.renderer.look.exposure
        if noise is not None:
            values = self._noisy(values, noise, 1.0 if exposure is None else exposure.gain, numbers)
        image = np.asarray(self._developed(values).cpu().numpy())
        if self.renderer.mono:
            image = np.ascontiguousarray(image[..., 0])
        press = self.renderer.look.compression
        return image if press is None else np.stack([press.apply(one) for one in image])

    def _values(self, surfaces: BatchedSurfaces, ink: Tensor) -> Tensor:
        """Grey values (b, h, w, 3) before noise and rounding."""
        torch, renderer = self.engine.torch, self.renderer
        light = self._still[None]
        if self._shading is not None:
            gain = self._shading.gain(surfaces).float()
            rows, columns = self._upsampled
            light = light * (rows @ gain.movedim(-1, 1) @ columns.T)
        colour = self._single(renderer.colour)
        values = torch.stack(
            [sum(colour[k, m] * light[:, k] for k in range(len(colour))) for m in range(3)], dim=-1
        )
        values = values * (1 - self._single(renderer.contrast) * ink[..., None])
        return values + self._single(renderer.glare) if renderer.glare.size else values

    def _noisy(
        self, values: Tensor, noise: SensorNoise, gain: float, numbers: NDArray[np.intp]
    ) -> Tensor:
        """The same noise as `image_kernel.add_noise`: hashes of the number of each pixel."""
        torch, engine = self.engine.torch, self.engine
        shot = gain / noise.electrons_per_dn
        if noise.read_dn == 0 and shot == 0:
            return values
        keys = [stream_key(noise.seed, "sensor noise", int(n) + 1) for n in numbers]
        key = torch.as_tensor(np.array(keys, dtype=np.uint64).view(np.int64), device=engine.device)
        pixel = torch.arange(1, values[0, ..., 0].numel() + 1, device=engine.device)
        word = _mixed(key[:, None] + _signed(GOLDEN) * pixel)
        table = torch.as_tensor(np.array(normal_table()), device=engine.device)
        drawn = [table[_shifted(word, 21 * c + 4) & (2**BITS - 1)] for c in range(3)]
        spread = ((gain * noise.read_dn) ** 2 + shot * values.clamp(min=0.0)).sqrt()
        return values + spread * torch.stack(drawn, dim=-1).view(values.shape)

    def _developed(self, values: Tensor) -> Tensor:
        held, curve = values.clamp(0.0, 255.0), self.renderer.curve
        if curve.size == 0:
            return (held + 0.5).to(self.engine.torch.uint8)
        response = self.engine.torch.as_tensor(curve, device=self.engine.device)
        return response[(held * CURVE_STEPS + 0.5).long()]

    def _single(self, values: Array | NDArray[np.float32]) -> Tensor:
        array = np.ascontiguousarray(values, dtype=np.float32)
        return self.engine.torch.as_tensor(array, device=self.engine.device)


def _mixed(word: Tensor) -> Tensor:
    """Finaliser of SplitMix64 of 64-bit numbers, whose products wrap around."""
    word = (word ^ _shifted(word, 30)) * _signed(FIRST)
    word = (word ^ _shifted(word, 27)) * _signed(SECOND)
    return word ^ _shifted(word, 31)


def _shifted(word: Tensor, bits: int) -> Tensor:
    """64-bit numbers without a sign, shifted to the right."""
    return (word >> bits) & ((1 << (64 - bits)) - 1)


def _signed(constant: int) -> int:
    """The signed 64-bit number of the same bits."""
    return constant - (1 << 64) if constant >= 1 << 63 else constant
