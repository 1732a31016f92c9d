"""Compiled passes that put a frame together. Import only where they run: numba."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def compose(
    irradiance: Any,
    gain: Any,
    step: Any,
    ink: Any,
    contrast: Any,
    colour: Any,
    glare: Any,
    out: Any,
) -> None:
    """Write grey values (h, w, 3) float32: sum over sources of colour · light · (1 - c ink).

    `irradiance` (h, w, k); `gain` (r, c, k) on every `step`-th pixel, bilinear between, or empty
    for a level surface; `glare` (h, w, 3) is added, or empty.
    """
    height, width, count = irradiance.shape
    shaded, spots = gain.size > 0, glare.size > 0
    one = np.float32(1)
    row = np.ones((width, count), dtype=np.float32)
    for y in range(height):
        if shaded:
            j = min(y // step, gain.shape[0] - 2)
            v = np.float32((y - j * step) / step)
            for i in range(gain.shape[1] - 1):
                for k in range(count):
                    left = gain[j, i, k] + v * (gain[j + 1, i, k] - gain[j, i, k])
                    right = gain[j, i + 1, k] + v * (gain[j + 1, i + 1, k] - gain[j, i + 1, k])
                    grow = (right - left) / np.float32(step)
                    for x in range(i * step, min((i + 1) * step, width)):
                        row[x, k] = left + grow * np.float32(x - i * step)
                    if i == gain.shape[1] - 2:
                        for x in range((i + 1) * step, width):
                            row[x, k] = right
        for x in range(width):
            left_over = one - contrast * ink[y, x]
            a = b = c = np.float32(0)
            for k in range(count):
                light = irradiance[y, x, k] * row[x, k]
                a += colour[k, 0] * light
                b += colour[k, 1] * light
                c += colour[k, 2] * light
            out[y, x, 0] = a * left_over
            out[y, x, 1] = b * left_over
            out[y, x, 2] = c * left_over
            if spots:
                for n in range(3):
                    out[y, x, n] += glare[y, x, n]


@njit(**COMPILED)
def develop(values: Any, curve: Any, image: Any) -> None:
    """Round grey values (n,) float32 to `image` (n,) uint8, held to 0 ... 255.

    `curve` holds the response at steps of 1/16, or is empty for the straight one.
    """
    for n in range(values.size):
        value = values[n]
        if value > np.float32(255):
            value = np.float32(255)
        elif not value > np.float32(0):
            value = np.float32(0)
        if curve.size > 0:
            image[n] = curve[int(value * np.float32(16) + np.float32(0.5))]
        else:
            image[n] = np.uint8(value + np.float32(0.5))
