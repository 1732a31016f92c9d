"""Compiled data of the markers near a contact. Import this module only where it runs (numba)."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def marker_data(
    used: Any,
    lateral: Any,
    model: Any,
    bent: Any,
    by_height: Any,
    noise: Any,
    errors: Any,
    residual: Any,
    weight: Any,
) -> None:
    """Lateral motion of m of n markers less that of the model, and its weights.

    Residuals count linearly beyond a number of standard deviations. These hold an error that all
    markers have, the noise of each, and a share of what linear interpolation leaves of its motion
    as the picture shows it: the root mean square over both axes.

    Args:
        used: (m,) numbers of the markers.
        lateral: (m, 2) motion that the picture shows.
        model: (n, 3) motion by the model.
        bent: (n, 3) what cubic interpolation between the nodes would add to it.
        by_height: (n, 2) lateral motion that a picture shows per mm less of height.
        noise: (n,) standard deviation by the noise of the image.
        errors: Standard deviation of all, share of the bending, and limit of the residuals.
        residual: Receives (2m,).
        weight: Receives (2m,).
    """
    common, share, limit = errors
    for k in range(len(used)):
        n = used[k]
        x = bent[n, 0] - by_height[n, 0] * bent[n, 2]
        y = bent[n, 1] - by_height[n, 1] * bent[n, 2]
        variance = common * common + noise[n] * noise[n] + share * share * (x * x + y * y) / 2
        for axis in range(2):
            left = lateral[k, axis] - model[n, axis]
            size = abs(left) / math.sqrt(variance)
            residual[2 * k + axis] = left
            weight[2 * k + axis] = min(1.0, limit / max(size, 1e-12)) / variance
