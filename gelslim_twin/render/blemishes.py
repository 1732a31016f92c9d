"""What disturbs the light of the pad: dark dirt, and bright reflections of the lamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_twin.render.random_stream import stream

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_CORNERS = 24


@dataclass(frozen=True)
class Dirt:
    """Numbers of specks and hairs on a pad; each absorbs the share `opacity` of the light.

    Specks are ellipses with axes between a third of `speck_mm` and `speck_mm`. Hairs are arcs of
    length `hair_mm` and a width of a tenth to a fifth of a speck.
    """

    specks: int = 0
    hairs: int = 0
    speck_mm: float = 0.25
    hair_mm: float = 2.5
    opacity: float = 0.6
    seed: int = 0

    def apply(
        self, camera: VirtualCamera, pad_mm: tuple[float, float], light: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """The light (h, w, k) that the dirt transmits."""
        if self.specks + self.hairs == 0 or self.opacity == 0:
            return light
        from gelslim_twin.render.dot_kernel import draw_dots

        outlines = np.concatenate([self._specks_mm(pad_mm), self._hairs_mm(pad_mm)])
        points = np.zeros((outlines.shape[0] * _CORNERS, 3))
        points[:, :2] = outlines.reshape(-1, 2)
        seen = camera.project(points).reshape(outlines.shape)
        count = len(seen)
        ink = np.zeros(light.shape[:2], dtype=np.float32)
        draw_dots(
            seen, seen, np.ones(count, dtype=bool), np.ones(count, dtype=np.int64),
            np.ones((count, 1)), np.zeros(count, dtype=np.int64),
            np.ones(count, dtype=np.float32), ink,
        )  # fmt: skip
        return light * (1 - np.float32(self.opacity) * ink)[..., None]

    def _specks_mm(self, pad_mm: tuple[float, float]) -> Array:
        random = stream(self.seed, "specks").random((self.specks, 5))
        turn = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
        half = self.speck_mm / 2 * (1 / 3 + 2 / 3 * random[:, 2:4])
        shape = np.stack([half[:, :1] * np.cos(turn), half[:, 1:] * np.sin(turn)], axis=2)
        return _placed(shape, random[:, :2], np.pi * random[:, 4], pad_mm)

    def _hairs_mm(self, pad_mm: tuple[float, float]) -> Array:
        random = stream(self.seed, "hairs").random((self.hairs, 5))
        along = np.linspace(-0.5, 0.5, _CORNERS // 2) * self.hair_mm
        bow = (random[:, 2:3] - 0.5) * 2 * (0.25 - (along / self.hair_mm) ** 2) * self.hair_mm
        thick = self.speck_mm / 20 * (1 + random[:, 3:4])
        there = np.stack([np.broadcast_to(along, bow.shape), bow + thick], axis=2)
        back = np.stack([np.broadcast_to(along, bow.shape), bow - thick], axis=2)[:, ::-1]
        shape = np.concatenate([there, back], axis=1)
        return _placed(shape, random[:, :2], 2 * np.pi * random[:, 4], pad_mm)


def _placed(shape: Array, at: Array, turn: Array, pad_mm: tuple[float, float]) -> Array:
    """Outlines (n, k, 2), rotated and moved to relative positions (n, 2) on the pad."""
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    turned = np.stack(
        [c * shape[..., 0] - s * shape[..., 1], s * shape[..., 0] + c * shape[..., 1]], axis=2
    )
    placed: Array = turned + ((at - 0.5) * np.array(pad_mm))[:, None, :]
    return placed


@dataclass(frozen=True)
class Specular:
    """Bright spots that do not move, in the colours of the lamps.

    The brightest spot reaches `brightness_percent` of white; the radii are about `radius_px`.
    """

    spots: int = 0
    brightness_percent: float = 80.0
    radius_px: float = 2.0
    seed: int = 0

    def glare(self, shape: tuple[int, int], colour: NDArray[np.float64]) -> NDArray[np.float32]:
        """What the spots add (h, w, 3), lamps of `colour` (k, 3); empty if nothing."""
        level_dn = self.brightness_percent / 100 * 255
        if self.spots == 0 or level_dn == 0:
            return np.zeros((0, 0, 3), dtype=np.float32)
        random = stream(self.seed, "specular spots").random((self.spots, 5))
        y, x = np.arange(shape[0])[:, None], np.arange(shape[1])[None, :]
        out = np.zeros((*shape, 3), dtype=np.float32)
        for u, v, size, strength, lamp in random:
            radius = self.radius_px * (0.5 + size)
            away = ((x - u * shape[1]) / radius) ** 2 + ((y - v * shape[0]) / radius) ** 2
            spot = (0.3 + 0.7 * strength) * level_dn * np.exp(-(away**2))
            tint = colour[int(lamp * len(colour))]
            tint = 0.5 + 0.5 * tint / max(tint.max(), 1e-12)
            out += (spot[..., None] * tint).astype(np.float32)
        return out
