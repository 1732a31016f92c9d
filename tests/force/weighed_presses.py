"""Presses of a ball as a kitchen scale weighs them, for the calibrations of the gel."""

from __future__ import annotations

import numpy as np
from ball_presses import Built, ball_bundle, ball_calibration, ball_picture, rest_picture
from numpy.typing import NDArray

from gelslim_force.presses.calibrate_gel import calibrate_gel
from gelslim_force.presses.gel_calibration import GelCalibration
from gelslim_force.presses.load_table import Load

Array = NDArray[np.float64]
LOADS_N = np.array([0.1, 0.2, 0.35, 0.5, 0.8])


def presses(
    built: Built, seed: int, loads_n: Array
) -> tuple[dict[str, NDArray[np.uint8]], list[Load]]:
    """Pictures by name, and their loads as a kitchen scale would tell them."""
    rng = np.random.default_rng([7, seed])
    pictures, loads = {}, []
    for number, load_n in enumerate(loads_n):
        name = f"press{number}.png"
        place = rng.uniform(-3.5, 3.5, 2)
        pictures[name] = ball_picture(built, float(load_n), place, 100 * seed + number)
        sigma = float(np.hypot(0.005 * load_n, 0.0098))
        loads.append(Load(name, float(load_n + sigma * rng.normal()), sigma))
    return pictures, loads


def calibrated(built: Built, seed: int, loads_n: Array, **options: bool) -> GelCalibration:
    pictures, loads = presses(built, seed, loads_n)
    return calibrate_gel(
        ball_bundle(built.poissons_ratio), ball_calibration(), rest_picture(), pictures, loads,
        2 * built.ball_mm, **options,
    )  # fmt: skip
