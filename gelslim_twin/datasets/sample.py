"""A sample of a data set: what was drawn for it, and its frames with labels, picture and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Value = float | int | str
Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = ("train", "validation", "test")


@dataclass(frozen=True, eq=False)
class SampleFrame:
    """One frame of a sample.

    Attributes:
        number: Number of the frame in the motion of the sample, from 0; with `--frames last` it
            is not 0.
        time_s: Time since the start of the motion.
        labels: What is true of the frame, one value per name: pose of the tool, wrench on the gel,
            contact region, slip, depth. Every frame of a data set has the same names. A value
            that does not exist, such as the centre of a contact without force, is NaN.
        image: Picture (h, w, 3), uint8, RGB, or (h, w) of a mono camera; None where the scene does
            not observe `image`.
        arrays: Fields of the frame by name, whose shapes are the same in the whole data set:
            `displacement_mm` and `force_n` (c, 3) float32 over the surface nodes, `contact` (c,)
            int8 (0 free, 1 sticks, 2 slips), `markers_px` (m, 2) float32, `drawn` (m,) bool. Only
            what the scene observes.
    """

    number: int
    time_s: float
    labels: Mapping[str, Value]
    image: NDArray[np.uint8] | None
    arrays: Mapping[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Sample:
    """One sample: a contact that was drawn from the scene of a data set, and its frames.

    Attributes:
        number: Number of the sample, from 0. Numbers have gaps where a contact was not solved.
        id: Name that no other sample has, also after merging; letters, digits, `_` and `-` only.
        seed: Seed of the noise of its pictures.
        split: The split that it belongs to.
        draws: Everything that was drawn for it, one value per name. Every sample of a data set has
            the same names.
        frames: Its frames in the order of time, at least one.
    """

    number: int
    id: str
    seed: int
    split: Split
    draws: Mapping[str, Value]
    frames: tuple[SampleFrame, ...]
