"""Compiled sums over the bins of a picture. Import this module only where they run (numba)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_TAPS = 4


@njit(**COMPILED)
def light_data(
    value: Any,
    steep: Any,
    change: Any,
    noise: Any,
    saturated: Any,
    share: Any,
    level: Any,
    gains: Any,
    gain: Any,
    relief: Any,
    area: Any,
    camera: Any,
    errors: Any,
    by_slope: Any,
    by_gain: Any,
    residual: Any,
    weight: Any,
    sums: Any,
) -> None:
    """What c channels in n bins see less what the law of the light says, linear about the slopes.

    It is `LightLaw.change` with the weights of the residuals, which grow linearly beyond a number
    of standard deviations. What a model that is brighter sees saturated counts nothing.

    Args:
        value: (k, n) irradiance, as `LightLaw.irradiance` gives it.
        steep: (k, n, 2) its derivatives by the slopes.
        change: (c, n) seen.
        noise: (c, n) its standard deviation.
        saturated: (c, n).
        share: (k, c, n), as `LightLaw.change` takes it.
        level: (c, n), likewise.
        gains: (c, n), likewise.
        gain: What the gains are a multiple of.
        relief: (k, n) direct light over that of the slopes alone; (0, 0) where it is 1.
        area: (n,) of the bins in mm².
        camera: Exponent of the camera, and share of the light that the coat scatters back.
        errors: Standard deviation of the mean over 1 mm² by the law of the light, the same over
            what a shadow takes, and deviations beyond which a residual counts linearly.
        by_slope: Receives (c, n, 2) derivatives by the slopes.
        by_gain: Receives (c, n) derivatives by `gain`.
        residual: Receives (c, n).
        weight: Receives (c, n).
        sums: Receives weighted sums: derivative by the gain squared, derivative times residual,
            and squares of residual, change and noise.
    """
    gamma, scattered = camera
    light_error, shaded_error, limit = errors
    sources, shaded = len(value), len(relief) > 0
    for k in range(len(area)):
        for c in range(len(change)):
            light = by_x = by_y = lost = 0.0
            for source in range(sources):
                part, lit = share[source, c, k], value[source, k]
                if shaded:
                    factor = relief[source, k]
                    lost += part * abs(1 - factor)
                    lit = scattered + (lit - scattered) * factor
                    by_x += part * factor * steep[source, k, 0]
                    by_y += part * factor * steep[source, k, 1]
                else:
                    by_x += part * steep[source, k, 0]
                    by_y += part * steep[source, k, 1]
                light += part * lit
            log_light, exponent = math.log(light), gains[c, k] / gamma
            grey = math.exp(exponent * log_light)
            seen = 1 + level[c, k] * (grey - 1)
            outer = level[c, k] * exponent * grey / (seen * light)
            by_slope[c, k, 0], by_slope[c, k, 1] = outer * by_x, outer * by_y
            grown = level[c, k] * grey * log_light / (seen * gamma) * (gains[c, k] / gain)
            apart = change[c, k] - math.log(seen)
            model_error = light_error * light_error + (shaded_error * lost) ** 2
            sigma = math.sqrt(model_error / area[k] + noise[c, k] ** 2)
            w = min(1.0, limit / max(abs(apart) / sigma, 1e-12)) / (sigma * sigma)
            if saturated[c, k] and apart < 0:
                w = 0.0
            by_gain[c, k], residual[c, k], weight[c, k] = grown, apart, w
            sums[0] += w * grown * grown
            sums[1] += w * grown * apart
            sums[2] += w * apart * apart
            sums[3] += w * change[c, k] ** 2
            sums[4] += w * noise[c, k] ** 2


@njit(**COMPILED)
def number_nodes(nodes: Any, number: Any) -> Any:
    """Number the nodes (n, 16) that occur, in their order, in `number` (c,), which holds -1.

    Returns:
        How many occur.
    """
    for k in range(len(nodes)):
        for tap in range(nodes.shape[1]):
            number[nodes[k, tap]] = 0
    count = 0
    for node in range(len(number)):
        if number[node] == 0:
            number[node] = count
            count += 1
    return count


@njit(**COMPILED)
def slope_sums(
    nodes: Any,
    number: Any,
    along: Any,
    across: Any,
    by_slope: Any,
    by_gain: Any,
    residual: Any,
    weight: Any,
    matrix: Any,
    pull: Any,
    mixed: Any,
) -> None:
    """Sums over the data of c channels in n bins, by the heights of m nodes.

    A datum depends on the heights h by the row a = s_x `along` + s_y `across`.

    Args:
        nodes: (n, 16).
        number: Of each node, 0 to m - 1, see `number_nodes`.
        along: (n, 16).
        across: (n, 16).
        by_slope: (c, n, 2) derivatives s.
        by_gain: (c, n) derivatives d by the gain.
        residual: (c, n) values r.
        weight: (c, n) weights w.
        matrix: (m, m) zeros; receives the sum of w a aᵀ.
        pull: (m,), to which that of w a r is added.
        mixed: (m,), to which that of w a d is added.
    """
    channels, bins = weight.shape
    taps = _TAPS * _TAPS
    at = np.empty(taps, dtype=np.intp)
    for k in range(bins):
        xx = xy = yy = rx = ry = gx = gy = 0.0
        for c in range(channels):
            w, x, y = weight[c, k], by_slope[c, k, 0], by_slope[c, k, 1]
            xx += w * x * x
            xy += w * x * y
            yy += w * y * y
            rx += w * x * residual[c, k]
            ry += w * y * residual[c, k]
            gx += w * x * by_gain[c, k]
            gy += w * y * by_gain[c, k]
        for a in range(taps):
            at[a] = number[nodes[k, a]]
        for a in range(taps):
            left_x = xx * along[k, a] + xy * across[k, a]
            left_y = xy * along[k, a] + yy * across[k, a]
            node = at[a]
            pull[node] += rx * along[k, a] + ry * across[k, a]
            mixed[node] += gx * along[k, a] + gy * across[k, a]
            matrix[node, node] += (left_x * along[k, a] + left_y * across[k, a]) / 2
            for b in range(a + 1, taps):
                matrix[node, at[b]] += left_x * along[k, b] + left_y * across[k, b]
    # Each pair of taps was met once.
    for i in range(len(matrix)):
        for j in range(i + 1):
            matrix[i, j] = matrix[j, i] = matrix[i, j] + matrix[j, i]


@njit(**COMPILED)
def saturated_bins(image: Any, channels: Any, size: Any, limit: Any, found: Any) -> None:
    """Mark the bins (c, rows, columns) in which a pixel of a channel reaches the limit.

    Args:
        image: (h, w, 3) uint8.
        channels: (c,) those looked at.
        size: Pixels along the side of a bin.
        limit: Grey value.
        found: Receives the marks.
    """
    for i in range(found.shape[1] * size):
        for j in range(found.shape[2] * size):
            for c in range(len(channels)):
                if image[i, j, channels[c]] >= limit:
                    found[c, i // size, j // size] = True


@njit(**COMPILED)
def gather_heights(values: Any, near: Any, nodes: Any, found: Any) -> None:
    """Entries (m, 3p) of `values` (c, c, 3) for heights of nodes (m,) under forces on (p,)."""
    for k in range(len(near)):
        row = values[near[k]]
        for n in range(len(nodes)):
            one = row[nodes[n]]
            found[k, 3 * n], found[k, 3 * n + 1], found[k, 3 * n + 2] = one[0], one[1], one[2]


@njit(**COMPILED)
def gather_markers(values: Any, markers: Any, nodes: Any, found: Any) -> None:
    """Rows (2n, 3p) of lateral motions of markers (n,) under forces on nodes (p,).

    Args:
        values: (markers, 2, c, 3) motion of the markers as a picture shows it.
        markers: (n,) those used.
        nodes: (p,).
        found: Receives the rows.
    """
    for k in range(len(markers)):
        for along in range(2):
            row, out = values[markers[k], along], found[2 * k + along]
            for n in range(len(nodes)):
                one = row[nodes[n]]
                out[3 * n], out[3 * n + 1], out[3 * n + 2] = one[0], one[1], one[2]


@njit(**COMPILED)
def add_markers(values: Any, markers: Any, nodes: Any, force: Any, found: Any) -> None:
    """Add lateral motions of markers (n,) under forces (p, 3) on nodes (p,) to `found` (n, 2).

    `values` are as for `gather_markers`.
    """
    for k in range(len(markers)):
        for along in range(2):
            row, total = values[markers[k], along], 0.0
            for n in range(len(nodes)):
                one = row[nodes[n]]
                total += one[0] * force[n, 0] + one[1] * force[n, 1] + one[2] * force[n, 2]
            found[k, along] += total


@njit(**COMPILED)
def add_stencils(stencil: Any, places: Any, force: Any, number: Any, found: Any) -> None:
    """Add the heights that forces (p, 3) at places (p, 2) of a lattice make around them.

    Args:
        stencil: (2r + 1, 2r + 1, 3) height by the force along each axis, by the distance.
        places: (p, 2).
        force: (p, 3).
        number: (nx, ny) entry of `found` of each place; -1 where there is none.
        found: (f,), to which the heights are added.
    """
    reach = stencil.shape[0] // 2
    for n in range(len(places)):
        row, column = places[n, 0] - reach, places[n, 1] - reach
        for a in range(max(-row, 0), min(stencil.shape[0], number.shape[0] - row)):
            for b in range(max(-column, 0), min(stencil.shape[1], number.shape[1] - column)):
                place = number[row + a, column + b]
                if place >= 0:
                    found[place] += (
                        stencil[a, b, 0] * force[n, 0]
                        + stencil[a, b, 1] * force[n, 1]
                        + stencil[a, b, 2] * force[n, 2]
                    )
