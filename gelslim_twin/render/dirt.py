"""Dirt: dark specks and hairs between gel and camera."""

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
    length `hair_mm` and a width of a tenth to a fifth of a speck. Raises ValueError for values
    out of range.
    """

    specks: int = 0
    hairs: int = 0
    speck_mm: float = 0.25
    hair_mm: float = 2.5
    opacity: float = 0.6
    seed: int = 0

    def __post_init__(self) -> None:
        if min(self.specks, self.hairs) < 0 or max(self.specks, self.hairs) > 10_000:
            raise ValueError("specks and hairs must be counts from 0 to 10000")
        if not (self.speck_mm > 0 and self.hair_mm > 0):
            raise ValueError("speck_mm and hair_mm must be positive")
        if not 0 <= self.opacity <= 1:
            raise ValueError(f"the dirt's opacity = {self.opacity}: must be in 0 ... 1")

    @property
    def is_null(self) -> bool:
        """Whether the picture stays clean."""
        return self.specks + self.hairs == 0 or self.opacity == 0

    def apply(
        self, camera: VirtualCamera, pad_mm: tuple[float, float], light: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """The light (h, w, k) that the dirt transmits."""
        if self.is_null:
            return light
        from gelslim_twin.render.dot_kernel import draw_dots

        outlines = np.concatenate([self._specks_mm(pad_mm), self._hairs_mm(pad_mm)])
        points = np.zeros((outlines.shape[0] * _CORNERS, 3))
        points[:, :2] = outlines.reshape(-1, 2)
        seen = camera.project(points).reshape(outlines.shape)
        count = len(seen)
        ink = np.zeros(light.shape[:2], dtype=np.float32)
        draw_dots(
            seen, seen, np.ones(count, dtype=bool), np.ones(count, dtype=np.int64), 0,
            np.ones((count, 1)), np.zeros(count, dtype=np.int64), ink,
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
